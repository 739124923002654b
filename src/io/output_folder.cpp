#include <flyball/io/output_folder.hpp>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <flyball/io/file.hpp>

#include "core/try.hpp"
#include "io/folder_entries.hpp"
#include "io/folder_exchange.hpp"
#include "io/report_marker.hpp"
#include "io/unfinished.hpp"
#include "io/unfinished_folder.hpp"

namespace flyball {

namespace fs = std::filesystem;

using io::WrittenFile;

struct OutputFolder::Building {
  Building() { all().push_back(this); }
  Building(const Building&) = delete;
  Building& operator=(const Building&) = delete;
  ~Building() {
    const std::lock_guard lock(io::writing());
    remove();
    std::erase(all(), this);
    if (lock_file >= 0) {
      ::close(lock_file);
    }
  }

  void remove() noexcept {
    made.remove();
    for (; !made_parents.empty(); made_parents.pop_back()) {
      ::rmdir(made_parents.back().c_str());  // removes it only if it is empty
    }
  }

  /// Those of this process; under the lock of io::writing().
  static std::vector<Building*>& all() {
    static auto& buildings = *new std::vector<Building*>;  // never destroyed: see unfinished.cpp
    return buildings;
  }

  io::UnfinishedFolder made{};
  std::vector<std::string> made_parents{};  ///< Outermost first.
  int lock_file = -1;                       ///< Of the folder, locked while its process lives.
  std::vector<WrittenFile> files{};
};

namespace {

Refusal not_writable(const std::string& path, const std::string& system) {
  return refusal(FileError::not_writable, path, "the output folder")
      .got("not writable")
      .hint("give a folder that you may write to")
      .with("system", system);
}

std::string reason() {
  return std::generic_category().message(errno);
}

/// A lock of a folder that the system takes back when the process ends; -1 if another has it.
int locked(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (file >= 0 && ::flock(file, LOCK_EX | LOCK_NB) != 0) {
    ::close(file);
    return -1;
  }
  return file;
}

/// How the names of temporary folders begin: in the destination, and beside it.
std::string temporary_inside() {
  return fmt::format("{}.", OutputFolder::marker);
}
std::string temporary_beside(const fs::path& target) {
  return fmt::format(".{}.flyball-", target.filename().string());
}

constexpr std::size_t unique = 6;  // what mkdtemp adds

bool is_temporary(const std::string& name, const std::string& prefix) {
  return name.size() == prefix.size() + unique && name.starts_with(prefix);
}

/// Removes the temporary folders that killed processes left.
void sweep(const fs::path& folder, const std::string& prefix) {
  std::error_code ignored;
  for (const std::string& name : io::names_in(folder, ignored)) {
    if (!is_temporary(name, prefix)) {
      continue;
    }
    if (const int file = locked((folder / name).string()); file >= 0) {
      io::remove_folder(folder / name);
      ::close(file);
    }
  }
}

Refusal in_use(const std::string& path, std::string what, std::string got, std::string hint) {
  return refusal(FileError::folder_in_use, path, std::move(what))
      .got(std::move(got))
      .hint(std::move(hint));
}

/// Whether a report may stand at `path`: nothing is there, an empty folder, or an earlier report,
/// whose files are as they were written.
Expected<std::vector<WrittenFile>> check_destination(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    if (fs::is_symlink(path, error)) {
      return refusal(FileError::not_a_folder, path, "the output folder")
          .got("a link to a folder that is missing")
          .hint("make that folder, or remove the link");
    }
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
  const std::vector<std::string> names = io::names_in(path, error);
  const bool empty = std::all_of(names.begin(), names.end(), [](const std::string& name) {
    return is_temporary(name, temporary_inside());
  });
  if (error) {
    return not_writable(path, error.message());
  }
  const fs::path marker = fs::path(path) / OutputFolder::marker;
  if (!empty && fs::symlink_status(marker, error).type() != fs::file_type::regular) {
    return refusal(FileError::folder_in_use, path, "the output folder")
        .got("not empty and not an earlier Flyball report")
        .expected("new, empty, or an earlier report, which is replaced")
        .hint("give another folder, so that nothing of yours is overwritten");
  }
  std::vector<WrittenFile> earlier = io::read_marker(marker);
  for (const WrittenFile& file : earlier) {
    if (io::occupant_of(path, file.name, earlier) == io::Occupant::another) {
      return in_use((fs::path(path) / file.name).string(), "the file of the earlier report",
                    "changed since",
                    "move it elsewhere or give another folder, so that it is not overwritten");
    }
  }
  return earlier;
}

/// Writes the marker into the folder that is being built.
Expected<void> mark(io::UnfinishedFolder& made, const std::vector<WrittenFile>& files) {
  const fs::path marker = fs::path(made.path) / OutputFolder::marker;
  if (const std::error_code error = made.make_way_for(OutputFolder::marker)) {
    return not_writable(marker.string(), error.message());
  }
  return write_file_atomically(marker.string(), io::marker_text(files));
}

/// Puts the report in the place of an earlier one: all of it at once, and where that cannot be,
/// file by file; whenever that is interrupted, the marker lists what is there.
Expected<void> replace(io::UnfinishedFolder& made, const fs::path& folder,
                       const std::vector<WrittenFile>& files) {
  const fs::path building = made.path;
  FLYBALL_TRY(const auto earlier, check_destination(folder.string()));
  for (const WrittenFile& file : files) {
    if (io::occupant_of(folder, file.name, earlier) == io::Occupant::another) {
      return in_use((folder / file.name).string(), "the name of a file of the report",
                    "taken by one that Flyball did not write",
                    "move it elsewhere or give another folder, so that it is not overwritten");
    }
  }
  if (building.parent_path() == folder.parent_path()) {
    FLYBALL_CHECK(mark(made, files));
    if (io::exchange(made, folder, earlier)) {
      return {};
    }
  }
  std::error_code error;
  io::Restoring restoring(folder, made);
  const auto put = [&](const fs::path& name) -> Expected<void> {
    error = restoring.keep(name);
    if (!error) {
      fs::rename(building / name, folder / name, error);
    }
    return error ? not_writable((folder / name).string(), error.message()) : Expected<void>{};
  };
  std::vector<WrittenFile> both = earlier;
  both.insert(both.end(), files.begin(), files.end());
  FLYBALL_CHECK(mark(made, both));
  FLYBALL_CHECK(put(OutputFolder::marker));
  for (const WrittenFile& file : files) {
    FLYBALL_CHECK(put(file.name));
  }
  for (const WrittenFile& file : earlier) {
    const bool stays = std::any_of(files.begin(), files.end(), [&](const WrittenFile& other) {
      return other.name == file.name;
    });
    if (!stays && io::occupant_of(folder, file.name, earlier) == io::Occupant::ours) {
      error = restoring.keep(file.name);
      fs::remove(folder / file.name, error);
      for (fs::path parent = fs::path(file.name).parent_path(); !parent.empty() && !error;
           parent = parent.parent_path()) {
        fs::remove(folder / parent, error);  // removes it only if it is empty
      }
    }
  }
  FLYBALL_CHECK(mark(made, files));
  FLYBALL_CHECK(put(OutputFolder::marker));
  restoring.done();
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
  const bool exists = fs::exists(target, error);
  if (exists) {
    target = fs::canonical(target, error);
    sweep(target, temporary_inside());
  }
  FLYBALL_CHECK(check_destination(target.string()));
  const std::lock_guard lock(io::writing());
  OutputFolder folder(std::make_unique<Building>(), target.string());
  Building& building = *folder.building_;
  std::vector<fs::path> missing;
  for (fs::path parent = target.parent_path(); !fs::exists(parent, error) && !error;
       parent = parent.parent_path()) {
    missing.push_back(parent);
  }
  for (auto parent = missing.rbegin(); parent != missing.rend(); ++parent) {
    if (!fs::create_directory(*parent, error)) {
      return not_writable(path, error.message());
    }
    building.made_parents.push_back(parent->string());
  }
  const std::string prefix = temporary_beside(target);
  sweep(target.parent_path(), prefix);
  std::string beside = (target.parent_path() / (prefix + "XXXXXX")).string();
  std::string inside = (target / (temporary_inside() + "XXXXXX")).string();
  std::string& pattern = exists ? inside : beside;
  if (::mkdtemp(pattern.data()) == nullptr) {
    return not_writable(path, reason());
  }
  building.made.path.swap(pattern);
  // What is built beside the folder can take its place at once. What is mounted there, or is in a
  // folder that others may write to only, keeps it inside.
  if (exists) {
    beside.replace(beside.size() - unique, unique, building.made.path,
                   building.made.path.size() - unique, unique);
    if (::rename(building.made.path.c_str(), beside.c_str()) == 0) {
      building.made.path.swap(beside);
    }
  }
  building.lock_file = locked(building.made.path);
  // mkdtemp makes the folder private; a report is as open as the user's other folders.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  struct stat status{};
  ::stat(building.made.path.c_str(), &status);
  ::chmod(building.made.path.c_str(), (0777 & ~mask) | (status.st_mode & S_ISGID));
  return folder;
}

OutputFolder::OutputFolder(std::unique_ptr<Building> building, std::string destination)
    : building_(std::move(building)), destination_(std::move(destination)) {}
OutputFolder::OutputFolder(OutputFolder&& other) noexcept = default;
OutputFolder& OutputFolder::operator=(OutputFolder&& other) noexcept = default;
OutputFolder::~OutputFolder() = default;

const std::string& OutputFolder::path() const noexcept {
  static const std::string none;
  return building_ ? building_->made.path : none;
}

Expected<void> OutputFolder::write(std::string_view name, std::string_view contents) {
  const fs::path relative = fs::path(name).lexically_normal();
  if (!building_ || !io::stays_inside(relative) || name.find('\n') != std::string_view::npos) {
    return refusal(FileError::not_writable, "OutputFolder::write", fmt::format("\"{}\"", name))
        .got("not a name in the folder");
  }
  const std::lock_guard lock(io::writing());
  const fs::path path = building_->made.path / relative;
  if (const std::error_code error = building_->made.make_way_for(relative)) {
    return not_writable(path.parent_path().string(), error.message());
  }
  // The folder that is being built has a passing name; the person knows the one it will have.
  auto written = write_file_atomically(path.string(), contents).map_error([&](Error refused) {
    return std::move(refused).in((fs::path(destination_) / relative).string());
  });
  if (written) {
    std::erase_if(building_->files,
                  [&](const WrittenFile& file) { return file.name == relative.string(); });
    building_->files.push_back(io::written_file(relative.string(), contents));
  }
  return written;
}

Expected<void> OutputFolder::commit() {
  if (!building_) {
    return not_writable(destination_, "the folder was committed before");
  }
  const std::lock_guard lock(io::writing());
  Building& building = *building_;
  std::error_code error;
  if (!fs::exists(fs::symlink_status(destination_, error))) {
    FLYBALL_CHECK(mark(building.made, building.files));
    fs::rename(building.made.path, destination_, error);
    if (error) {
      return not_writable(destination_, error.message());
    }
  } else {
    FLYBALL_CHECK(replace(building.made, destination_, building.files));
  }
  building_->made_parents.clear();
  building_.reset();
  return {};
}

void OutputFolder::abandon_all() noexcept {
  io::writing().lock();  // for ever
  io::kill_children();
  for (Building* building : Building::all()) {
    building->remove();
  }
}

}  // namespace flyball
