#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include <flyball/core/expected.hpp>

namespace flyball::solve {

/// A JSON value that goes without allocating. nlohmann's own destructor lists what a value holds,
/// and where there is no memory for that list, the process ends.
class JsonObject {
 public:
  JsonObject() = default;
  JsonObject(JsonObject&& other) noexcept : value_(std::exchange(other.value_, {})) {}
  JsonObject& operator=(JsonObject&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  ~JsonObject();

  [[nodiscard]] const nlohmann::json& json() const noexcept { return value_; }
  [[nodiscard]] nlohmann::json& json() noexcept { return value_; }

 private:
  nlohmann::json value_;
};

/// The JSON object that a text is.
/// @param where  The kind of problem or the file, for messages. @param what  "problem" or "model".
/// @errors ArgumentError::malformed: no JSON, with the place; no object; nesting that no problem
/// has.
[[nodiscard]] Expected<JsonObject> parse_object(std::string_view text, std::string_view where,
                                                std::string_view what);

}  // namespace flyball::solve
