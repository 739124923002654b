#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/study/project.hpp>

#include "study/toml_reader.hpp"

namespace flyball::study {

namespace {

std::string place_of(const std::string& file, const toml::source_region& source) {
  return fmt::format("{}:{}:{}", file, source.begin.line, source.begin.column);
}

std::string type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return "a plain number";
    case toml::node_type::boolean:
      return "true or false";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

}  // namespace

TomlReader::TomlReader(const toml::table& table, std::string section, std::string file)
    : table_(table), section_(std::move(section)), file_(std::move(file)) {}

std::string TomlReader::name(std::string_view key) const {
  return section_.empty() ? std::string(key) : fmt::format("{}.{}", section_, key);
}

std::string TomlReader::place(std::string_view key) const {
  for (const auto& [found, node] : table_) {
    if (found.str() == key) {
      return place_of(file_, found.source());
    }
  }
  return place_of(file_, table_.source());
}

void TomlReader::refuse(std::string_view key, Error error) {
  if (!error_) {
    error_ = std::move(error).in(place(key));
  }
}

void TomlReader::adopt(const TomlReader& inner) {
  if (!error_) {
    error_ = inner.error_;
  }
}

Error TomlReader::missing(std::string_view key, std::string hint) const {
  return Error(ProjectError::missing_key)
      .in(place_of(file_, table_.source()))
      .about(name(key))
      .got("missing")
      .hint(std::move(hint));
}

void TomlReader::allow(std::span<const std::string_view> known) {
  for (const auto& [key, node] : table_) {
    const std::string_view text = key.str();
    if (std::find(known.begin(), known.end(), text) != known.end()) {
      continue;
    }
    const std::string nearest = nearest_name(text, known);
    refuse(text, Error(ProjectError::unknown_key)
                     .about(name(text))
                     .got(section_.empty() ? "not a section that is known"
                                           : fmt::format("not a key of [{}]", section_))
                     .hint(nearest.empty() ? fmt::format("known are {}", fmt::join(known, ", "))
                                           : fmt::format("did you mean \"{}\"?", nearest)));
  }
}

std::optional<double> TomlReader::quantity(const toml::node& node, std::string_view key,
                                           Dimension dimension) {
  if (dimension == Dimension::dimensionless && node.is_number()) {
    const double number = *node.value<double>();
    if (std::isfinite(number)) {
      return number;
    }
    refuse(key, Error(ArgumentError::not_finite)
                    .about(name(key))
                    .got(format_number(number))
                    .expected("a finite number"));
    return std::nullopt;
  }
  if (!node.is_string()) {
    const bool number = node.is_number();
    const std::string_view unit = si_unit(dimension);
    refuse(key, (number ? Error(ArgumentError::wrong_unit) : Error(ProjectError::wrong_type))
                    .about(name(key))
                    .got(number ? fmt::format("{}, without a unit", *node.value<double>())
                                : type_name(node))
                    .expected(dimension == Dimension::dimensionless
                                  ? std::string("a plain number")
                                  : fmt::format("a text with number and unit, such as \"{} {}\"",
                                                number ? *node.value<double>() : 1.0, unit)));
    return std::nullopt;
  }
  auto value = parse_quantity(*node.value<std::string_view>(), dimension, name(key));
  if (!value) {
    refuse(key, std::move(value).error());
    return std::nullopt;
  }
  return *value;
}

std::optional<double> TomlReader::quantity(std::string_view key, Dimension dimension) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || error_) {
    return std::nullopt;
  }
  return quantity(*node, key, dimension);
}

std::optional<double> TomlReader::positive(std::string_view key, Dimension dimension) {
  const auto value = quantity(key, dimension);
  if (value && !(*value > 0.0)) {
    refuse(key, Error(ArgumentError::not_positive)
                    .about(name(key))
                    .got(to_text(*value, dimension))
                    .expected("greater than zero"));
    return std::nullopt;
  }
  return value;
}

std::optional<double> TomlReader::not_negative(std::string_view key, Dimension dimension) {
  const auto value = quantity(key, dimension);
  if (value && !(*value >= 0.0)) {
    refuse(key, Error(ArgumentError::out_of_range)
                    .about(name(key))
                    .got(to_text(*value, dimension))
                    .expected("zero or greater"));
    return std::nullopt;
  }
  return value;
}

std::optional<std::string> TomlReader::text(std::string_view key) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || error_) {
    return std::nullopt;
  }
  if (!node->is_string()) {
    refuse(key, Error(ProjectError::wrong_type)
                    .about(name(key))
                    .got(type_name(*node))
                    .expected("a text in quotes"));
    return std::nullopt;
  }
  return *node->value<std::string>();
}

std::optional<long long> TomlReader::integer(std::string_view key, long long least) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || error_) {
    return std::nullopt;
  }
  const auto value = node->is_integer() ? node->value<long long>() : std::nullopt;
  if (!value || *value < least) {
    refuse(key, Error(value ? ProjectError::wrong_value : ProjectError::wrong_type)
                    .about(name(key))
                    .got(value ? std::to_string(*value) : type_name(*node))
                    .expected(fmt::format("a whole number, {} or greater", least)));
    return std::nullopt;
  }
  return value;
}

std::vector<double> TomlReader::quantities(std::string_view key,
                                           std::span<const Dimension> dimensions) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || error_) {
    return {};
  }
  std::vector<double> values;
  if (const toml::array* array = node->as_array()) {
    if (array->size() != dimensions.size()) {
      refuse(key, Error(ArgumentError::wrong_shape)
                      .about(name(key))
                      .got(fmt::format("{} values long", array->size()))
                      .expected(fmt::format("one value a state ({})", dimensions.size())));
      return {};
    }
    for (std::size_t i = 0; i < dimensions.size(); ++i) {
      if (const auto value = quantity((*array)[i], key, dimensions[i])) {
        values.push_back(*value);
      }
    }
  } else if (dimensions.size() == 1) {
    if (const auto value = quantity(*node, key, dimensions[0])) {
      values.push_back(*value);
    }
  } else {
    refuse(key, Error(ProjectError::wrong_type)
                    .about(name(key))
                    .got(type_name(*node))
                    .expected(fmt::format("a list of {} texts, one a state", dimensions.size())));
  }
  return error_ ? std::vector<double>{} : values;
}

const toml::table* TomlReader::table(std::string_view key) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || error_) {
    return nullptr;
  }
  if (!node->is_table()) {
    refuse(key, Error(ProjectError::wrong_type)
                    .about(name(key))
                    .got(type_name(*node))
                    .expected(fmt::format("a section, written [{}]", name(key))));
    return nullptr;
  }
  return node->as_table();
}

}  // namespace flyball::study
