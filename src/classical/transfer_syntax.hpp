#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

/// The grammar of transfer functions in text.
namespace flyball::classical::detail {

/// Where errors of transfer functions in text say that they are.
inline constexpr std::string_view in_transfer_function = "transfer function";

/// A part of a text, in bytes.
struct TextPlace {
  std::size_t offset = 0;
  std::size_t length = 0;

  [[nodiscard]] std::size_t end() const { return offset + length; }
  /// From the start of one to the end of the other.
  [[nodiscard]] TextPlace to(const TextPlace& last) const { return {offset, last.end() - offset}; }
};

/// An error at a place of a text. @param quoted  Whether its subject is the place's words.
[[nodiscard]] Error at_place(Error error, TextPlace place);
/// The words of a place in quotes, shortened.
[[nodiscard]] std::string quote(std::string_view text, TextPlace place);

/// A part of an expression. Parts stand behind their operands; the last is the whole.
struct TransferNode {
  enum class Kind : std::uint8_t {
    number,
    euler,  ///< e
    variable,
    coefficients,  ///< Of a polynomial in the variable.
    add,
    subtract,
    multiply,
    divide,
    negate,
    power,
    exponential,
    square_root,
    feedback,  ///< a/(1 + a b)
  };

  Kind kind = Kind::number;
  TextPlace place;
  double number = 0.0;
  std::size_t a = 0;  ///< Operands.
  std::size_t b = 0;
  std::vector<double> list{};
};

/// An expression taken apart.
struct TransferSyntax {
  std::vector<TransferNode> nodes{};
  char variable = 0;  ///< 's', 'z', or neither.
  TextPlace first_use{};
};

/// @errors As `parse_transfer_function`, but for what the values decide.
[[nodiscard]] Expected<TransferSyntax> parse_transfer_syntax(std::string_view text);

}  // namespace flyball::classical::detail
