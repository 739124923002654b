#include <algorithm>
#include <cstdio>
#include <map>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/xattr.h>
#endif

#include <flyball/io/output_folder.hpp>

#include "core/wording.hpp"
#include "io/folder_entries.hpp"
#include "io/folder_exchange.hpp"

namespace flyball::io {

namespace fs = std::filesystem;

namespace {

bool is_below(const fs::path& path, const fs::path& folder) {
  const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

/// Whether a process has the folder, or one in it, as its working folder: that would be gone.
bool somebody_works_in(const fs::path& folder) {
  std::error_code error;
  if (is_below(fs::current_path(error), folder) || error) {
    return true;
  }
  const std::vector<std::string> processes = names_in("/proc", error);
  return std::any_of(processes.begin(), processes.end(), [&](const std::string& process) {
    std::error_code ended;
    const fs::path place = fs::read_symlink(fs::path("/proc") / process / "cwd", ended);
    return !ended && is_below(place, folder);
  });
}

/// Access lists and what else is written beside a folder.
std::map<std::string, std::string> attributes_of(const fs::path& folder) {
  std::map<std::string, std::string> attributes;
#ifdef __linux__
  std::string names(1 << 16, '\0');
  std::string value(1 << 16, '\0');
  const ssize_t size = ::listxattr(folder.c_str(), names.data(), names.size());
  names.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  for (const std::string_view name : text::split(names, std::string_view("\0", 1))) {
    std::string known(name);
    const ssize_t length = ::getxattr(folder.c_str(), known.c_str(), value.data(), value.size());
    if (length >= 0) {
      attributes[std::move(known)] = value.substr(0, static_cast<std::size_t>(length));
    }
  }
#endif
  return attributes;
}

/// Makes a folder as open as another, and whose that one is. @return Whether they are alike then.
bool make_alike(const fs::path& made, const fs::path& folder) {
  struct stat wanted{};
  struct stat is{};
  if (::stat(folder.c_str(), &wanted) != 0 || ::stat(made.c_str(), &is) != 0 ||
      wanted.st_dev != is.st_dev) {
    return false;
  }
  if ((wanted.st_uid != is.st_uid || wanted.st_gid != is.st_gid) &&
      ::chown(made.c_str(), wanted.st_uid, wanted.st_gid) != 0) {
    return false;
  }
  return ::chmod(made.c_str(), wanted.st_mode & 07777) == 0 && ::stat(made.c_str(), &is) == 0 &&
         wanted.st_mode == is.st_mode && attributes_of(made) == attributes_of(folder);
}

/// A folder of somebody's own is not remade.
bool holds_files_of(const std::vector<WrittenFile>& report, const fs::path& folder) {
  return std::any_of(report.begin(), report.end(), [&](const WrittenFile& file) {
    return is_below(fs::path(file.name).parent_path(), folder);
  });
}

bool is_of_report(const fs::path& folder, const std::string& name,
                  const std::vector<WrittenFile>& report) {
  return name == OutputFolder::marker || occupant_of(folder, name, report) == Occupant::ours;
}

/// What was saved in `before` since its files were linked: it goes where they are.
void bring_over(const fs::path& before, const fs::path& folder,
                const std::vector<WrittenFile>& earlier) {
  std::error_code ignored;
  for (const FolderEntry& entry : entries_below(before, ignored)) {
    struct stat saved{};
    struct stat linked{};
    const fs::path from = before / entry.name;
    const fs::path to = folder / entry.name;
    if (entry.type != fs::file_type::directory && ::lstat(from.c_str(), &saved) == 0 &&
        !(::lstat(to.c_str(), &linked) == 0 && linked.st_ino == saved.st_ino) &&
        !is_of_report(before, entry.name.string(), earlier)) {
      (void)std::rename(from.c_str(), to.c_str());
    }
  }
}

/// Adds to `made` what is in `folder` and not of the report.
/// @param before  Learns what is in `folder`, as it will stand where `made` is.
bool take_in(UnfinishedFolder& made, const fs::path& folder,
             const std::vector<WrittenFile>& earlier, UnfinishedFolder& before) {
  const fs::path beside = made.path;
  std::error_code error;
  const std::vector<FolderEntry> entries = entries_below(folder, error);
  for (const auto& [name, type] : entries) {
    before.entries.push_back((beside / name).string());
    if (type == fs::file_type::directory) {
      if (!holds_files_of(earlier, name)) {
        return false;
      }
    } else if (!error && !is_of_report(folder, name.string(), earlier)) {
      error = made.make_way_for(name);
      if (!error) {
        fs::create_hard_link(folder / name, beside / name, error);
      }
    }
  }
  return !error && std::all_of(entries.begin(), entries.end(), [&](const FolderEntry& entry) {
    std::error_code ignored;
    const fs::file_status status = fs::symlink_status(beside / entry.name, ignored);
    return entry.type != fs::file_type::directory || !fs::exists(status) ||
           make_alike(beside / entry.name, folder / entry.name);
  });
}

}  // namespace

bool exchange(UnfinishedFolder& made, const fs::path& folder,
              const std::vector<WrittenFile>& earlier) {
#ifdef RENAME_EXCHANGE
  UnfinishedFolder before{made.path, {}};
  if (!take_in(made, folder, earlier, before) || !make_alike(made.path, folder) ||
      somebody_works_in(folder) ||
      ::renameat2(AT_FDCWD, made.path.c_str(), AT_FDCWD, folder.c_str(), RENAME_EXCHANGE) != 0) {
    return false;
  }
  std::swap(made, before);
  try {
    bring_over(made.path, folder, earlier);
  } catch (const std::bad_alloc&) {
    return true;  // nobody was so quick
  }
  return true;
#else
  return false;
#endif
}

}  // namespace flyball::io
