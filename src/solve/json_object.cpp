#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <flyball/io/json_text.hpp>

#include "core/try.hpp"
#include "solve/json_object.hpp"
#include "solve/json_value.hpp"

namespace flyball::solve {

using Json = nlohmann::json;

namespace {

/// Brackets of a text that are open at once, strings left out. Writing a value (an id) recurses.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool quoted = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (quoted) {
      if (c == '\\') {
        ++k;
      } else if (c == '"') {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return deepest;
}

Refusal malformed(std::string_view where, std::string_view what, std::string got,
                  std::string expected, std::optional<Place> place = {}) {
  Refusal refused = refusal(ArgumentError::malformed, where, "the " + std::string(what))
                        .got(std::move(got))
                        .expected(std::move(expected));
  return place ? std::move(refused)
                     .with("line", static_cast<double>(place->line))
                     .with("column", static_cast<double>(place->column))
               : std::move(refused);
}

/// What is wrong at a byte, counted from 1 and one past the end for a text that ends too soon.
std::string complaint(std::string_view text, std::size_t byte) {
  if (byte > text.size()) {
    return text.find_first_not_of(" \t\r\n") == std::string_view::npos ? "empty" : "cut off";
  }
  return "not JSON";
}

/// Empties a value from its leaves, so that no destructor meets one that holds something.
void empty(Json& value) noexcept {
  if (value.is_structured()) {
    for (Json& element : value) {
      empty(element);
    }
    value.clear();
  }
}

/// Builds a value where it will stay.
class Builder : public nlohmann::json_sax<Json> {
 public:
  explicit Builder(Json& root) : root_(root) {}

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return put(value); }
  bool string(string_t& value) override { return put(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return start(Json::value_t::object); }
  bool start_array(std::size_t /*size*/) override { return start(Json::value_t::array); }
  bool end_object() override { return end(); }
  bool end_array() override { return end(); }
  bool key(string_t& name) override {
    key_ = std::move(name);
    return true;
  }
  bool parse_error(std::size_t byte, const std::string& /*token*/,
                   const Json::exception& problem) override {
    byte_ = byte;
    out_of_range_ = dynamic_cast<const Json::out_of_range*>(&problem) != nullptr;
    return false;
  }

  [[nodiscard]] std::size_t byte() const { return byte_; }
  [[nodiscard]] bool out_of_range() const { return out_of_range_; }

 private:
  template <class Value>
  Json& add(Value&& value) {
    if (open_.empty()) {
      return root_ = std::forward<Value>(value);
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::forward<Value>(value));
      return parent.back();
    }
    return parent[key_] = std::forward<Value>(value);
  }
  template <class Value>
  bool put(Value&& value) {
    add(std::forward<Value>(value));
    return true;
  }
  bool start(Json::value_t type) {
    open_.push_back(&add(Json(type)));
    return true;
  }
  bool end() {
    open_.pop_back();
    return true;
  }

  Json& root_;
  std::vector<Json*> open_;  ///< A value does not move while something in it is open.
  std::string key_;
  std::size_t byte_ = 0;
  bool out_of_range_ = false;
};

}  // namespace

JsonObject::~JsonObject() {
  empty(value_);
}

Expected<JsonObject> parse_object(std::string_view text, std::string_view where,
                                  std::string_view what) {
  constexpr int deepest = 64;
  if (const int depth = depth_of(text); depth > deepest) {
    return malformed(where, what, fmt::format("{} brackets within each other", depth),
                     fmt::format("at most {}", deepest));
  }
  if (const std::size_t nul = text.find('\0'); nul != text.npos) {  // which would end it silently
    return malformed(where, what, "with a NUL in it", "JSON, which has none", place_of(text, nul));
  }
  constexpr const char* example = "one JSON object, such as {\"A\": [[0, 1], [0, -2]], …}";
  JsonObject object;
  Builder builder(object.json());
  if (!Json::sax_parse(text, &builder)) {
    if (builder.out_of_range()) {
      return malformed(where, what, "not to be read: a number is beyond 1.8e308",
                       "numbers that a double holds");
    }
    return malformed(where, what, complaint(text, builder.byte()), example,
                     place_of(text, builder.byte() - 1));
  }
  if (!object.json().is_object()) {
    return malformed(where, what, kind_of(object.json()), example);
  }
  if (const auto repeated = repeated_key(text)) {
    return malformed(where, what, fmt::format("an object with the key \"{}\" twice", repeated->key),
                     "an object with each key once", place_of(text, repeated->at));
  }
  return object;
}

}  // namespace flyball::solve
