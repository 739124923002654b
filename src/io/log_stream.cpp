#include <flyball/io/log_stream.hpp>

#include <filesystem>

#include "core/try.hpp"
#include "io/log_streams.hpp"
#include "io/text.hpp"

namespace flyball {

Expected<std::optional<StreamedLog>> stream_log(const std::string& path, LogSink& sink) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return std::optional<StreamedLog>();
  }
  FLYBALL_TRY(auto file, io::ChunkedFile::open(path));
  return io::stream_log(file, path, sink);
}

namespace io {

Expected<std::optional<StreamedLog>> stream_log(ChunkedFile& file, const std::string& path,
                                                LogSink& sink) {
  file.fill(64);
  if (file.rest().starts_with("WPILOG")) {
    return stream_wpilog(file, path, sink);
  }
  if (file.rest().starts_with("\xEF\xBB\xBF")) {
    file.pass(3);
  }
  const std::size_t first = file.rest().find_first_not_of(" \t\r\n");
  const char begin = first == std::string_view::npos ? '\0' : file.rest()[first];
  const std::string name = lower(path);
  if (begin == '{') {
    return stream_sysid_json(file, path, sink);
  }
  if (begin == '\0' || begin == '[' || name.ends_with(".wpilog") || name.ends_with(".json")) {
    return std::optional<StreamedLog>();
  }
  return stream_csv(file, path, sink);
}

}  // namespace io

}  // namespace flyball
