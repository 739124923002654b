#include <algorithm>
#include <cstdio>
#include <utility>

#include <sys/stat.h>
#include <unistd.h>

#include "io/folder_entries.hpp"
#include "io/unfinished_folder.hpp"

namespace flyball::io {

namespace fs = std::filesystem;

std::error_code UnfinishedFolder::make_way_for(const fs::path& name) {
  std::error_code error;
  fs::path place = path;
  const fs::path parents = name.parent_path();
  for (const fs::path& part : parents) {
    place /= part;
    entries.push_back(place.string());
    if (!fs::create_directory(place, error)) {
      entries.pop_back();  // It was there, or cannot be made.
    }
    if (error) {
      return error;
    }
  }
  entries.push_back((fs::path(path) / name).string());
  return error;
}

void UnfinishedFolder::remove() noexcept {
  for (; !entries.empty(); entries.pop_back()) {
    (void)std::remove(entries.back().c_str());
  }
  if (!path.empty() && ::rmdir(path.c_str()) != 0) {
    try {
      remove_folder(path);  // Another put something there.
    } catch (...) {
      return;  // The next run sweeps it.
    }
  }
}

Restoring::Restoring(fs::path folder, UnfinishedFolder& building)
    : folder_(std::move(folder)), building_(building) {}

Restoring::~Restoring() {
  for (; !steps_.empty(); steps_.pop_back()) {
    undo(steps_.back());
  }
}

void Restoring::undo(Step& step) const noexcept {
  if (step.kept.empty()) {
    (void)std::remove(step.there.c_str());
    return;
  }
  // Folders went if they were empty.
  for (std::size_t slash = step.there.find('/', folder_.native().size() + 1);
       slash != std::string::npos; slash = step.there.find('/', slash + 1)) {
    step.there[slash] = '\0';
    ::mkdir(step.there.c_str(), 0777);
    step.there[slash] = '/';
  }
  (void)std::rename(step.kept.c_str(), step.there.c_str());
}

std::error_code Restoring::keep(const fs::path& name) {
  std::error_code error;
  fs::path place = folder_;
  const fs::path parents = name.parent_path();
  for (const fs::path& part : parents) {
    place /= part;
    steps_.push_back({"", place.string()});
    if (!fs::create_directory(place, error)) {
      steps_.pop_back();
    }
    if (error) {
      return error;
    }
  }
  Step step{"", (folder_ / name).string()};
  if (std::any_of(steps_.begin(), steps_.end(),
                  [&](const Step& earlier) { return earlier.there == step.there; })) {
    return error;  // of a marker that is written twice the first counts
  }
  std::error_code ignored;
  steps_.reserve(steps_.size() + 1);
  if (fs::exists(step.there, ignored)) {
    const fs::path kept = fs::path(".kept") / name;
    step.kept = (fs::path(building_.path) / kept).string();
    if (!building_.make_way_for(kept)) {
      fs::create_hard_link(step.there, step.kept, ignored);
    }
  }
  steps_.push_back(std::move(step));
  return error;
}

}  // namespace flyball::io
