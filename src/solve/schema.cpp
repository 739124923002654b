#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/solve/documentation.hpp>

#include "core/wording.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

namespace {

using Json = nlohmann::ordered_json;

Json reference(std::string_view name) {
  return {{"$ref", fmt::format("#/$defs/{}", name)}};
}

Json list_of(Json items) {
  return {{"type", "array"}, {"items", std::move(items)}};
}

Json object_of(const std::vector<Field>& fields, bool problem);

Json any_of(Json one, Json other) {
  return {{"anyOf", Json::array({std::move(one), std::move(other)})}};
}

/// @param problem  Whether short forms that problems may use are allowed.
Json type_of(const Field& field, bool problem) {
  switch (field.type) {
    case FieldType::number:
      return reference("number");
    case FieldType::integer:
      return {{"type", "integer"}};
    case FieldType::flag:
      return {{"type", "boolean"}};
    case FieldType::text:
      return {{"type", "string"}};
    case FieldType::texts:
      return list_of({{"type", "string"}});
    case FieldType::choice:
      return {{"enum", text::split(field.choices, " ")}};
    case FieldType::matrix:
      return problem ? any_of(reference("matrix"), reference("number")) : reference("matrix");
    case FieldType::samples:
      return any_of(reference("matrix"), list_of(reference("number")));
    case FieldType::list:
      return list_of(reference("number"));
    case FieldType::complex_list:
      return list_of(problem ? any_of(reference("complex"), reference("number"))
                             : reference("complex"));
    case FieldType::matrices:
      return list_of(reference("matrix"));
    case FieldType::record:
    case FieldType::records: {
      Json properties = Json::object();
      for (const std::string_view name : text::split(field.choices, " ")) {
        properties[std::string(name)] = reference("number");
      }
      Json record = {{"type", "object"},
                     {"properties", std::move(properties)},
                     {"required", text::split(field.choices, " ")},
                     {"additionalProperties", false}};
      return field.type == FieldType::record ? record : list_of(std::move(record));
    }
    case FieldType::system:
      return reference("system");
    case FieldType::transfer:
      return reference("transfer");
    case FieldType::transfers:
      return list_of(list_of(reference("transfer")));
    case FieldType::objects:
      return list_of(object_of(*field.inner, problem));
  }
  return {};
}

std::string description_of(const Field& field) {
  const std::string shape = shape_of(field);
  return fmt::format("{}{}{}", field.help, shape.empty() ? "" : fmt::format(" ({})", shape),
                     field.unit.empty() ? "" : fmt::format(" [{}]", field.unit));
}

Json object_of(const std::vector<Field>& fields, bool problem) {
  Json properties = Json::object();
  Json required = Json::array();
  for (const Field& field : fields) {
    Json property = type_of(field, problem);
    property["description"] = description_of(field);
    if (problem && field.absent == Absent::number) {
      property["default"] = field.otherwise;
    } else if (problem && field.absent == Absent::first_choice) {
      property["default"] = text::split(field.choices, " ").front();
    }
    properties[std::string(field.name)] = std::move(property);
    if (field.absent == Absent::refused) {
      required.emplace_back(field.name);
    }
  }
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

}  // namespace

std::string json_schema() {
  const Json matrix = any_of(reference("matrix"), reference("number"));
  const auto object_with = [&](Json properties, Json required) {
    return Json{{"type", "object"},
                {"properties", std::move(properties)},
                {"required", std::move(required)},
                {"additionalProperties", false}};
  };
  // With states, or a static gain.
  Json system = any_of(object_with({{"A", matrix}, {"B", matrix}, {"C", matrix}, {"D", matrix}},
                                   Json::array({"A", "B"})),
                       object_with({{"D", matrix}}, Json::array({"D"})));
  const Json coefficients = list_of(reference("number"));
  const Json number = reference("number");
  Json transfer = {
      {"anyOf",
       Json::array(
           {object_with(
                {{"num", coefficients}, {"den", coefficients}, {"dt", number}, {"delay", number}},
                Json::array({"num", "den"})),
            object_with({{"expr", {{"type", "string"}}}, {"dt", number}, {"delay", number}},
                        Json::array({"expr"})),
            {{"type", "string"}}})}};
  Json definitions = {
      {"number", any_of({{"type", "number"}}, {{"enum", Json::array({"inf", "-inf", nullptr})}})},
      {"complex",
       {{"type", "array"}, {"items", reference("number")}, {"minItems", 2}, {"maxItems", 2}}},
      {"matrix", list_of(list_of(reference("number")))},
      {"system", std::move(system)},
      {"transfer", std::move(transfer)},
      {"refusal",
       {{"type", "object"},
        {"properties",
         {{"id", true},
          {"error",
           {{"type", "object"},
            {"properties", {{"code", {{"type", "string"}}}, {"message", {{"type", "string"}}}}},
            {"required", Json::array({"code", "message"})}}}}},
        {"required", Json::array({"error"})},
        {"additionalProperties", false}}}};
  for (const Kind& kind : kinds()) {
    const auto with_id = [](Json object) {
      Json properties = {{"id", true}};
      properties.update(object["properties"]);
      object["properties"] = std::move(properties);
      return object;
    };
    Json problem = with_id(object_of(kind.fields, true));
    problem["description"] = kind.help;
    problem["examples"] = Json::array({Json::parse(kind.example)});
    definitions[fmt::format("{}.problem", kind.name)] = std::move(problem);
    definitions[fmt::format("{}.answer", kind.name)] = with_id(object_of(kind.answer, false));
  }
  const Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                       {"title", "Problems and answers of flyball solve"},
                       {"$defs", std::move(definitions)}};
  return schema.dump(1) + '\n';
}

}  // namespace flyball::solve
