#include <cerrno>
#include <cstdio>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

#include <dirent.h>

#include "io/folder_entries.hpp"

namespace flyball::io {

namespace fs = std::filesystem;

std::vector<std::string> names_in(const fs::path& folder, std::error_code& error) {
  std::vector<std::string> names;
  struct Close {
    void operator()(DIR* open) const noexcept { ::closedir(open); }
  };
  const std::unique_ptr<DIR, Close> open(::opendir(folder.c_str()));
  errno = open ? 0 : errno;
  for (const dirent* entry = nullptr; open && (entry = ::readdir(open.get())) != nullptr;) {
    if (const std::string_view name = entry->d_name; name != "." && name != "..") {
      names.emplace_back(name);
    }
    errno = 0;
  }
  error.assign(errno, std::generic_category());
  if (error == std::errc::not_enough_memory) {
    throw std::bad_alloc();
  }
  return names;
}

std::vector<FolderEntry> entries_below(const fs::path& folder, std::error_code& error) {
  std::vector<FolderEntry> found;
  const auto add = [&](const fs::path& parent) {
    for (const std::string& name : names_in(folder / parent, error)) {
      std::error_code ignored;
      fs::path inner = parent / name;
      const fs::file_type type = fs::symlink_status(folder / inner, ignored).type();
      found.push_back({std::move(inner), type});
    }
  };
  add({});
  for (std::size_t i = 0; i < found.size() && !error; ++i) {
    if (found[i].type == fs::file_type::directory) {
      add(fs::path(found[i].name));
    }
  }
  return found;
}

void remove_folder(const fs::path& folder) {
  std::error_code ignored;
  std::vector<FolderEntry> found = entries_below(folder, ignored);
  for (; !found.empty(); found.pop_back()) {
    (void)std::remove((folder / found.back().name).c_str());
  }
  (void)std::remove(folder.c_str());
}

}  // namespace flyball::io
