#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <flyball/io/motion/json_parts.hpp>

#include "io/motion/json_tree.hpp"

/// The members of the objects of a file, said once for the reader and the writer: a describer is
/// called with either and with the object's struct, and names each member. What a struct's file had
/// besides stays in its `origin`.
namespace flyball::io {

/// How a value is written that no file had.
struct JsonStyle {
  int indent = 1;          ///< Blanks a level.
  bool rows = false;       ///< An object of a list stands on one line.
  std::string_view colon;  ///< ":" and what is around it.
};

// ---- reading -----------------------------------------------------------------------------------

/// What all objects of one reading share.
class JsonReading {
 public:
  JsonReading(std::shared_ptr<const JsonTree> tree, std::string source)
      : tree_(std::move(tree)), source_(std::move(source)) {}

  [[nodiscard]] const std::shared_ptr<const JsonTree>& tree() const noexcept { return tree_; }
  [[nodiscard]] const std::string& source() const noexcept { return source_; }
  [[nodiscard]] bool failed() const noexcept { return error_.has_value(); }
  [[nodiscard]] Errors error() const { return Errors(std::vector<QuotedError>{*error_}); }

  /// A value that is not what it must be. @param got  Empty: what stands there.
  void refuse(const JsonNode& node, std::string_view expected, std::string got = {},
              std::string hint = {});
  /// A member that is not there.
  void miss(const JsonNode& object, std::string_view key);

  std::vector<std::string> path{};  ///< From the root to the value that is read.

 private:
  void fail(const JsonNode& node, Error error);

  std::shared_ptr<const JsonTree> tree_;
  std::string source_;
  std::optional<QuotedError> error_{};
};

class JsonMembersIn;

/// Reads a value of a basic type. @return  Whether it was one.
bool read_value(JsonReading& reading, const JsonNode& node, double& value);
bool read_value(JsonReading& reading, const JsonNode& node, int& value);
bool read_value(JsonReading& reading, const JsonNode& node, bool& value);
bool read_value(JsonReading& reading, const JsonNode& node, std::string& value);
bool read_value(JsonReading& reading, const JsonNode& node, JsonText& value);
bool read_value(JsonReading& reading, const JsonNode& node, ExpressedNumber& value);
bool read_value(JsonReading& reading, const JsonNode& node, std::array<double, 4>& value);
bool read_value(JsonReading& reading, const JsonNode& node, AutoCommand& value);
bool read_value(JsonReading& reading, const JsonNode& node, std::vector<bool>& values);

template <class T>
bool read_value(JsonReading& reading, const JsonNode& node, std::vector<T>& values) {
  if (node.kind != JsonKind::array) {
    reading.refuse(node, "a list");
    return false;
  }
  values.clear();
  values.reserve(node.children.size());
  for (const JsonNode& child : node.children) {
    reading.path.push_back("[" + std::to_string(values.size()) + "]");
    if (!read_value(reading, child, values.emplace_back())) {
      return false;
    }
    reading.path.pop_back();
  }
  return true;
}

template <class T>
bool read_value(JsonReading& reading, const JsonNode& node, std::optional<T>& value) {
  if (node.kind == JsonKind::null) {
    value.reset();
    return true;
  }
  return read_value(reading, node, value.emplace());
}

template <class T>
constexpr bool is_optional = false;
template <class T>
constexpr bool is_optional<std::optional<T>> = true;

/// The members of one object, for a describer.
class JsonMembersIn {
 public:
  static constexpr bool writes = false;

  JsonMembersIn(JsonReading& reading, const JsonNode& node) : reading_(reading), node_(node) {}

