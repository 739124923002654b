#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <flyball/io/file.hpp>

#include "core/try.hpp"

namespace flyball {
namespace {

namespace fs = std::filesystem;

Refusal not_writable(const std::string& path, const std::string& system) {
  return refusal(FileError::not_writable, path, "the output folder")
      .got("not writable")
      .hint("give a folder that you may write to")
      .with("system", system);
}

/// Whether a report may stand at `path`: nothing is there, an empty folder, or an earlier report.
Expected<void> check_destination(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    return {};
  }
  if (status.type() == fs::file_type::none) {
    return not_writable(path, error.message());
  }
  if (!fs::is_directory(status)) {
    return refusal(FileError::not_a_folder, path, "the output folder")
        .got("a file")
        .expected("a folder, or a path where nothing is yet");
  }
  const bool empty = fs::is_empty(path, error);
  if (error) {
    return not_writable(path, error.message());
  }
  if (!empty && !fs::is_regular_file(fs::path(path) / OutputFolder::marker, error)) {
    return refusal(FileError::folder_in_use, path, "the output folder")
        .got("not empty and not an earlier Flyball report")
        .expected("new, empty, or an earlier report, which is replaced")
        .hint("give another folder, so that nothing of yours is overwritten");
  }
  return {};
}

}  // namespace

Expected<OutputFolder> OutputFolder::create(const std::string& path) {
  std::error_code error;
  fs::path target = fs::absolute(path, error).lexically_normal();
  if (!target.has_filename()) {
    target = target.parent_path();  // "report/" names the folder "report"
  }
  if (path.empty() || !target.has_filename()) {
    return not_writable(path, "no folder name");
  }
  if (fs::exists(target, error)) {
    target = fs::canonical(target, error);
  }
  OutputFolder folder;
  folder.destination_ = target.string();
  FLYBALL_CHECK(check_destination(folder.destination_));
  std::vector<fs::path> missing;
  for (fs::path parent = target.parent_path(); !fs::exists(parent, error) && !error;
       parent = parent.parent_path()) {
    missing.push_back(parent);
  }
  for (auto parent = missing.rbegin(); parent != missing.rend(); ++parent) {
    if (!fs::create_directory(*parent, error)) {
      return not_writable(path, error.message());
    }
    folder.made_parents_.push_back(parent->string());
  }
  std::string pattern =
      (target.parent_path() / fmt::format(".{}.XXXXXX", target.filename().string())).string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    return not_writable(path, std::generic_category().message(errno));
  }
  folder.building_ = pattern;
  // mkdtemp makes the folder private; a report is as open as the user's other folders.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::chmod(pattern.c_str(), 0777 & ~mask);
  return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : building_(std::exchange(other.building_, {})),
      destination_(std::move(other.destination_)),
      made_parents_(std::exchange(other.made_parents_, {})) {}

OutputFolder& OutputFolder::operator=(OutputFolder&& other) noexcept {
  if (this != &other) {
    discard();
    building_ = std::exchange(other.building_, {});
    destination_ = std::move(other.destination_);
    made_parents_ = std::exchange(other.made_parents_, {});
  }
  return *this;
}

OutputFolder::~OutputFolder() {
  discard();
}

void OutputFolder::discard() noexcept {
  std::error_code ignored;
  if (!building_.empty()) {
    fs::remove_all(building_, ignored);
    building_.clear();
  }
  for (; !made_parents_.empty(); made_parents_.pop_back()) {
    fs::remove(made_parents_.back(), ignored);  // removes it only if it is empty
  }
}

Expected<void> OutputFolder::write(std::string_view name, std::string_view contents) const {
  const fs::path relative = fs::path(name).lexically_normal();
  if (building_.empty() || relative.empty() || relative.is_absolute() ||
      *relative.begin() == "..") {
    return refusal(FileError::not_writable, "OutputFolder::write", fmt::format("\"{}\"", name))
        .got("not a name in the folder");
  }
  const fs::path path = building_ / relative;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) {
    return not_writable(path.parent_path().string(), error.message());
  }
  // The folder that is being built has a passing name; the person knows the one it will have.
  return write_file_atomically(path.string(), contents).map_error([&](Error refused) {
    return std::move(refused).in((fs::path(destination_) / relative).string());
  });
}

Expected<void> OutputFolder::commit() {
  if (building_.empty()) {
    return not_writable(destination_, "the folder was committed before");
  }
  Expected<void> ok =
      write(marker, "Flyball replaces this folder when it writes the next report.\n");
  if (ok) {
    ok = check_destination(destination_);
  }
  if (!ok) {
    return ok;
  }
  std::error_code error;
  if (fs::exists(destination_, error)) {
    const std::string earlier = building_ + ".earlier";
    fs::rename(destination_, earlier, error);
    if (error) {
      return not_writable(destination_, error.message());
    }
    fs::rename(building_, destination_, error);
    if (error) {
      std::error_code ignored;
      fs::rename(earlier, destination_, ignored);
      return not_writable(destination_, error.message());
    }
    std::error_code ignored;
    fs::remove_all(earlier, ignored);
  } else {
    fs::rename(building_, destination_, error);
    if (error) {
      return not_writable(destination_, error.message());
    }
  }
  building_.clear();
  made_parents_.clear();
  return {};
}

}  // namespace flyball
