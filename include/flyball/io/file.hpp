#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// What the file system refused.
enum class FileError {
  not_found,      ///< There is no such file (or no folder to put it in).
  is_a_folder,    ///< A folder where a file is needed.
  not_a_folder,   ///< A file where a folder is needed.
  not_a_file,     ///< A device or terminal where a file is needed, or a pipe nothing writes to.
  not_readable,   ///< It exists and cannot be read.
  not_writable,   ///< It cannot be created, written or renamed into place.
  too_large,      ///< More bytes than the caller is willing to hold.
  folder_in_use,  ///< A non-empty output folder that Flyball did not make.
};
[[nodiscard]] ErrorInfo error_info(FileError code);

/// The largest file that is read unless the caller says otherwise: 512 MiB.
inline constexpr std::size_t default_max_file_bytes = std::size_t{512} << 20;

/// The bytes of a file.
/// @param path       The file. A pipe (/dev/stdin, a shell's <(…)) is read to its end if something
///                   writes to it or has done so; nothing else that could be waited for is opened.
/// @param max_bytes  More is refused before it is held in memory.
/// @errors FileError::not_found, is_a_folder, not_a_file, not_readable, too_large.
[[nodiscard]] Expected<std::string> read_file(const std::string& path,
                                              std::size_t max_bytes = default_max_file_bytes);

/// Writes a file so that a reader sees the old contents or the new ones, never half: a temporary
/// name in the same folder, then rename. On an error nothing is left behind. A symbolic link keeps
/// pointing at its target, whose contents are replaced; devices and pipes are written directly.
/// @errors FileError::not_found (the folder), is_a_folder, not_writable.
[[nodiscard]] Expected<void> write_file_atomically(const std::string& path,
                                                   std::string_view contents);

}  // namespace flyball
