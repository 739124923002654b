#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/io/json_text.hpp>

#include "core/try.hpp"
#include "io/json_walk.hpp"
#include "solve/json_object.hpp"
#include "solve/json_value.hpp"

namespace flyball::solve {

using Json = nlohmann::json;

namespace {

constexpr const char* example = "one JSON object, such as {\"A\": [[0, 1], [0, -2]], …}";

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

constexpr int deepest = 64;

/// Builds a tree of what a parser tells.
class Builder : public nlohmann::json_sax<Json> {
 public:
  explicit Builder(JsonTree& tree) : tree_(tree) {}

  bool null() override { return put(JsonType::null, 0.0); }
  bool boolean(bool value) override { return put(JsonType::boolean, value ? 1.0 : 0.0); }
  bool number_integer(number_integer_t value) override {
    return put(JsonType::number, static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return put(JsonType::number, static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return put(JsonType::number, value);
  }
  bool string(string_t& value) override {
    tree_.put_text(value);
    return true;
  }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return open(JsonType::object); }
  bool start_array(std::size_t /*size*/) override { return open(JsonType::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    tree_.put_text(name, true);
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
  bool put(JsonType type, double value) {
    tree_.put(type, value);
    return true;
  }
  bool open(JsonType type) {
    tree_.open(type);
    return tree_.depth() <= static_cast<std::size_t>(deepest);
  }
  bool close() {
    tree_.close();
    return true;
  }

  JsonTree& tree_;
  std::size_t byte_ = 0;
  bool out_of_range_ = false;
};

/// The same of a text that `JsonWalk` does not take: what is wrong with it, in nlohmann's parser's
/// words.
Expected<JsonTree> parse_slowly(std::string_view text, std::string_view where,
                                std::string_view what) {
  if (const int depth = depth_of(text); depth > deepest) {
    return malformed(where, what, fmt::format("{} brackets within each other", depth),
                     fmt::format("at most {}", deepest));
  }
  if (const std::size_t nul = text.find('\0'); nul != text.npos) {  // which would end it silently
    return malformed(where, what, "with a NUL in it", "JSON, which has none", place_of(text, nul));
  }
  JsonTree tree;
  Builder builder(tree);
  if (!Json::sax_parse(text, &builder)) {
    if (builder.out_of_range()) {
      return malformed(where, what, "not to be read: a number is beyond 1.8e308",
                       "numbers that a double holds");
    }
    return malformed(where, what, complaint(text, builder.byte()), example,
                     place_of(text, builder.byte() - 1));
  }
  return tree;
}

}  // namespace

Expected<JsonTree> parse_object(std::string_view text, std::string_view where,
                                std::string_view what) {
  JsonTree tree;
  tree.expect(text.size());
  Builder builder(tree);
  io::WholeText whole(text);
  const bool plain = io::JsonWalk(whole, builder).walk() == io::JsonEnd::complete;
  if (!plain) {
    FLYBALL_TRY(tree, parse_slowly(text, where, what));
  }
  if (!tree.root().is_object()) {
    return malformed(where, what, kind_of(tree.root()), example);
  }
  if (const auto repeated = plain ? std::nullopt : repeated_key(text)) {
    return malformed(where, what, fmt::format("an object with the key \"{}\" twice", repeated->key),
                     "an object with each key once", place_of(text, repeated->at));
  }
  return tree;
}

}  // namespace flyball::solve
