#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/read_value.hpp"

namespace flyball::study {

namespace {

/// What a node is, for a sentence: "… is a list".
std::string description(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return fmt::format("\"{}\"", *node.value<std::string_view>());
    case toml::node_type::integer:
    case toml::node_type::floating_point:
      return fmt::format("{}", *node.value<double>());
    case toml::node_type::boolean:
      return *node.value<bool>() ? "true" : "false";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

tl::unexpected<Error> wrong_type(const toml::node& node, const std::string& name,
                                 std::string expected) {
  return refusal(ProjectError::wrong_type, {}, name)
      .got(description(node))
      .expected(std::move(expected));
}

Expected<double> in_range(double value, Range range, Dimension dimension, const std::string& name) {
  if (!std::isfinite(value)) {
    return refusal(ArgumentError::not_finite, {}, name)
        .got(format_number(value))
        .expected("a finite number");
  }
  FLYBALL_CHECK(check_size(value, name));
  const bool zero = range == Range::not_negative;
  if (range == Range::any || value > 0.0 || (value == 0.0 && zero) ||
      (value < 0.0 && range == Range::not_zero)) {
    return value;
  }
  return tl::unexpected(Error(zero ? ArgumentError::out_of_range : ArgumentError::not_positive)
                            .about(name)
                            .got(to_text(value, dimension))
                            .expected(zero                       ? "zero or greater"
                                      : range == Range::not_zero ? "other than zero"
                                                                 : "greater than zero"));
}

Expected<double> quantity(const toml::node& node, Range range, Dimension dimension,
                          const std::string& name) {
  const auto number = node.value_exact<double>();
  const auto whole = node.value_exact<long long>();
  const std::string ratio = node.is_string() ? *node.value<std::string>() : std::string();
  if (node.is_string() &&
      (dimension != Dimension::dimensionless || ratio.find(':') != std::string::npos)) {
    FLYBALL_TRY(const double value,
                parse_quantity(*node.value<std::string_view>(), dimension, name));
    return in_range(value, range, dimension, name);
  }
  if (dimension == Dimension::dimensionless) {
    return number || whole
               ? in_range(*node.value<double>(), range, dimension, name)
               : wrong_type(node, name,
                            "a plain number, without quotes, or a ratio such as \"3:2\"");
  }
  const std::string unit(si_unit(dimension));
  if (number || whole) {
    const bool finite = std::isfinite(*node.value<double>());
    return refusal(ArgumentError::wrong_unit, {}, name)
        .got(description(node) + ", without a unit")
        .expected(fmt::format("a text with number and unit, such as \"{} {}\"",
                              finite ? description(node) : "1", unit));
  }
  return wrong_type(node, name, fmt::format("a text with number and unit, such as \"1 {}\"", unit));
}

ExpectedAll<FieldValue> list(const toml::node& node, Range range,
                             std::span<const Dimension> dimensions, const std::string& name) {
  const toml::array* array = node.as_array();
  if (array == nullptr && dimensions.size() != 1) {
    return wrong_type(node, name,
                      fmt::format("a list of {} texts, one a state", dimensions.size()));
  }
  std::vector<QuotedError> wrong;
  const std::size_t size = array != nullptr ? array->size() : 1;
  if (size != dimensions.size()) {
    wrong.push_back({Error(ArgumentError::wrong_shape)
                         .about(name)
                         .got(fmt::format("{} value{} long", size, size == 1 ? "" : "s"))
                         .expected(fmt::format("one value a state ({})", dimensions.size())),
                     {}});
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < std::min(size, dimensions.size()); ++i) {
    auto value = quantity(array != nullptr ? (*array)[i] : node, range, dimensions[i], name);
    if (value) {
      values.push_back(*value);
    } else {
      wrong.push_back({std::move(value).error(), {}});
    }
  }
  if (!wrong.empty()) {
    return tl::unexpected(Errors(std::move(wrong)));
  }
  return values;
}

/// What is a number and nothing else.
template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  return status == std::errc{} && end == text.data() + text.size() ? std::optional(value)
                                                                   : std::nullopt;
}

}  // namespace

ExpectedAll<FieldValue> read_value(const Field& field, const toml::node& node,
                                   std::span<const Dimension> dimensions, const std::string& name) {
  switch (field.type) {
    case FieldType::quantity:
      return quantity(node, field.range, dimensions.front(), name);
    case FieldType::list:
      return list(node, field.range, dimensions, name);
    case FieldType::text: {
      const auto text = node.value_exact<std::string>();
      if (!text) {
        return wrong_type(node, name, "a text in quotes");
      }
      if (text->empty()) {
        return refusal(ArgumentError::empty, {}, name).got("empty");
      }
      if (field.check != nullptr) {
        FLYBALL_CHECK(field.check(*text));
      }
      return *text;
    }
    case FieldType::whole: {
      const auto value = node.value_exact<long long>();
      if (value && *value >= field.least && *value <= field.most) {
        return *value;
      }
      return tl::unexpected(
          Error(value ? ProjectError::wrong_value : ProjectError::wrong_type)
              .about(name)
              .got(description(node))
              .expected(field.most < largest_whole
                            ? fmt::format("a whole number from {} to {}", field.least, field.most)
                            : fmt::format("a whole number, {} or greater", field.least)));
    }
    case FieldType::flag: {
      const auto value = node.value_exact<bool>();
      return value ? ExpectedAll<FieldValue>(*value) : wrong_type(node, name, "true or false");
    }
    case FieldType::names: {
      std::vector<std::string> texts;
      const toml::array* array = node.as_array();
      for (const toml::node& element : array != nullptr ? *array : toml::array{}) {
        texts.push_back(element.value_exact<std::string>().value_or(""));
      }
      const bool all = std::find(texts.begin(), texts.end(), "") == texts.end();
      return array != nullptr && all ? ExpectedAll<FieldValue>(std::move(texts))
                                     : wrong_type(node, name, "a list of texts in quotes");
    }
    case FieldType::map:
      return wrong_type(node, name, fmt::format("a table such as {}", field.example));
  }
  return FieldValue{};
}

/// Whether a field is a number without a unit.
bool is_plain(const Field& field) {
  return field.type == FieldType::quantity && field.dimension.of == FieldDimension::fixed &&
         field.dimension.dimension == Dimension::dimensionless;
}

void insert_text(toml::table& table, const Field& field, std::string_view text) {
  if (field.type == FieldType::map) {
    // NAME=VALUE,… stands beside the file's own; a comma in parentheses is a formula's.
    toml::table* values = table[field.key].as_table();
    if (values == nullptr) {
      values = table.insert_or_assign(field.key, toml::table{}).first->second.as_table();
    }
    for (std::size_t start = 0; start < text.size();) {
      std::size_t end = start;
      for (int depth = 0; end < text.size() && (depth > 0 || text[end] != ','); ++end) {
        depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
      }
      start = std::min(text.find_first_not_of(' ', start), end);
      const std::string_view part = text.substr(start, end - start);
      const std::size_t equals = std::min(part.find('='), part.size());
      values->insert_or_assign(part.substr(0, equals),
                               std::string(part.substr(std::min(equals + 1, part.size()))));
      start = end + 1;
    }
  } else if (field.type == FieldType::list || field.type == FieldType::names) {
    toml::array values;
    for (std::size_t start = 0; start <= text.size();) {
      const std::size_t end = std::min(text.find(',', start), text.size());
      values.push_back(std::string(text.substr(start, end - start)));
      start = end + 1;
    }
    table.insert_or_assign(field.key, std::move(values));
  } else if (const auto whole = number_in<long long>(text);
             field.type == FieldType::whole && whole) {
    table.insert_or_assign(field.key, *whole);
  } else if (const auto number = number_in<double>(text); is_plain(field) && number) {
    table.insert_or_assign(field.key, *number);
  } else if (field.type == FieldType::flag && (text == "true" || text == "false")) {
    table.insert_or_assign(field.key, text == "true");
  } else {
    table.insert_or_assign(field.key, std::string(text));
  }
}

Expected<void> check_size(double value, const std::string& called) {
  constexpr double least = 1e-100;
  constexpr double most = 1e100;
  const double size = std::abs(value);
  if (size == 0.0 || (size >= least && size <= most)) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, {}, called)
      .got(format_number(value))
      .expected("of a size from 1e-100 to 1e100 in SI units, or zero");
}

