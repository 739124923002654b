#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/errors.hpp>
#include <flyball/io/motion/json_origin.hpp>

#include "core/try.hpp"

/// JSON of planning tools with all that stands in it: each value knows its bytes.
namespace flyball::io {

enum class JsonKind : std::uint8_t { null, boolean, number, string, array, object };

/// "a number", "a list", …
[[nodiscard]] std::string_view to_string(JsonKind kind);

/// A value, and as a member of an object its key. Offsets are bytes of the tree's text.
struct JsonNode {
  JsonKind kind = JsonKind::null;
  std::size_t key_begin = 0, key_end = 0;  ///< With quotes; equal where there is no key.
  std::size_t begin = 0, end = 0;          ///< Of the value.
  double number = 0.0;                     ///< Of a number; 1 of true.
  std::string key{};                       ///< Without escapes.
  std::vector<JsonNode> children{};        ///< In the order of the text.

  /// The member of that name. @param hint  Where it is looked for first; set behind what is found.
  [[nodiscard]] const JsonNode* find(std::string_view name, std::size_t* hint = nullptr) const;
};

/// A text and what it says.
struct JsonTree {
  std::string text{};
  JsonNode root{};

  [[nodiscard]] std::string_view slice(std::size_t from, std::size_t to) const {
    return std::string_view(text).substr(from, to - from);
  }
  [[nodiscard]] std::string_view slice(const JsonNode& node) const {
    return slice(node.begin, node.end);
  }
  /// What a string says, escapes resolved. @param node  A string.
  [[nodiscard]] std::string string(const JsonNode& node) const;
};

/// Most bytes, values and brackets inside each other that a file may have.
inline constexpr std::size_t most_json_bytes = std::size_t{64} << 20;
inline constexpr std::size_t most_json_values = 500'000;
inline constexpr std::size_t most_json_depth = 200;

/// The text taken apart: RFC 8259, a byte-order mark in front allowed; numbers must be finite and
/// no object may have a key twice. @errors MotionFileError::not_json, too_large, with place,
/// excerpt and caret. Cost: O(size), some 130 bytes a value.
[[nodiscard]] ExpectedAll<std::shared_ptr<const JsonTree>> parse_json_tree(
    std::string_view text, const std::string& source);

/// What a file of another kind is: "an object of a, b, c", "a list".
[[nodiscard]] std::string outline(const JsonNode& root);

/// An error of a place of a text, with the line's part around it and a caret below.
/// @param length  Of what is wrong, bytes.
[[nodiscard]] QuotedError quoted_at(std::string_view text, std::size_t offset, std::size_t length,
                                    const std::string& source, Error error);

}  // namespace flyball::io
