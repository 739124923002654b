#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

/// What is undone if a report cannot be finished. Undoing takes no memory: it may be for want of
/// that.
namespace flyball::io {

/// A folder that is being built, and what was made in it.
struct UnfinishedFolder {
  std::string path{};
  std::vector<std::string> entries{};  ///< Each after the folder that it is in.

  /// Makes the folders of a file that is to be made. @param name  Relative.
  [[nodiscard]] std::error_code make_way_for(const std::filesystem::path& name);
  void remove() noexcept;
};

/// What stood in a folder before files were put there, to be put back unless `done`: a second link
/// to each beside the new ones, so that at no moment a name is without a file. Where a file system
/// has no links nothing is kept.
class Restoring {
 public:
  Restoring(std::filesystem::path folder, UnfinishedFolder& building);
  Restoring(const Restoring&) = delete;
  Restoring& operator=(const Restoring&) = delete;
  ~Restoring();

  /// Makes the folders of a file that is to be put there, or goes. @param name  Relative.
  [[nodiscard]] std::error_code keep(const std::filesystem::path& name);
  void done() noexcept { steps_.clear(); }

 private:
  struct Step {
    std::string kept;  ///< Empty: the name was free.
    std::string there;
  };
  void undo(Step& step) const noexcept;

  std::filesystem::path folder_;
  UnfinishedFolder& building_;
  std::vector<Step> steps_;
};

}  // namespace flyball::io
