#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include <flyball/io/checksum.hpp>
#include <flyball/io/file.hpp>

#include "core/wording.hpp"
#include "io/report_marker.hpp"

namespace flyball::io {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view sentence =
    "Flyball wrote these files and replaces them with the next report as long as nobody changes "
    "them.";

template <class Number>
bool take_number(std::string_view& line, Number& number, int base) {
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number, base);
  if (error != std::errc() || end == line.data() + line.size() || *end != ' ') {
    return false;
  }
  line.remove_prefix(static_cast<std::size_t>(end - line.data()) + 1);
  return true;
}

}  // namespace

WrittenFile written_file(std::string name, std::string_view contents) {
  return {std::move(name), contents.size(), checksum(contents)};
}

std::string marker_text(const std::vector<WrittenFile>& files) {
  std::string text = fmt::format("{}\n", sentence);
  for (const WrittenFile& file : files) {
    text += fmt::format("{:016x} {} {}\n", file.checksum, file.size, file.name);
  }
  return text;
}

std::vector<WrittenFile> read_marker(const fs::path& marker) {
  constexpr std::size_t largest = std::size_t{1} << 20;
  std::vector<WrittenFile> files;
  const auto text = read_file(marker.string(), largest);
  for (std::string_view line : text ? text::split(*text, "\n") : std::vector<std::string_view>()) {
    WrittenFile file;
    if (take_number(line, file.checksum, 16) && take_number(line, file.size, 10) &&
        stays_inside(line)) {
      file.name = line;
      files.push_back(std::move(file));
    }
  }
  return files;
}

bool stays_inside(const fs::path& name) {
  const fs::path plain = name.lexically_normal();
  return !plain.empty() && plain.is_relative() && plain.has_filename() && *plain.begin() != ".." &&
         *plain.begin() != ".";
}

Occupant occupant_of(const fs::path& folder, const std::string& name,
                     const std::vector<WrittenFile>& listed) {
  std::error_code ignored;
  fs::path path = folder;
  const fs::path parents = fs::path(name).parent_path();
  for (const fs::path& part : parents) {
    path /= part;
    const fs::file_type type = fs::symlink_status(path, ignored).type();
    if (type == fs::file_type::not_found) {
      return Occupant::nothing;
    }
    if (type != fs::file_type::directory) {
      return Occupant::another;
    }
  }
  path = folder / name;
  const fs::file_type type = fs::symlink_status(path, ignored).type();
  if (type == fs::file_type::not_found) {
    return Occupant::nothing;
  }
  const std::uintmax_t size = type == fs::file_type::regular ? fs::file_size(path, ignored) : 0;
  const auto as_listed = [&](const WrittenFile& file) {
    return file.name == name && file.size == size;
  };
  if (type != fs::file_type::regular || std::none_of(listed.begin(), listed.end(), as_listed)) {
    return Occupant::another;
  }
  const auto contents = read_file(path.string(), static_cast<std::size_t>(size) + 1);
  const bool ours = contents && std::find(listed.begin(), listed.end(),
                                          written_file(name, *contents)) != listed.end();
  return ours ? Occupant::ours : Occupant::another;
}

}  // namespace flyball::io
