#include <flyball/io/log_files.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <flyball/io/file.hpp>
#include <flyball/io/output_folder.hpp>

#include "core/try.hpp"
#include "io/folder_entries.hpp"
#include "io/text.hpp"

namespace flyball {

namespace fs = std::filesystem;

namespace {

bool names_a_log(const std::string& name) {
  constexpr std::array<std::string_view, 3> endings{".json", ".wpilog", ".csv"};
  const std::string word = io::lower(name);
  return std::any_of(endings.begin(), endings.end(),
                     [&](std::string_view ending) { return word.ends_with(ending); });
}

class Search {
 public:
  explicit Search(const std::string& except) : except_(except) {}

  Expected<void> look_into(const fs::path& folder) {
    std::error_code error;
    const std::vector<std::string> names = io::names_in(folder, error);
    if (error) {
      return refusal(FileError::not_readable, folder.string())
          .hint("check its permissions")
          .with("system", error.message());
    }
    if (std::find(names.begin(), names.end(), OutputFolder::marker) != names.end()) {
      return {};
    }
    for (const std::string& name : names) {
      if (!name.starts_with('.')) {
        FLYBALL_CHECK(take(folder / name, name));
      }
    }
    return {};
  }

  LogFiles found{};

 private:
  Expected<void> take(const fs::path& path, const std::string& name) {
    std::error_code ignored;
    if (fs::symlink_status(path, ignored).type() == fs::file_type::directory) {
      const bool excepted = !except_.empty() && fs::equivalent(path, except_, ignored);
      return excepted ? Expected<void>{} : look_into(path);
    }
    if (fs::status(path, ignored).type() == fs::file_type::regular) {
      if (names_a_log(name)) {
        found.paths.push_back(path.lexically_normal().string());
      } else {
        ++found.passed_over;
      }
    }
    return {};
  }

  const std::string& except_;
};

}  // namespace

Expected<LogFiles> find_log_files(const std::string& folder, const std::string& except) {
  std::error_code ignored;
  const fs::file_type type = fs::status(folder, ignored).type();
  if (type == fs::file_type::not_found) {
    return refusal(FileError::not_found, folder, "the folder")
        .got("missing")
        .hint("check the spelling");
  }
  if (type != fs::file_type::directory) {
    return refusal(FileError::not_a_folder, folder, "the path").got("no folder");
  }
  Search search(except);
  FLYBALL_CHECK(search.look_into(folder));
  std::sort(search.found.paths.begin(), search.found.paths.end());
  return std::move(search.found);
}

}  // namespace flyball
