#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/math/expression/formula.hpp>

#include "core/try.hpp"
#include "study/read_value.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

constexpr std::size_t most_errors = 20;

struct Split {
  std::string_view parent;  // empty for a section of the root
  std::string_view name;
};

Split split(std::string_view section) {
  const std::size_t dot = section.rfind('.');
  return dot == std::string_view::npos ? Split{"", section}
                                       : Split{section.substr(0, dot), section.substr(dot + 1)};
}

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
  return all;
}

}  // namespace

TomlDocument::TomlDocument(std::string_view text, std::string file)
    : text_(text), file_(std::move(file)) {
  try {
    root_ = toml::parse(text, file_);
  } catch (const toml::parse_error& problem) {
    is_toml_ = false;
    found_.push_back({problem.source(),
                      Error(ProjectError::syntax)
                          .in(place(problem.source()))
                          .hint(std::string(problem.description())),
                      true,
                      {}});
  }
}

void TomlDocument::apply(std::span<const Override> overrides, std::span<const Section> sections) {
  for (const auto& [option, text] : is_toml_ ? overrides : std::span<const Override>()) {
    std::vector<std::string> known;
    for (const Section& section : sections) {
      for (const Field& field : section.fields) {
        known.push_back(option_of(field));
        if (known.back() != option) {
          continue;
        }
        // No section of a section has options.
        const auto [place, inserted] = root_.insert(section.name, toml::table{});
        if (toml::table* keys = place->second.as_table()) {
          insert_text(*keys, field, text);
        }
        options_[name_of(section.name, field.key)] = option;
      }
    }
    if (std::find(known.begin(), known.end(), option) == known.end()) {
      const std::vector<std::string_view> names(known.begin(), known.end());
      const std::string nearest = nearest_name(option, names);
      found_.push_back(
          {{},
           Error(ProjectError::unknown_key)
               .about(option)
               .got("not an option that is known")
               .hint(nearest.empty() ? "" : fmt::format("did you mean \"{}\"?", nearest))});
    }
  }
}

void TomlDocument::read(const Document& document, void* into) {
  if (!is_toml_) {
    return;
  }
  std::vector<std::string_view> names;
  for (const Section& section : document.sections) {
    if (split(section.name).parent.empty()) {
      names.push_back(section.name);
    }
  }
  check_names(root_, "", names);
  for (const Section& section : document.sections) {
    const auto [parent, key] = split(section.name);
    if (const toml::table* keys = table(section.name)) {
      read_section(section, *keys, document, into);
    } else if (const toml::node* other = node(parent, key); other != nullptr && parent.empty()) {
      // Where a section of a section may be a key as well, the key's row reads it.
      refuse(parent, key,
             Error(ProjectError::wrong_type)
                 .about(std::string(key))
                 .got("no section")
                 .expected(fmt::format("a section, written [{}]", section.name)),
             Fault::value);
    }
  }
}

void TomlDocument::read_section(const Section& section, const toml::table& keys,
                                const Document& document, void* into) {
  std::vector<std::string_view> known;
  for (const Field& field : section.fields) {
    known.push_back(field.key);
  }
  check_names(keys, section.name, known);
  void* object = section.within(into, true);
  for (const Field& field : section.fields) {
    const toml::node* value = keys.get(field.key);
    if (value == nullptr) {
      if (field.required && writes(section.name)) {
        miss(section.name, field.key,
             fmt::format("{} needs it, for example {} = {}", section.needed_for, field.key,
                         field.example));
      }
      continue;
    }
    const bool is_section = std::any_of(
        document.sections.begin(), document.sections.end(),
        [&](const Section& other) { return other.name == name_of(section.name, field.key); });
    if (value->is_table() && is_section) {
      continue;
    }
    const std::vector<Dimension> dimensions = dimensions_of(field, document.signals(into));
    const std::string called = name(section.name, field.key);
    if (const toml::table* texts = value->as_table();
        texts != nullptr && field.type == FieldType::map) {
      field.access.set(object, named_texts(name_of(section.name, field.key), *texts));
      continue;
    }
    if (dimensions.empty() && has("", "model")) {
      refuse(section.name, field.key,
             Error(ProjectError::wrong_value)
                 .about(called)
                 .got("for a mechanism")
                 .hint("[model] has its names in tables: tolerance, limit, noise, resolution"));
      continue;
    }
    if (dimensions.empty()) {
      if (found_.empty()) {
        refuse(section.name, field.key,
               Error(ProjectError::missing_key)
                   .about(called)
                   .got("in a unit that the mechanism decides, which is not known")
                   .hint("say which with --mechanism"));
      }
      continue;
    }
    if (auto read = read_value(field, *value, dimensions, called)) {
      field.access.set(object, *read);
    } else {
      for (const QuotedError& wrong : read.error().all()) {
        refuse(section.name, field.key, wrong, Fault::value);
      }
    }
  }
}