  /// A member: one of an optional may be absent or null.
  template <class T>
  void operator()(std::string_view key, T& value) {
    if (const JsonNode* node = find(key, is_optional<T>)) {
      in(key, [&] { return read_value(reading_, *node, value); });
    }
  }
  /// The same of an optional that is written as null where it is absent.
  template <class T>
  void nullable(std::string_view key, std::optional<T>& value) {
    (*this)(key, value);
  }
  /// A member that keeps what it has where the file does not say it.
  template <class T>
  void maybe(std::string_view key, T& value) {
    if (const JsonNode* node = find(key, true); node != nullptr && node->kind != JsonKind::null) {
      in(key, [&] { return read_value(reading_, *node, value); });
    }
  }
  /// What need not be there, but is written into what is new: other programs ask for it.
  template <class T>
  void usual(std::string_view key, T& value) {
    maybe(key, value);
  }
  template <class T, class Describe>
  void usual_list(std::string_view key, std::vector<T>& values, Describe describe) {
    list(key, values, describe, false);
  }
  /// An object. @param must  Whether it must be there.
  template <class T, class Describe>
  void object(std::string_view key, T& value, Describe describe, bool must = true) {
    if (const JsonNode* node = find(key, !must); node != nullptr && (must || !is_null(*node))) {
      in(key, [&] { return read(reading_, *node, value, describe); });
    }
  }
  template <class T, class Describe>
  void object(std::string_view key, std::optional<T>& value, Describe describe) {
    if (const JsonNode* node = find(key, true); node != nullptr && !is_null(*node)) {
      in(key, [&] { return read(reading_, *node, value.emplace(), describe); });
    }
  }
  /// An object that says a part of the same struct.
  template <class T, class Describe>
  void part(std::string_view key, T& value, Describe describe) {
    if (const JsonNode* node = find(key, false)) {
      in(key, [&] {
        if (node->kind != JsonKind::object) {
          reading_.refuse(*node, "an object");
          return false;
        }
        JsonMembersIn members(reading_, *node);
        describe(members, value);
        return !reading_.failed();
      });
    }
  }
  template <class T, class Describe>
  void nullable(std::string_view key, std::optional<T>& value, Describe describe) {
    object(key, value, describe);
  }
  /// A list of objects. @param must  Whether it must be there.
  template <class T, class Describe>
  void list(std::string_view key, std::vector<T>& values, Describe describe, bool must = true) {
    const JsonNode* node = find(key, !must);
    if (node == nullptr || (!must && is_null(*node))) {
      return;
    }
    in(key, [&] {
      if (node->kind != JsonKind::array) {
        reading_.refuse(*node, "a list of objects");
        return false;
      }
      return each(*node, values, describe, false);
    });
  }
  /// An object whose keys are the names of what it holds.
  template <class T, class Describe>
  void map(std::string_view key, std::vector<T>& values, Describe describe, bool must = true) {
    const JsonNode* node = find(key, !must);
    if (node == nullptr || (!must && is_null(*node))) {
      return;
    }
    in(key, [&] {
      if (node->kind != JsonKind::object) {
        reading_.refuse(*node, "an object");
        return false;
      }
      return each(*node, values, describe, true);
    });
  }
  /// A name or a number, such as a version or a waypoint, as text.
  void id(std::string_view key, std::string& value);
  void id(std::string_view key, std::optional<std::string>& value);
  /// An object's members that are numbers, and one that is yes or no; the others stay in the
  /// origin.
  void numbers(std::string_view key, std::vector<NamedNumber>& values, std::string_view flag_name,
               std::optional<bool>& flag);

  template <class T, class Describe>
  static bool read(JsonReading& reading, const JsonNode& node, T& value, Describe describe) {
    if (node.kind != JsonKind::object) {
      reading.refuse(node, "an object");
      return false;
    }
    value.origin = JsonOrigin(reading.tree(), node);
    JsonMembersIn members(reading, node);
    describe(members, value);
    return !reading.failed();
  }

  /// A list of objects that is no member, such as a whole file.
  template <class T, class Describe>
  static bool read_list(JsonReading& reading, const JsonNode& node, std::vector<T>& values,
                        Describe describe) {
    if (node.kind != JsonKind::array) {
      reading.refuse(node, "a list of objects");
      return false;
    }
    JsonMembersIn members(reading, node);
    return members.each(node, values, describe, false);
  }

  [[nodiscard]] bool has(std::string_view key) const { return node_.find(key) != nullptr; }
  [[nodiscard]] JsonReading& reading() const noexcept { return reading_; }
  [[nodiscard]] const JsonNode& node() const noexcept { return node_; }

 private:
  static bool is_null(const JsonNode& node) { return node.kind == JsonKind::null; }

  const JsonNode* find(std::string_view key, bool may_be_absent) {
    if (reading_.failed()) {
      return nullptr;
    }
    const JsonNode* node = node_.find(key, &hint_);
    if (node == nullptr && !may_be_absent) {
      reading_.miss(node_, key);
    }
    return node;
  }
  template <class F>
  void in(std::string_view key, const F& read) {
    reading_.path.emplace_back(key);
    if (read()) {
      reading_.path.pop_back();
    }
  }
  template <class T, class Describe>
  bool each(const JsonNode& node, std::vector<T>& values, Describe describe, bool named) {
    values.clear();
    values.reserve(node.children.size());
    for (const JsonNode& child : node.children) {
      reading_.path.push_back("[" + (named ? child.key : std::to_string(values.size())) + "]");
      T& value = values.emplace_back();
      if constexpr (requires { value.name = std::string(); }) {
        if (named) {
          value.name = child.key;
        }
      }
      if (!read(reading_, child, value, describe)) {
        return false;
      }
      reading_.path.pop_back();
    }
    return true;
  }

