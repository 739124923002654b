#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// The files of a folder whose names are those of logs.
struct LogFiles {
  std::vector<std::string> paths{};  ///< With the folder in front, sorted byte by byte.
  std::size_t passed_over = 0;       ///< Files of other names.
};

/// Looks for files that end in .json, .wpilog or .csv, in any case, in a folder and those in it.
///
/// Left out are files and folders whose name begins with a dot, folders that hold a report of
/// Flyball, and what is no file. A link to a file is one; a link to a folder is not followed, so
/// that the search ends.
///
/// @param except  A folder to leave out, such as the one that the answer goes to; may be empty.
/// @errors FileError::not_found, not_a_folder, not_readable (of any folder in it).
/// Cost: the names in memory.
[[nodiscard]] Expected<LogFiles> find_log_files(const std::string& folder,
                                                const std::string& except = {});

}  // namespace flyball