NamedTexts TomlDocument::named_texts(const std::string& section, const toml::table& keys) {
  std::vector<std::pair<const toml::key*, const toml::node*>> sorted;
  for (const auto& [key, value] : keys) {
    sorted.emplace_back(&key, &value);
  }
  std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    const auto& [first, second] = std::pair(a.first->source().begin, b.first->source().begin);
    return std::tie(first.line, first.column) < std::tie(second.line, second.column);
  });
  NamedTexts texts;
  for (const auto& [key, value] : sorted) {
    std::string text;
    if (value->is_string()) {
      text = *value->value_exact<std::string>();
    } else if (value->is_number()) {
      text = fmt::format("{}", *value->value<double>());
    } else {
      refuse(section, key->str(),
             Error(ProjectError::wrong_type)
                 .about(name(section, key->str()))
                 .got("no text")
                 .expected("a text in quotes"),
             Fault::value);
      continue;
    }
    texts.push_back({std::string(key->str()), std::move(text)});
  }
  return texts;
}

void TomlDocument::check_names(const toml::table& names, std::string_view section,
                               std::span<const std::string_view> known) {
  for (const auto& [key, value] : names) {
    const std::string_view text = key.str();
    if (std::find(known.begin(), known.end(), text) != known.end()) {
      continue;
    }
    const std::string nearest = nearest_name(text, known);
    meant_.push_back(name_of(section, nearest));
    found_.push_back(
        {key.source(),
         Error(ProjectError::unknown_key)
             .in(place(key.source()))
             .about(name(section, text))
             .got(section.empty() ? "not a section that is known"
                                  : fmt::format("not a key of [{}]", section))
             .hint(nearest.empty() ? fmt::format("known are {}", fmt::join(known, ", "))
                                   : fmt::format("did you mean \"{}\"?", nearest)),
         true,
         {}});
  }
}

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
    refuse(section, key, std::move(error));
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
    refuse(section, key, std::move(error), Fault::value);
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

Error TomlDocument::missing(std::string_view section, std::string_view key,
                            std::string hint) const {
  return refusal(ProjectError::missing_key, place(source_of(section)), name(section, key))
      .got("missing")
      .hint(std::move(hint));
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
    all.push_back({found->error, !found->excerpt.empty() ? found->excerpt
                                 : found->quote          ? excerpt(found->source)
                                                         : ""});
  }
  return Errors(std::move(all));
}

const toml::table* TomlDocument::table(std::string_view section) const {
  if (section.empty()) {
    return &root_;
  }
  const auto [parent, name] = split(section);
  const toml::node* found = node(parent, name);
  return found == nullptr ? nullptr : found->as_table();
}

const toml::node* TomlDocument::node(std::string_view section, std::string_view key) const {
  const toml::table* keys = table(section);
  return keys == nullptr ? nullptr : keys->get(key);
}

toml::source_region TomlDocument::source_of(std::string_view section) const {
  const toml::table* keys = table(section);
  return keys == nullptr ? root_.source() : keys->source();
}

bool TomlDocument::writes(std::string_view section) const {
  const auto [parent, name] = split(section);
  const toml::node* found = node(parent, name);
  return found != nullptr && found->source().begin.line != 0;
}

std::string TomlDocument::place(const toml::source_region& source) const {
  return source.begin.line == 0
             ? file_
             : fmt::format("{}:{}:{}", file_, source.begin.line, source.begin.column);
}

std::string TomlDocument::name(std::string_view section, std::string_view key) const {
  std::string full = name_of(section, key);
  const auto option = options_.find(full);
  return option == options_.end() ? full : option->second;
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
  const std::vector<std::string> line = characters(line_of(source.begin.line));
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
