#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/solve/documentation.hpp>

#include "core/wording.hpp"
#include "solve/shape.hpp"

namespace flyball::solve {

namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson reference(std::string_view name) {
  return {{"$ref", fmt::format("#/$defs/{}", name)}};
}

OrderedJson list_of(OrderedJson items) {
  return {{"type", "array"}, {"items", std::move(items)}};
}

OrderedJson object_of(const std::vector<Field>& fields, bool problem);

OrderedJson any_of(OrderedJson one, OrderedJson other) {
  return {{"anyOf", OrderedJson::array({std::move(one), std::move(other)})}};
}

/// @param problem  Whether short forms that problems may use are allowed.
OrderedJson type_of(const Field& field, bool problem) {
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
      OrderedJson properties = OrderedJson::object();
      for (const std::string_view name : text::split(field.choices, " ")) {
        properties[std::string(name)] = reference("number");
      }
      OrderedJson record = {{"type", "object"},
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

std::string schema_description(const Field& field) {
  const std::string shape = shape_of(field);
  return fmt::format("{}{}{}", field.help, shape.empty() ? "" : fmt::format(" ({})", shape),
                     field.unit.empty() ? "" : fmt::format(" [{}]", field.unit));
}

OrderedJson object_of(const std::vector<Field>& fields, bool problem) {
  OrderedJson properties = OrderedJson::object();
  OrderedJson required = OrderedJson::array();
  for (const Field& field : fields) {
    OrderedJson property = type_of(field, problem);
    property["description"] = schema_description(field);
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
  const OrderedJson matrix = any_of(reference("matrix"), reference("number"));
  const auto object_with = [&](OrderedJson properties, OrderedJson required) {
    return OrderedJson{{"type", "object"},
                       {"properties", std::move(properties)},
                       {"required", std::move(required)},
                       {"additionalProperties", false}};
  };
  // With states, or a static gain.
  OrderedJson system =
      any_of(object_with({{"A", matrix}, {"B", matrix}, {"C", matrix}, {"D", matrix}},
                         OrderedJson::array({"A", "B"})),
             object_with({{"D", matrix}}, OrderedJson::array({"D"})));
  const OrderedJson coefficients = list_of(reference("number"));
  const OrderedJson number = reference("number");
  OrderedJson transfer = {
      {"anyOf",
       OrderedJson::array(
           {object_with(
                {{"num", coefficients}, {"den", coefficients}, {"dt", number}, {"delay", number}},
                OrderedJson::array({"num", "den"})),
            object_with({{"expr", {{"type", "string"}}}, {"dt", number}, {"delay", number}},
                        OrderedJson::array({"expr"})),
            {{"type", "string"}}})}};
  OrderedJson definitions = {
      {"number",
       any_of({{"type", "number"}}, {{"enum", OrderedJson::array({"inf", "-inf", nullptr})}})},
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
            {"required", OrderedJson::array({"code", "message"})}}}}},
        {"required", OrderedJson::array({"error"})},
        {"additionalProperties", false}}}};
  for (const Kind& kind : kinds()) {
    const auto with_id = [](OrderedJson object) {
      OrderedJson properties = {{"id", true}};
      properties.update(object["properties"]);
      object["properties"] = std::move(properties);
      return object;
    };
    OrderedJson problem = with_id(object_of(kind.fields, true));
    problem["description"] = kind.help;
    problem["examples"] = OrderedJson::array({OrderedJson::parse(kind.example)});
    definitions[fmt::format("{}.problem", kind.name)] = std::move(problem);
    definitions[fmt::format("{}.answer", kind.name)] = with_id(object_of(kind.answer, false));
  }
  const OrderedJson schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                              {"title", "Problems and answers of flyball solve"},
                              {"$defs", std::move(definitions)}};
  return schema.dump(1) + '\n';
}

}  // namespace flyball::solve
