// What is wrong with a project file, and where it stands.
#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/math/expression/formula.hpp>

#include "core/controls.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

constexpr std::size_t most_errors = 20;

// The characters of a line, each with all its bytes; what is no text is a question mark, so that a
// file cannot write on the terminal what it likes.
std::vector<std::string> characters(std::string_view line) {
  std::vector<std::string> all;
  for (const char c : line) {
    const auto byte = static_cast<unsigned char>(c);
    if (!all.empty() && byte >= 0x80 && byte < 0xc0) {
      all.back() += c;
    } else {
      all.emplace_back(1, byte == '\t' ? ' ' : byte < 0x20 || byte == 0x7f ? '?' : c);
    }
  }
  for (std::string& character : all) {
    if (text::steering_bytes(character, 0) > 0) {
      character = "?";
    }
  }
  return all;
}

}  // namespace

void TomlDocument::refuse(std::string_view section, std::string_view key, Error error,
                          Fault fault) {
  const toml::table* keys = table(section);
  toml::source_region source = source_of(section);
  auto option = options_.find(name_of(section, key));
  if (option == options_.end()) {
    option = options_.find(section);  // of a table whose keys a person chooses
  }
  if (option != options_.end()) {
    error = std::move(error).in(option->second == error.subject() ? "" : option->second);
    found_.push_back({{}, std::move(error), true, {}});
    return;
  }
  if (keys != nullptr && keys->contains(key)) {
    source = fault == Fault::key ? keys->find(key)->first.source() : keys->get(key)->source();
  }
  found_.push_back({source, std::move(error).in(place(source)), true, {}});
}

void TomlDocument::refuse_item(std::string_view section, std::string_view key, std::size_t index,
                               Error error) {
  const toml::node* value = node(section, key);
  const toml::array* list = value != nullptr ? value->as_array() : nullptr;
  const toml::node* item = list != nullptr ? list->get(index) : nullptr;
  if (item == nullptr || options_.find(name_of(section, key)) != options_.end()) {
    refuse(section, key, std::move(error));
    return;
  }
  const toml::source_region source = item->source();
  found_.push_back({source, std::move(error).in(place(source)), true, {}});
}

void TomlDocument::refuse_part(std::string_view section, std::string_view key, Error error) {
  const toml::node* value = node(section, key);
  const auto evidence = [&](std::string_view of) {
    for (const Evidence& one : error.evidence()) {
      if (one.name == of && one.values.size() == 1) {
        return static_cast<std::size_t>(one.values.front());
      }
    }
    return std::string::npos;
  };
  const std::size_t offset = evidence("offset");
  if (value == nullptr || !value->is_string() || offset == std::string::npos) {
    // Without a place in the text it is about the name.
    refuse(section, key, std::move(error), offset == std::string::npos ? Fault::key : Fault::value);
    return;
  }
  const std::string text = *value->value_exact<std::string>();
  toml::source_region source = value->source();
  const std::string_view line = line_of(source.begin.line);
  // Where the text stands in the file as it is, between quotes, its parts have places of their own.
  const std::vector<std::string> all = characters(line);
  const std::size_t begin = std::min<std::size_t>(source.begin.column, all.size());
  const std::vector<std::string> written = characters(text);
  const bool as_it_is =
      source.begin.line != 0 && begin + written.size() < all.size() &&
      std::equal(written.begin(), written.end(), all.begin() + static_cast<std::ptrdiff_t>(begin));
  if (!as_it_is) {
    const std::string lines = expression::caret_lines(text, error);
    refuse(section, key, std::move(error));
    found_.back().excerpt = lines;
    return;
  }
  const auto count = [&](std::size_t from, std::size_t bytes) {
    return static_cast<toml::source_index>(
        characters(std::string_view(text).substr(std::min(from, text.size()), bytes)).size());
  };
  source.begin.column = source.begin.column + 1 + count(0, offset);
  source.end = source.begin;
  source.end.column += std::max<toml::source_index>(count(offset, evidence("length")), 1);
  found_.push_back({source, std::move(error).in(place(source)), true, {}});
}

QuotedError TomlDocument::missing(std::string_view section, std::string_view key,
                                  std::string hint) const {
  const toml::source_region source = source_of(section);
  return {Error(ProjectError::missing_key)
              .in(place(source))
              .about(name(section, key))
              .got("missing")
              .hint(std::move(hint)),
          {},
          place_in_file(source)};
}

void TomlDocument::miss(std::string_view section, std::string_view key, std::string hint) {
  if (std::find(meant_.begin(), meant_.end(), name_of(section, key)) != meant_.end()) {
    return;
  }
  found_.push_back({source_of(section), missing(section, key, std::move(hint)), false, {}});
}

std::optional<Errors> TomlDocument::errors() const {
  if (found_.empty()) {
    return std::nullopt;
  }
  std::vector<const Found*> sorted;
  for (const Found& found : found_) {
    sorted.push_back(&found);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const Found* a, const Found* b) {
    return std::tie(a->source.begin.line, a->source.begin.column) <
           std::tie(b->source.begin.line, b->source.begin.column);
  });
  std::vector<QuotedError> all;
  for (const Found* found : sorted) {
    if (all.size() == most_errors) {
      all.push_back({Error(ProjectError::more_errors)
                         .in(file_)
                         .with("number", static_cast<double>(sorted.size() - most_errors)),
                     {}});
      break;
    }
    all.push_back({found->error,
                   !found->excerpt.empty() ? found->excerpt
                   : found->quote          ? excerpt(found->source)
                                           : "",
                   place_in_file(found->source)});
  }
  return Errors(std::move(all));
}

toml::source_region TomlDocument::source_of(std::string_view section) const {
  const toml::table* keys = table(section);
  return keys == nullptr ? root_.source() : keys->source();
}

std::string TomlDocument::place(const toml::source_region& source) const {
  return source.begin.line == 0
             ? file_
             : fmt::format("{}:{}:{}", file_, source.begin.line, source.begin.column);
}

std::optional<Place> TomlDocument::place_in_file(const toml::source_region& source) {
  const toml::source_position& at = source.begin;
  return at.line == 0 ? std::nullopt : std::optional<Place>({at.line, at.column});
}

std::string_view TomlDocument::line_of(toml::source_index number) const {
  std::string_view rest = text_;
  for (toml::source_index line = 1; line < number; ++line) {
    rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
  }
  return rest.substr(0, rest.find_first_of("\r\n"));
}

std::string TomlDocument::excerpt(const toml::source_region& source) const {
  if (source.begin.line == 0) {
    return "";
  }
  std::string text(line_of(source.begin.line));
  std::replace(text.begin(), text.end(), '\t', ' ');
  const std::vector<std::string> line = characters(text);
  // Of a long line, what stands about the place.
  constexpr std::size_t widest = 100;
  const std::size_t at = std::min<std::size_t>(source.begin.column - 1, line.size());
  const std::size_t first = line.size() > widest && at > widest / 2 ? at - widest / 2 : 0;
  const std::span<const std::string> shown =
      std::span(line).subspan(first, std::min(widest, line.size() - first));
  const bool one_line = source.end.line == source.begin.line && source.end.column > at + 1;
  const std::size_t length = one_line ? source.end.column - 1 - at : 1;
  return fmt::format("{:>5} | {}\n{:>5} | {}{}", source.begin.line, fmt::join(shown, ""), "",
                     std::string(at - first, ' '),
                     std::string(std::clamp<std::size_t>(length, 1, widest), '^'));
}

}  // namespace flyball::study
