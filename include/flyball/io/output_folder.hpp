#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>

namespace flyball {

/// A report folder: it is built under a temporary name and put in place by `commit`; without a
/// commit, the destructor removes every trace. A folder that is new appears whole.
///
/// Of a folder that is there only files may go that Flyball wrote and nobody changed: its marker,
/// `.flyball-report`, lists them with size and checksum. Everything else in it stays, and so do its
/// mode and its owner. The new report takes the place of the earlier one in one step, its folder
/// with it, so that a process that is killed leaves all of the one or all of the other. Where that
/// cannot be (something is mounted there, a program works in it, it has folders of the user's own,
/// the parent may not be written to, no Linux), the folder stays, and its files are replaced one by
/// one: killed in the middle, it is one that the next run knows. Temporary folders that a killed
/// process left are swept by the next.
class OutputFolder {
 public:
  static constexpr std::string_view marker = ".flyball-report";

  /// @param path  The destination. It may not exist, be empty, or hold an earlier report; missing
  ///              parents are made.
  /// @errors FileError::folder_in_use (it holds what is not Flyball's, or a file of the report was
  ///         changed since), not_a_folder, not_writable.
  [[nodiscard]] static Expected<OutputFolder> create(const std::string& path);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&& other) noexcept;
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  ~OutputFolder();

  /// Where to write until `commit`: the temporary folder.
  [[nodiscard]] const std::string& path() const noexcept;
  /// Where the folder will stand.
  [[nodiscard]] const std::string& destination() const noexcept { return destination_; }

  /// Writes a file of the report. @param name  Relative, such as "gains.toml" or "data/fit.csv".
  /// @errors FileError::not_writable, also for a name that leads out of the folder.
  [[nodiscard]] Expected<void> write(std::string_view name, std::string_view contents);

  /// Puts the folder in place. @errors FileError::folder_in_use (somebody filled the destination
  /// meanwhile, or a file of another stands where one of the report would), not_writable.
  [[nodiscard]] Expected<void> commit();

  /// For a process that was told to end: removes all temporary folders and kills gnuplot. No file
  /// is being written then, and none can be any more: whoever tries waits for ever.
  static void abandon_all() noexcept;

 private:
  struct Building;
  OutputFolder(std::unique_ptr<Building> building, std::string destination);

  std::unique_ptr<Building> building_;  ///< Null once committed or moved from.
  std::string destination_;
};

}  // namespace flyball