Expected<void> check_ranges(const Project& project, std::string_view where) {
  const Document& document = project_document();
  const auto signals = document.signals(&project);
  for (const Section& section : document.sections) {
    const void* object = find(section, &project);
    for (const Field& field : object == nullptr ? std::span<const Field>() : section.fields) {
      const FieldValue value = field.access.get(object);
      const std::vector<Dimension> dimensions = dimensions_of(field, signals);
      std::vector<double> numbers;
      if (const auto* list = std::get_if<std::vector<double>>(&value)) {
        numbers = *list;
      } else if (const auto* number = std::get_if<double>(&value)) {
        numbers = {*number};
      }
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        const Dimension dimension =
            i < dimensions.size() ? dimensions[i] : Dimension::dimensionless;
        if (auto ok =
                in_range(numbers[i], field.range, dimension, name_of(section.name, field.key));
            !ok) {
          return tl::unexpected(std::move(ok).error().in(std::string(where)));
        }
      }
    }
  }
  return {};
}

std::vector<Dimension> dimensions_of(const Field& field,
                                     const std::optional<SignalDimensions>& signals) {
  using Of = FieldDimension;
  if (field.dimension.of == Of::fixed) {
    return {field.dimension.dimension};
  }
  if (!signals) {
    return {};
  }
  switch (field.dimension.of) {
    case Of::states:
      return {signals->states.begin(), signals->states.end()};
    case Of::output:
      return {signals->output};
    case Of::rate:
      return {signals->rate};
    case Of::effort:
      return {signals->effort};
    default:
      return {signals->acceleration};
  }
}

}  // namespace flyball::study
