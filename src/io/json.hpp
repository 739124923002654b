#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/error.hpp>

/// What all JSON that is answered has in common (docs/schemas.md).
namespace flyball {

/// JSON has no infinity: it is a text, and what is not a number is null.
[[nodiscard]] nlohmann::ordered_json json_of(double value);

/// Code, message and the evidence by its names.
[[nodiscard]] nlohmann::ordered_json json_of(const Error& error);

/// Code, severity and message of each.
[[nodiscard]] nlohmann::ordered_json json_of(const std::vector<Diagnostic>& diagnostics);

/// One line. Bytes that are not UTF-8, which logs and problems may bring, are replaced.
[[nodiscard]] std::string dump(const nlohmann::ordered_json& json);

}  // namespace flyball