  JsonReading& reading_;
  const JsonNode& node_;
  std::size_t hint_ = 0;
};

// ---- writing -----------------------------------------------------------------------------------

/// Where a value is written: what stood there, and how deep it is.
struct JsonSpot {
  const JsonTree* tree = nullptr;
  const JsonNode* old = nullptr;
  JsonStyle style{};
  int depth = 0;
  bool row = false;  ///< All on one line.

  [[nodiscard]] JsonSpot member(std::string_view key) const;
  [[nodiscard]] JsonSpot element(std::size_t index) const;
  [[nodiscard]] JsonSpot of(const JsonOrigin& origin) const;
};

/// A member or an element as text.
struct JsonPiece {
  std::string key{};
  std::string text{};
  bool there = true;  ///< Not: what stood there becomes null, or nothing is written.
};

/// An object of these known members and of what else stood there.
[[nodiscard]] std::string compose_object(const JsonSpot& spot, std::vector<JsonPiece> members);
/// A list, or an object of which every member is known, of these.
[[nodiscard]] std::string compose_list(const JsonSpot& spot, const std::vector<JsonPiece>& pieces,
                                       bool named, bool numbers);

[[nodiscard]] std::string written(const JsonSpot& spot, double value);
[[nodiscard]] std::string written(const JsonSpot& spot, int value);
[[nodiscard]] std::string written(const JsonSpot& spot, bool value);
[[nodiscard]] std::string written(const JsonSpot& spot, const std::string& value);
[[nodiscard]] std::string written(const JsonSpot& spot, const JsonText& value);
[[nodiscard]] std::string written(const JsonSpot& spot, const ExpressedNumber& value);
[[nodiscard]] std::string written(const JsonSpot& spot, const std::array<double, 4>& value);
[[nodiscard]] std::string written(const JsonSpot& spot, const AutoCommand& value);
[[nodiscard]] std::string written(const JsonSpot& spot, const std::vector<bool>& values);

template <class T>
[[nodiscard]] std::string written(const JsonSpot& spot, const std::vector<T>& values) {
  std::vector<JsonPiece> pieces;
  pieces.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    JsonSpot element = spot.element(i);
    if constexpr (requires { values[i].origin; }) {
      element = element.of(values[i].origin);
    }
    pieces.push_back({{}, written(element, values[i])});
  }
  return compose_list(spot, pieces, false, std::is_arithmetic_v<T>);
}

/// The members of one object, for a describer.
class JsonMembersOut {
 public:
  static constexpr bool writes = true;

  explicit JsonMembersOut(JsonSpot spot) : spot_(spot) {}

  template <class T>
  void operator()(std::string_view key, const T& value) {
    if constexpr (is_optional<T>) {
      value ? (*this)(key, *value) : absent(key);
    } else {
      JsonSpot spot = spot_.member(key);
      if constexpr (requires { value.origin; }) {
        spot = spot.of(value.origin);
      }
      if constexpr (std::is_same_v<T, JsonText>) {
        if (value.text.empty()) {
          absent(key);
          return;
        }
      }
      add(key, written(spot, value));
    }
  }
  template <class T>
  void nullable(std::string_view key, const std::optional<T>& value) {
    value ? (*this)(key, *value) : nothing(key);
  }
  template <class T>
  void maybe(std::string_view key, const T& value) {
    const JsonSpot spot = spot_.member(key);
    if (value == T{} && (spot.old == nullptr || spot.old->kind == JsonKind::null)) {
      absent(key);
    } else {
      (*this)(key, value);
    }
  }
  template <class T>
  void usual(std::string_view key, const T& value) {
    if (spot_.old == nullptr) {
      (*this)(key, value);
    } else {
      maybe(key, value);
    }
  }
  template <class T, class Describe>
  void usual_list(std::string_view key, const std::vector<T>& values, Describe describe) {
    list(key, values, describe, spot_.old == nullptr);
  }
  template <class T, class Describe>
  void object(std::string_view key, const T& value, Describe describe, bool must = true) {
    const JsonSpot spot = spot_.member(key);
    const bool was = spot.old != nullptr && spot.old->kind == JsonKind::object;
    if (must || was || value.origin.node() != nullptr) {
      add(key, text(spot, value, describe));
    } else {
      absent(key);
    }
  }
  template <class T, class Describe>
  void object(std::string_view key, const std::optional<T>& value, Describe describe) {
    value ? add(key, text(spot_.member(key), *value, describe)) : absent(key);
  }
  template <class T, class Describe>
  void nullable(std::string_view key, const std::optional<T>& value, Describe describe) {
    value ? add(key, text(spot_.member(key), *value, describe)) : nothing(key);
  }
  template <class T, class Describe>
  void part(std::string_view key, const T& value, Describe describe) {
    add(key, members(spot_.member(key), value, describe));
  }
  template <class T, class Describe>
  void list(std::string_view key, const std::vector<T>& values, Describe describe,
            bool must = true) {
    each(key, values, describe, must, false);
  }
  template <class T, class Describe>
  void map(std::string_view key, const std::vector<T>& values, Describe describe,
           bool must = true) {
    each(key, values, describe, must, true);
  }
  void id(std::string_view key, const std::string& value);
  void id(std::string_view key, const std::optional<std::string>& value);
  void numbers(std::string_view key, const std::vector<NamedNumber>& values,
               std::string_view flag_name, const std::optional<bool>& flag);

