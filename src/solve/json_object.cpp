#include <algorithm>
#include <new>
#include <optional>
#include <utility>

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

/// Asks for the memory that the values of a text need at most, and gives it back. The parser itself
/// would end the process if it found out in the middle: see TakenApart.
void check_memory(std::string_view text) {
  constexpr std::size_t small = 65536;
  constexpr std::size_t each = 4 * sizeof(Json);  // old and new elements of a vector that grows
  if (text.size() > small) {
    const auto values = static_cast<std::size_t>(std::count_if(
        text.begin(), text.end(), [](char c) { return c == ',' || c == '[' || c == '{'; }));
    ::operator delete(::operator new(text.size() + each * values));
  }
}

}  // namespace

void TakenApart::clear(Json& value) noexcept {
  if (auto* array = value.get_ptr<Json::array_t*>()) {
    std::for_each(array->begin(), array->end(), &TakenApart::clear);
    array->clear();
  } else if (auto* object = value.get_ptr<Json::object_t*>()) {
    for (auto& member : *object) {
      clear(member.second);
    }
    object->clear();
  }
}

Expected<Json> parse_object(std::string_view text, std::string_view where, std::string_view what) {
  constexpr int deepest = 64;
  if (const int depth = depth_of(text); depth > deepest) {
    return malformed(where, what, fmt::format("{} brackets within each other", depth),
                     fmt::format("at most {}", deepest));
  }
  check_memory(text);
  constexpr const char* example = "one JSON object, such as {\"A\": [[0, 1], [0, -2]], …}";
  try {
    Json object = Json::parse(text);
    if (!object.is_object()) {
      return malformed(where, what, kind_of(object), example);
    }
    if (const auto repeated = repeated_key(text)) {
      return malformed(where, what,
                       fmt::format("an object with the key \"{}\" twice", repeated->key),
                       "an object with each key once", place_of(text, repeated->at));
    }
    return object;
  } catch (const Json::parse_error& problem) {
    return malformed(where, what, complaint(text, problem.byte), example,
                     place_of(text, problem.byte - 1));
  } catch (const Json::exception&) {
    return malformed(where, what, "not to be read: a number is beyond 1.8e308",
                     "numbers that a double holds");
  }
}

}  // namespace flyball::solve
