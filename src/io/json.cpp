#include <cmath>
#include <utility>

#include "io/json.hpp"

namespace flyball {

using Json = nlohmann::ordered_json;

Json json_of(double value) {
  if (std::isnan(value)) {
    return nullptr;
  }
  if (std::isinf(value)) {
    return value > 0.0 ? "inf" : "-inf";
  }
  return value;
}

Json json_of(const Error& error) {
  Json json = {{"code", std::string(error.code())}, {"message", to_string(error)}};
  for (const Evidence& evidence : error.evidence()) {
    if (json.contains(evidence.name)) {
      continue;
    }
    if (evidence.values.size() == 1) {
      json[evidence.name] = json_of(evidence.values.front());
    } else if (evidence.values.empty()) {
      json[evidence.name] = evidence.text;
    } else {
      Json list = Json::array();
      for (const double value : evidence.values) {
        list.push_back(json_of(value));
      }
      json[evidence.name] = std::move(list);
    }
  }
  return json;
}

Json json_of(const std::vector<Diagnostic>& diagnostics) {
  Json list = Json::array();
  for (const Diagnostic& diagnostic : diagnostics) {
    list.push_back({{"code", diagnostic.code},
                    {"severity", std::string(to_string(diagnostic.severity))},
                    {"message", diagnostic.message}});
  }
  return list;
}

std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace flyball
