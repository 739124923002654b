#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// The files of a report as its marker lists them; private to io.
namespace flyball::io {

struct WrittenFile {
  std::string name;
  std::uintmax_t size = 0;
  std::uint64_t checksum = 0;
  bool operator==(const WrittenFile&) const = default;
};

/// @param name  Relative to the report's folder.
[[nodiscard]] WrittenFile written_file(std::string name, std::string_view contents);

/// A line for each file, behind a sentence that says what they are.
[[nodiscard]] std::string marker_text(const std::vector<WrittenFile>& files);

/// The files of a marker; lines that are none are passed over.
[[nodiscard]] std::vector<WrittenFile> read_marker(const std::filesystem::path& marker);

/// Whether a name stays in the folder that it is relative to.
[[nodiscard]] bool stays_inside(const std::filesystem::path& name);

/// What stands in a folder under a name.
enum class Occupant { nothing, ours, another };

/// Whose it is: ours if it is listed and as it was written. What is no file, or leads elsewhere by
/// a link, is another's.
[[nodiscard]] Occupant occupant_of(const std::filesystem::path& folder, const std::string& name,
                                   const std::vector<WrittenFile>& listed);

}  // namespace flyball::io
