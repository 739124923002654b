#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/study/project.hpp>

#include "core/wording.hpp"
#include "study/field.hpp"
#include "study/read_value.hpp"

namespace flyball::study {

namespace {

/// Shortest digits that read back to the same number, and TOML's mark of a number that is not
/// whole.
std::string shortest(double value) {
  std::string text = fmt::format("{}", value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string quantity(double value, Dimension dimension) {
  return dimension == Dimension::dimensionless
             ? shortest(value)
             : fmt::format("\"{} {}\"", shortest(value), si_unit(dimension));
}

std::string toml_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      out += fmt::format("\\u{:04x}", byte);
    } else {
      out += c == '"' || c == '\\' ? fmt::format("\\{}", c) : std::string(1, c);
    }
  }
  return out + '"';
}

/// As TOML writes it; empty for nothing, and for what has no unit while the mechanism is not known.
std::string written(const FieldValue& value, std::span<const Dimension> dimensions) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    return toml_text(*text);
  }
  if (const auto* whole = std::get_if<long long>(&value)) {
    return fmt::format("{}", *whole);
  }
  if (const auto* flag = std::get_if<bool>(&value)) {
    return *flag ? "true" : "false";
  }
  if (const auto* one = std::get_if<double>(&value); one != nullptr && !dimensions.empty()) {
    return quantity(*one, dimensions.front());
  }
  if (const auto* list = std::get_if<std::vector<double>>(&value)) {
    std::vector<std::string> parts;
    for (std::size_t i = 0; i < std::min(list->size(), dimensions.size()); ++i) {
      parts.push_back(quantity((*list)[i], dimensions[i]));
    }
    return parts.empty() ? "" : fmt::format("[{}]", fmt::join(parts, ", "));
  }
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    std::vector<std::string> parts;
    std::transform(texts->begin(), texts->end(), std::back_inserter(parts), &toml_text);
    return fmt::format("[{}]", fmt::join(parts, ", "));
  }
  if (const auto* map = std::get_if<NamedTexts>(&value)) {
    std::vector<std::string> parts;
    for (const NamedText& one : *map) {
      const bool bare = std::all_of(one.name.begin(), one.name.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_';
      });
      parts.push_back(
          fmt::format("{} = {}", bare ? one.name : toml_text(one.name), toml_text(one.text)));
    }
    return fmt::format("{{ {} }}", fmt::join(parts, ", "));
  }
  return "";
}

}  // namespace

std::string write_project(const Project& project, std::string_view heading,
                          std::span<const std::string_view> sections,
                          std::span<const KeyComment> comments) {
  const Document& document = project_document();
  const auto signals = document.signals(&project);
  const Subject subject = !project.model.states.empty() ? Subject::model
                          : !project.drive.type.empty() ? Subject::drive
                                                        : Subject::mechanism;
  const auto is_other = [&](Subject of) { return is_about_other(of, subject); };
  std::string text;
  for (const std::string_view line : text::split(heading, "\n")) {
    text += fmt::format("# {}\n", line);
  }
  for (const Section& section : document.sections) {
    const void* object = find(section, &project);
    const bool wanted = sections.empty() ||
                        std::find(sections.begin(), sections.end(), section.name) != sections.end();
    if (object == nullptr || !wanted || is_other(section.subject)) {
      continue;
    }
    std::string lines;
    for (const Field& field : section.fields) {
      if (is_other(field.subject)) {
        continue;
      }
      const std::string value = written(field.access.get(object), dimensions_of(field, signals));
      const auto comment = std::find_if(comments.begin(), comments.end(), [&](const auto& entry) {
        return entry.key == name_of(section.name, field.key);
      });
      if (!value.empty()) {
        lines +=
            fmt::format("{} = {}{}{}\n", field.key, value, comment == comments.end() ? "" : "  # ",
                        comment == comments.end() ? "" : comment->text);
      } else if (comment != comments.end()) {
        lines += fmt::format("# {} {}\n", field.key, comment->text);
      }
    }
    if (!lines.empty()) {
      text += fmt::format("{}[{}]\n{}", text.empty() ? "" : "\n", section.name, lines);
    }
  }
  return text;
}

}  // namespace flyball::study
