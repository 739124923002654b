#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

/// What is in a folder. The standard library's iterators end the process where memory is short;
/// std::bad_alloc comes of these.
namespace flyball::io {

/// The names of what is in a folder. @param error  Set if it cannot be read to its end.
[[nodiscard]] std::vector<std::string> names_in(const std::filesystem::path& folder,
                                                std::error_code& error);

struct FolderEntry {
  std::filesystem::path name;                                          ///< Relative to the folder.
  std::filesystem::file_type type = std::filesystem::file_type::none;  ///< Links are links.
};

/// Everything below a folder, each after the folder that it is in.
[[nodiscard]] std::vector<FolderEntry> entries_below(const std::filesystem::path& folder,
                                                     std::error_code& error);

/// Removes a folder with everything in it, as far as that can be.
void remove_folder(const std::filesystem::path& folder);

}  // namespace flyball::io
