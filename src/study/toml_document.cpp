#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "study/read_value.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

struct Split {
  std::string_view parent;  // empty for a section of the root
  std::string_view name;
};

Split split(std::string_view section) {
  const std::size_t dot = section.rfind('.');
  return dot == std::string_view::npos ? Split{"", section}
                                       : Split{section.substr(0, dot), section.substr(dot + 1)};
}

}  // namespace

TomlDocument::TomlDocument(std::string_view text, std::string file)
    : text_(text), file_(std::move(file)) {
  try {
    // Without the name of the file: toml++ copies it in a constructor that is noexcept.
    root_ = toml::parse(text);
  } catch (const toml::parse_error& problem) {
    is_toml_ = false;
    std::string hint(problem.description());
    if (const std::size_t saw = hint.find("saw '");
        saw != std::string::npos && static_cast<unsigned char>(hint[saw + 5]) >= 0x80) {
      hint += "; a name with such a letter stands in quotes";
    } else if (hint.find("could not determine value type") != std::string::npos) {
      hint += "; texts, quantities and formulas stand in quotes";
    }
    found_.push_back({problem.source(),
                      Error(ProjectError::syntax).in(place(problem.source())).hint(std::move(hint)),
                      true,
                      {}});
  }
}

std::vector<TomlDocument> TomlDocument::take_tables(std::string_view name) {
  std::vector<TomlDocument> taken;
  toml::node* const found = root_.get(name);
  if (found == nullptr) {
    return taken;
  }
  toml::array* const list = found->as_array();
  const auto refuse_node = [&](const toml::node& node) {
    found_.push_back(
        {node.source(), Error(ProjectError::wrong_type)
                            .in(place(node.source()))
                            .about(std::string(name))
                            .got("no list of tables")
                            .expected(fmt::format("tables, each written [[{}]]", name))});
  };
  if (list == nullptr) {
    refuse_node(*found);
  }
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    if (toml::table* const keys = (*list)[i].as_table()) {
      toml::table root;
      root.insert(name, std::move(*keys));  // a copy would lose its places
      taken.push_back(TomlDocument(text_, file_, std::move(root)));
    } else {
      refuse_node((*list)[i]);
    }
  }
  root_.erase(name);
  return taken;
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
        options_[name_of(section.name, field.key)] = option;
        if (field.type == FieldType::map && text.find('=') == std::string::npos) {
          found_.push_back({{},
                            Error(ProjectError::wrong_value)
                                .about(option)
                                .got(fmt::format("\"{}\"", text))
                                .expected("NAME=VALUE,…"),
                            true,
                            {}});
          continue;
        }
        // No section of a section has options.
        const auto [place, inserted] = root_.insert(section.name, toml::table{});
        if (toml::table* keys = place->second.as_table()) {
          insert_text(*keys, field, text);
        }
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
    if (writes(section.name) && refuse_other(section, nullptr)) {
      continue;
    }
    if (const toml::table* keys = table(section.name)) {
      read_section(section, *keys, document, into);
    } else if (const toml::node* other = node(parent, key); other != nullptr && parent.empty()) {
      // Where a section of a section may be a key as well, the key's row reads it.
      refuse(parent, key,
             Error(ProjectError::wrong_type)
                 .about(std::string(key))
                 .got("no section")
                 .expected(fmt::format("a section, written [{}]", section.name)));
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
    if (refuse_other(section, &field)) {
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
        refuse(section.name, field.key, wrong);
      }
    }
  }
}

bool TomlDocument::refuse_other(const Section& section, const Field* field) {
  const Subject of =
      field != nullptr && field->subject != Subject::any ? field->subject : section.subject;
  if (!is_about_other(of, subject())) {
    return false;
  }
  const auto [parent, name] = split(section.name);
  const std::string_view key = field != nullptr ? field->key : name;
  const std::string_view within = field != nullptr ? section.name : parent;
  if (field != nullptr || parent.empty()) {
    refuse(within, key,
           Error(ProjectError::wrong_value)
               .about(this->name(within, key))
               .got(of == Subject::model   ? "for a model by formula"
                    : of == Subject::drive ? "for a drivetrain"
                    : of == Subject::loops ? "for a mechanism or a model by formula"
                                           : "for a mechanism")
               .hint(of == Subject::drive || subject() == Subject::drive
                         ? "a file has one of [drive], [mechanism] and [model]"
                     : of == Subject::model
                         ? "the file has no [model]; a mechanism has state_tolerance, max_voltage, "
                           "[sensor] and [profile]"
                     : section.subject == Subject::any
                         ? "[model] has its names in tables: tolerance, limit, reference, initial"
                         : "a file has [model] or [mechanism], not both"),
           Fault::key);
  }
  return true;
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
                 .expected("a text in quotes"));
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

bool TomlDocument::writes(std::string_view section) const {
  const auto [parent, name] = split(section);
  const toml::node* found = node(parent, name);
  return found != nullptr && found->source().begin.line != 0;
}

bool TomlDocument::is_new(std::string_view section, std::string_view key) const {
  const toml::table* keys = table(section);
  return keys != nullptr && keys->contains(key) && keys->find(key)->first.source().begin.line == 0;
}

std::string TomlDocument::name(std::string_view section, std::string_view key) const {
  std::string full = name_of(section, key);
  const auto option = options_.find(full);
  return option == options_.end() ? full : option->second;
}

}  // namespace flyball::study
