// What the table of fields says to people and to machines.
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <flyball/study/project.hpp>

#include "core/wording.hpp"
#include "study/field.hpp"
#include "study/mechanism_parts.hpp"
#include "study/read_value.hpp"

namespace flyball::study {

namespace {

using OrderedJson = nlohmann::ordered_json;
using NameSpan = std::span<const std::string_view>;

/// 0.02 s is "20 ms".
std::string readable(double value, Dimension dimension) {
  const std::string milli = fmt::format("m{}", si_unit(dimension));
  const auto unit = parse_unit(milli);
  const bool small = value != 0.0 && std::abs(value) < 0.1 && unit &&
                     unit->dimension == dimension && unit->factor == 1e-3;
  return small ? fmt::format("{:.6g} {}", 1e3 * value, milli) : to_text(value, dimension);
}

/// The value of a project that says nothing.
std::string default_of(const Section& section, const Field& field) {
  Project blank;
  const FieldValue value = field.access.get(section.within(&blank, true));
  const auto dimensions = dimensions_of(field, std::nullopt);
  if (const auto* number = std::get_if<double>(&value); number != nullptr && !dimensions.empty()) {
    return field.required ? "" : readable(*number, dimensions.front());
  }
  const auto* whole = std::get_if<long long>(&value);
  return whole == nullptr ? "" : fmt::format("{}", *whole);
}

/// Kinds of mechanism that need a key.
std::vector<std::string_view> needed_by(const Section& section, const Field& field) {
  std::vector<std::string_view> kinds;
  for (const MechanismRow& row : mechanism_rows()) {
    if (section.name == "mechanism" &&
        std::find(row.needs.begin(), row.needs.end(), field.key) != row.needs.end()) {
      kinds.push_back(to_string(row.kind));
    }
  }
  return kinds;
}

std::string if_absent(const Section& section, const Field& field) {
  const auto kinds = needed_by(section, field);
  return !field.absent.empty() ? std::string(field.absent)
         : field.required      ? "it must be there"
         : !kinds.empty()      ? fmt::format("needed by {}", fmt::join(kinds, ", "))
                               : default_of(section, field);
}

std::string metavar(const Field& field) {
  if (!field.metavar.empty()) {
    return std::string(field.metavar);
  }
  if (field.type == FieldType::flag) {
    return {};
  }
  const auto dimensions = dimensions_of(field, std::nullopt);
  if (field.type == FieldType::whole || field.type == FieldType::list) {
    return field.type == FieldType::whole ? "N" : "LIST";
  }
  if (field.type == FieldType::map) {
    return "NAME=VALUE,…";
  }
  if (field.type != FieldType::quantity || dimensions.empty()) {
    return "VALUE";
  }
  std::string name(dimensions.front() == Dimension::dimensionless ? "number"
                                                                  : to_string(dimensions.front()));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  return name;
}

/// The example as a shell takes it.
std::string typed(const Field& field) {
  std::string example(field.example);
  if (field.type == FieldType::map) {  // { u = "2 N m" } is 'u=2 N m'
    std::erase_if(example, [](char c) { return c == '"' || c == '{' || c == '}'; });
    for (const std::string_view gap : {" =", "= ", ", "}) {
      for (std::size_t at = 0; (at = example.find(gap, at)) != std::string::npos;) {
        example.erase(at + gap.find(' '), 1);
      }
    }
    return fmt::format("'{}'", example.substr(1, example.size() - 2));
  }
  std::erase_if(example,
                [](char c) { return std::string_view("[]\" ").find(c) != std::string_view::npos; });
  return example;
}

/// Sections, or single keys of them.
NameSpan sections_of(JobKind job) {
  static constexpr std::array<std::string_view, 9> all{"log",       "mechanism", "controller",
                                                       "estimator", "sensor",    "battery",
                                                       "profile",   "mechanism", "gains"};
  static constexpr std::array<std::string_view, 10> design{
      "mechanism", "gains",   "controller", "estimator", "sensor",
      "battery",   "profile", "point",      "swing_up",  "drive.follower"};
  static constexpr std::array<std::string_view, 8> analyze{
      "mechanism", "gains.kS",          "gains.kV", "gains.kA",
      "gains.kG",  "controller.period", "model",    "point"};
  static constexpr std::array<std::string_view, 11> simulate{
      "simulation", "point",     "model",   "mechanism", "gains",   "controller",
      "sensor",     "estimator", "battery", "profile",   "swing_up"};
  static constexpr std::array<std::string_view, 5> experiment{"experiment", "log", "mechanism",
                                                              "gains", "sensor"};
  static constexpr std::array<std::string_view, 3> identify{"log", "fit", "model.parameters"};
  static constexpr std::array<std::string_view, 6> estimate{
      "estimate", "fit.period", "fit.from", "fit.to", "fit.hold", "model.parameters"};
  static constexpr std::array<std::string_view, 5> size{"size", "mechanism", "gains.kS",
                                                        "controller.max_voltage", "battery"};
  static constexpr std::array<std::string_view, 5> drive{
      "drive", "disturbance", "controller.period", "controller.max_voltage", "battery"};
  static constexpr std::array<std::string_view, 3> optimize{"optimize", "drive",
                                                            "controller.max_voltage"};
  switch (job) {
    case JobKind::optimize:
      return optimize;
    case JobKind::drive:
      return drive;
    case JobKind::size:
      return size;
    case JobKind::estimate:
      return estimate;
    case JobKind::experiment:
      return experiment;
    case JobKind::identify:
      return identify;
    case JobKind::design:
      return design;
    case JobKind::tune:
      return NameSpan(all).first(7);
    case JobKind::analyze:
      return analyze;
    case JobKind::simulate:
      return simulate;
  }
  return {};
}

OrderedJson schema_of(const Field& field, const std::string& description) {
  OrderedJson schema = {{"description", description}};
  const bool plain = field.dimension.of == FieldDimension::fixed &&
                     field.dimension.dimension == Dimension::dimensionless;
  OrderedJson quantity = {{"type", "string"},
                          {"pattern", field.range < Range::not_negative ? "^\\s*[-+]?\\.?[0-9]"
                                                                        : "^\\s*\\+?\\.?[0-9]"}};
  switch (field.type) {
    case FieldType::quantity:
      if (plain) {
        schema["type"] = {"number", "string"};
        schema["pattern"] = "^[^:]*[0-9]\\s*:\\s*[0-9.]+([eE][-+]?[0-9]+)?\\s*$";  // a ratio
        if (field.range == Range::not_zero) {
          schema["not"] = {{"const", 0}};
        } else if (field.range != Range::any) {
          schema[field.range == Range::positive ? "exclusiveMinimum" : "minimum"] = 0;
        }
      } else {
        schema.update(quantity);
      }
      break;
    case FieldType::list:
      schema["anyOf"] = {quantity, {{"type", "array"}, {"items", quantity}, {"minItems", 1}}};
      break;
    case FieldType::text:
      schema["type"] = "string";
      schema["minLength"] = 1;
      break;
    case FieldType::whole:
      schema["type"] = "integer";
      schema["minimum"] = field.least;
      schema["maximum"] = field.most;
      break;
    case FieldType::flag:
      schema["type"] = "boolean";
      break;
    case FieldType::names:
      schema["type"] = "array";
      schema["items"] = {{"type", "string"}, {"minLength", 1}};
      break;
    case FieldType::map:
      schema["type"] = "object";
      schema["additionalProperties"] = {{"type", {"string", "number"}}};
      break;
  }
  for (const std::string_view choice : text::split(field.choices, ", ")) {
    schema["enum"].push_back(choice);
  }
  return schema;
}

OrderedJson schema_of(const Section& section) {
  OrderedJson properties = OrderedJson::object();
  OrderedJson required = OrderedJson::array();
  for (const Field& field : section.fields) {
    const std::string absent = if_absent(section, field);
    properties[field.key] = schema_of(field, absent.empty() || field.required
                                                 ? std::string(field.help)
                                                 : fmt::format("{} [{}]", field.help, absent));
    if (field.required) {
      required.push_back(field.key);
    }
  }
  return {{"type", "object"},
          {"description", section.summary},
          {"additionalProperties", false},
          {"required", std::move(required)},
          {"properties", std::move(properties)}};
}

}  // namespace

std::vector<FieldInfo> fields_of(JobKind job) {
  std::vector<FieldInfo> all;
  for (const std::string_view part : sections_of(job)) {
    const std::string_view name = part.substr(0, part.find('.'));
    for (const Field& field : section_of(name).fields) {
      std::string option = option_of(field);
      if (!option.empty() && (part == name || part == name_of(name, field.key))) {
        all.push_back({.section = std::string(name),
                       .key = std::string(field.key),
                       .option = std::move(option),
                       .value = metavar(field),
                       .help = std::string(field.help),
                       .example = typed(field),
                       .absent = if_absent(section_of(name), field)});
      }
    }
  }
  return all;
}

std::string project_markdown() {
  std::string text;
  for (const Section& section : project_document().sections) {
    text += fmt::format(
        "## `[{}]`\n\n{}\n\n| key | for example | meaning | if absent |\n"
        "|---|---|---|---|\n",
        section.name, section.summary);
    for (const Field& field : section.fields) {
      const std::string choices = field.choices.empty() ? "" : fmt::format(" ({})", field.choices);
      text += fmt::format("| `{}` | `{}` | {}{} | {} |\n", field.key, field.example, field.help,
                          choices, if_absent(section, field));
    }
    text += '\n';
  }
  text.pop_back();
  return text;
}

std::string project_schema() {
  OrderedJson properties = OrderedJson::object();
  for (const Section& section : project_document().sections) {
    const std::size_t dot = section.name.find('.');
    if (dot == std::string_view::npos) {
      properties[section.name] = schema_of(section);
    } else {  // a key of another section may be a section
      OrderedJson& key =
          properties[section.name.substr(0, dot)]["properties"][section.name.substr(dot + 1)];
      key = {{"anyOf", {key, schema_of(section)}}};
    }
  }
  const OrderedJson schema = {
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "A Flyball project file"},
      {"type", "object"},
      {"additionalProperties", false},
      {"anyOf",
       {{{"required", {"mechanism"}}}, {{"required", {"model"}}}, {{"required", {"drive"}}}}},
      {"properties", std::move(properties)}};
  return schema.dump(2) + "\n";
}

}  // namespace flyball::study
