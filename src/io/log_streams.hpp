#pragma once

#include <optional>
#include <string>

#include <flyball/io/log_stream.hpp>

#include "io/chunked_file.hpp"

/// One reader a format; private to io. Each as `stream_log`.
namespace flyball::io {

/// That of the format that the file's first bytes tell. @param source  Its name.
[[nodiscard]] Expected<std::optional<StreamedLog>> stream_log(ChunkedFile& file,
                                                              const std::string& source,
                                                              LogSink& sink);
[[nodiscard]] Expected<std::optional<StreamedLog>> stream_csv(ChunkedFile& file,
                                                              const std::string& source,
                                                              LogSink& sink);
[[nodiscard]] Expected<std::optional<StreamedLog>> stream_wpilog(ChunkedFile& file,
                                                                 const std::string& source,
                                                                 LogSink& sink);
[[nodiscard]] Expected<std::optional<StreamedLog>> stream_sysid_json(ChunkedFile& file,
                                                                     const std::string& source,
                                                                     LogSink& sink);

}  // namespace flyball::io