  template <class T, class Describe>
  static std::string text(const JsonSpot& spot, const T& value, Describe describe) {
    return members(spot.of(value.origin), value, describe);
  }
  /// The same of an object that a struct describes in part: what stood there is the spot's.
  template <class T, class Describe>
  static std::string members(const JsonSpot& spot, const T& value, Describe describe) {
    JsonMembersOut all(spot);
    describe(all, value);
    return compose_object(spot, std::move(all.pieces_));
  }

  /// A list of objects, or an object of objects by their names.
  template <class T, class Describe>
  static std::string list_text(const JsonSpot& spot, const std::vector<T>& values,
                               Describe describe, bool named = false) {
    std::vector<JsonPiece> pieces;
    pieces.reserve(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      // Of what has no origin nothing is taken from what stood at its place.
      JsonSpot element = spot.element(i);
      element.old = nullptr;
      std::string name;
      if constexpr (requires { values[i].name; }) {
        name = named ? values[i].name : "";
      }
      pieces.push_back({std::move(name), text(element, values[i], describe)});
    }
    return compose_list(spot, pieces, named, false);
  }

  [[nodiscard]] bool has(std::string_view key) const {
    return spot_.old != nullptr && spot_.old->find(key) != nullptr;
  }

 private:
  void add(std::string_view key, std::string value) {
    pieces_.push_back({std::string(key), std::move(value)});
  }
  /// Null in an object that no file had; else what stood there stays, or goes.
  void nothing(std::string_view key) { spot_.old != nullptr ? absent(key) : add(key, "null"); }
  void absent(std::string_view key) { pieces_.push_back({std::string(key), {}, false}); }

  template <class T, class Describe>
  void each(std::string_view key, const std::vector<T>& values, Describe describe, bool must,
            bool named) {
    const JsonSpot spot = spot_.member(key);
    if (values.empty() && !must && (spot.old == nullptr || spot.old->kind == JsonKind::null)) {
      absent(key);
      return;
    }
    add(key, list_text(spot, values, describe, named));
  }

  JsonSpot spot_;
  std::vector<JsonPiece> pieces_;
};

/// A whole file: what stands before and after the outermost value stays.
template <class T, class Describe>
[[nodiscard]] std::string write_document(const T& value, Describe describe, JsonStyle style) {
  const JsonOrigin& origin = value.origin;
  std::string text = JsonMembersOut::text({.style = style}, value, describe);
  if (origin.node() == nullptr) {
    return text + "\n";
  }
  const JsonTree& tree = *origin.tree();
  return std::string(tree.slice(0, origin.node()->begin)) + text +
         std::string(tree.slice(origin.node()->end, tree.text.size()));
}

/// A text that a writer made, if its numbers are finite. @errors MotionFileError::wrong_field.
[[nodiscard]] Expected<std::string> checked_text(std::string text);

/// A whole file. @param value  What it is read into. @errors MotionFileError.
template <class T, class Describe>
[[nodiscard]] ExpectedAll<T> read_document(std::shared_ptr<const JsonTree> tree,
                                           const std::string& source, T value, Describe describe) {
  JsonReading reading(std::move(tree), source);
  if (!JsonMembersIn::read(reading, reading.tree()->root, value, describe)) {
    return tl::unexpected(reading.error());
  }
  return value;
}

}  // namespace flyball::io
