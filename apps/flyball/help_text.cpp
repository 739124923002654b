#include <algorithm>
#include <vector>

#include "help_text.hpp"

namespace flyball::app {

namespace {

constexpr std::size_t name_bytes = 30;  ///< CLI11's width of a column.

std::size_t cells(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;  // not within a character
  }));
}

/// Whether a line is an entry, or (with a name of nothing) what one that is long means.
bool is_entry(std::string_view line) {
  return line.size() > name_bytes && line.starts_with("  ") && line[name_bytes - 1] == ' ' &&
         line[name_bytes] != ' ' && (line[2] != ' ' || line.find_first_not_of(' ') == name_bytes);
}

std::vector<std::string> folded(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    if (!lines.back().empty() && cells(lines.back()) + 1 + cells(word) > width) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + std::string(word);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string entry(std::string_view line, std::size_t width) {
  constexpr std::size_t narrow = 60;
  constexpr std::size_t under = 6;  // columns before what stands below its name
  std::string_view name = line.substr(0, name_bytes);
  name = name.substr(0, name.find_last_not_of(' ') + 1);
  const bool below = width < narrow;
  const std::size_t indent = below ? under : name_bytes;
  std::string text;
  std::string before(name);
  for (const std::string& part : folded(line.substr(name_bytes), width - indent)) {
    if (below && !before.empty()) {
      text += before + "\n";
      before.clear();
    }
    text += before + std::string(indent - std::min(indent, cells(before)), ' ') + part + "\n";
    before.clear();
  }
  return text;
}

/// Lines of prose, as they are if none is too wide.
std::string paragraph(const std::vector<std::string_view>& lines, std::size_t width) {
  const bool fits = std::all_of(lines.begin(), lines.end(),
                                [&](std::string_view line) { return cells(line) <= width; });
  std::string text;
  for (const std::string_view line : lines) {
    text += text.empty() || fits ? "" : " ";
    text += line;
    text += fits ? "\n" : "";
  }
  if (fits) {
    return text;
  }
  std::string narrow;
  for (const std::string& line : folded(text, width)) {
    narrow += line + "\n";
  }
  return narrow;
}

}  // namespace

std::string folded_help(std::string_view help, std::size_t width) {
  std::string text;
  std::vector<std::string_view> prose;
  const auto end_paragraph = [&] {
    text += paragraph(prose, width);
    prose.clear();
  };
  while (!help.empty()) {
    const std::size_t end = std::min(help.find('\n'), help.size());
    const std::string_view line = help.substr(0, end);
    help.remove_prefix(std::min(end + 1, help.size()));
    if (line.starts_with("Usage:")) {
      end_paragraph();
    }
    if (!line.empty() && line.front() != ' ') {
      prose.push_back(line);
      continue;
    }
    end_paragraph();
    text += is_entry(line) ? entry(line, width) : std::string(line) + "\n";
  }
  end_paragraph();
  return text;
}

}  // namespace flyball::app
