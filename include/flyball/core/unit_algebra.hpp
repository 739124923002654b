#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

/// Any product of powers of SI units, for formulas: `Dimension` names only what interfaces speak
/// of.
namespace flyball {

/// The exponents of the SI base units in a unit: a joule is kg¹ m² s⁻². Exponents need not be whole
/// (the root of a length is m^(1/2)). Angles are plain numbers; they are carried along so that a
/// message can say rad, and comparisons pass over them.
struct SiDimension {
  /// Base units in the order of `exponents`.
  enum Base : std::size_t { kilogram, meter, second, ampere, kelvin, radian };

  std::array<double, 6> exponents{};

  /// Equal but for angles. Exponents within 1e-9 are equal: a third thrice is one.
  [[nodiscard]] bool fits(const SiDimension& other) const noexcept;
  /// Whether this is a plain number or an angle.
  [[nodiscard]] bool dimensionless() const noexcept { return fits({}); }

  friend SiDimension operator*(const SiDimension& a, const SiDimension& b) noexcept;
  friend SiDimension operator/(const SiDimension& a, const SiDimension& b) noexcept;
};

/// The dimension of x^exponent.
[[nodiscard]] SiDimension power(const SiDimension& x, double exponent) noexcept;

/// The dimension that a name of `Dimension` stands for.
[[nodiscard]] SiDimension si_dimension(Dimension dimension) noexcept;

/// "kg m^2", "V s/rad", "N", "m^(1/2)"; "1" for a plain number.
[[nodiscard]] std::string to_text(const SiDimension& dimension);

/// A unit: its dimension and its size in SI.
struct SiUnit {
  SiDimension dimension;
  double factor = 1.0;
};

/// Reads a product of units: "kg m^2/s^2", "V*s/rad", "N·m/A", "V/(rad/s)", "1/s", "mH", "m^0.5".
/// What `parse_unit` knows, the coherent SI units J W C F H T Wb Pa K h S L, and decimal prefixes
/// before a symbol; factors apply from left to right, "1" and an empty text are plain numbers.
/// @errors ArgumentError::wrong_unit with the part that is not known and the nearest unit,
///         malformed for a parenthesis or an exponent that cannot be read.
[[nodiscard]] Expected<SiUnit> parse_si_unit(std::string_view text);

/// A quantity's text in its two parts.
struct QuantityText {
  double number = 0.0;
  std::string_view unit;  ///< A part of the text, without blanks around it; may be empty.
};

/// Takes "2.5 kg m^2" apart into 2.5 and "kg m^2". @param name  The thing's name, for the message.
/// @errors ArgumentError::malformed where there is no number in front, not_finite.
[[nodiscard]] Expected<QuantityText> split_quantity(std::string_view text, std::string_view name);

}  // namespace flyball
