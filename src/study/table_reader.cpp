#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/study/project.hpp>

#include "study/table_reader.hpp"

namespace flyball::study {

TableReader::TableReader(std::string path, std::string_view text)
    : path_(std::move(path)), text_(text) {
  try {
    root_ = toml::parse(text);
  } catch (const toml::parse_error& problem) {
    refuse(problem.source(), Error(ProjectError::syntax).hint(std::string(problem.description())));
  }
}

void TableReader::refuse(const toml::source_region& source, Error error) {
  constexpr std::size_t most = 20;
  if (errors_.size() >= most) {
    return;
  }
  QuotedError quoted{
      std::move(error).in(source.begin.line == 0 ? path_
                                                 : fmt::format("{}:{}:{}", path_, source.begin.line,
                                                               source.begin.column)),
      {},
      {}};
  if (source.begin.line != 0) {
    quoted.place = Place{source.begin.line, source.begin.column};
    std::size_t from = 0;
    for (toml::source_index i = 1; i < source.begin.line && from != std::string_view::npos; ++i) {
      from = text_.find('\n', from);
      from = from == std::string_view::npos ? from : from + 1;
    }
    if (from != std::string_view::npos) {
      std::string line(text_.substr(from, text_.find('\n', from) - from));
      for (char& c : line) {
        c = static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
      }
      constexpr std::size_t widest = 200;
      if (line.size() <= widest) {
        quoted.excerpt = "  " + line + "\n  " + std::string(source.begin.column - 1, ' ') + "^";
      }
    }
  }
  errors_.push_back(std::move(quoted));
}

void TableReader::wrong_type(const toml::node& node, const std::string& name, std::string what) {
  refuse(node.source(),
         Error(ProjectError::wrong_type).about(name).got("another type").expected(std::move(what)));
}

void TableReader::known(const toml::table& table, const std::string& what, const NameList& names) {
  for (const auto& [key, value] : table) {
    if (std::find(names.begin(), names.end(), key.str()) == names.end()) {
      const std::string nearest = nearest_name(key.str(), names);
      refuse(key.source(),
             Error(ProjectError::unknown_key)
                 .about(std::string(key.str()))
                 .got("not a key of " + what)
                 .hint(nearest.empty() ? fmt::format("it has {}", fmt::join(names, ", "))
                                       : fmt::format("did you mean \"{}\"?", nearest)));
    }
  }
}

std::string TableReader::text(const toml::table& table, std::string_view key,
                              std::string otherwise) {
  const toml::node* node = table.get(key);
  if (node == nullptr) {
    return otherwise;
  }
  if (!node->is_string()) {
    wrong_type(*node, std::string(key), "a text in quotes");
    return otherwise;
  }
  return *node->value_exact<std::string>();
}

bool TableReader::flag(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  if (node != nullptr && !node->is_boolean()) {
    wrong_type(*node, std::string(key), "true or false");
  }
  return node != nullptr && node->value_or(false);
}

double TableReader::quantity(const toml::node& node, Dimension dimension, const std::string& name) {
  if (node.is_number() && dimension == Dimension::dimensionless) {
    return node.value<double>().value_or(0.0);
  }
  if (node.is_number() && node.value<double>().value_or(1.0) == 0.0) {
    return 0.0;
  }
  if (!node.is_string()) {
    wrong_type(node, name,
               fmt::format("a text with a unit, such as \"{}\"", to_text(1.0, dimension)));
    return 0.0;
  }
  const auto value = parse_quantity(*node.value_exact<std::string>(), dimension, name);
  if (!value) {
    refuse(node.source(), value.error());
    return 0.0;
  }
  return *value;
}

std::optional<double> TableReader::optional_quantity(const toml::table& table, std::string_view key,
                                                     Dimension dimension) {
  const toml::node* node = table.get(key);
  return node == nullptr ? std::nullopt
                         : std::optional(quantity(*node, dimension, std::string(key)));
}

double TableReader::needed(const toml::table& table, std::string_view key, Dimension dimension,
                           const std::string& of) {
  if (const auto value = optional_quantity(table, key, dimension)) {
    return *value;
  }
  refuse(table.source(),
         Error(ProjectError::missing_key).about(std::string(key)).got("missing").hint("of " + of));
  return 0.0;
}

std::array<double, 2> TableReader::point(const toml::node* node, const std::string& name,
                                         Dimension first, Dimension second) {
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (list == nullptr || list->size() != 2) {
    if (node != nullptr) {
      wrong_type(*node, name, "two quantities, such as [\"1 m\", \"0.5 m\"]");
    }
    return {};
  }
  return {quantity((*list)[0], first, name), quantity((*list)[1], second, name)};
}

std::array<double, 2> TableReader::needed_point(const toml::table& table, std::string_view key,
                                                const std::string& of) {
  if (table.get(key) == nullptr) {
    refuse(
        table.source(),
        Error(ProjectError::missing_key).about(std::string(key)).got("missing").hint("of " + of));
  }
  return point(table.get(key), std::string(key));
}

std::vector<std::array<double, 2>> TableReader::points(const toml::table& table,
                                                       std::string_view key, Dimension first,
                                                       Dimension second) {
  std::vector<std::array<double, 2>> all;
  const toml::node* node = table.get(key);
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (list == nullptr) {
    refuse(node == nullptr ? table.source() : node->source(),
           Error(node == nullptr ? ProjectError::missing_key : ProjectError::wrong_type)
               .about(std::string(key))
               .got(node == nullptr ? "missing" : "another type")
               .expected("a list of points"));
    return all;
  }
  for (const toml::node& entry : *list) {
    all.push_back(point(&entry, std::string(key), first, second));
  }
  return all;
}

std::vector<std::string> TableReader::texts(const toml::node* node, const std::string& name) {
  std::vector<std::string> all;
  if (node == nullptr) {
    return all;
  }
  const toml::array* list = node->as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    if ((*list)[i].is_string()) {
      all.push_back((*list)[i].value_or(std::string()));
    }
  }
  if (list == nullptr || all.size() != list->size()) {
    wrong_type(*node, name, "a list of names");
  }
  return all;
}

}  // namespace flyball::study
