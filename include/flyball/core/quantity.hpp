#pragma once

#include <compare>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// The dimensions that Flyball's interfaces speak of.
enum class Dimension {
  dimensionless,
  mass,
  length,
  time,
  angle,
  velocity,
  angular_velocity,
  acceleration,
  angular_acceleration,
  force,
  torque,
  moment_of_inertia,
  voltage,
  current,
  resistance,
  frequency,
};

/// "mass", "moment of inertia", …
[[nodiscard]] std::string_view to_string(Dimension dimension);

/// The SI unit that Flyball prints for a dimension: "kg", "rad/s", …; empty if dimensionless.
[[nodiscard]] std::string_view si_unit(Dimension dimension);

/// A tagged SI double: it cannot be passed for another dimension, and does no algebra.
/// Constructed from a literal (8_kg), from text ("8 kg") or from an explicit SI value.
template <Dimension D>
class Quantity {
 public:
  static constexpr Dimension dimension = D;

  constexpr Quantity() noexcept = default;
  /// @param si  The value in the SI unit of the dimension.
  template <class Number>
    requires std::is_arithmetic_v<Number>
  constexpr explicit Quantity(Number si) noexcept : si_(static_cast<double>(si)) {}
  /// `mass = 8.0` comes here: a quantity needs its unit, 8_kg, or Mass(8.0) of the SI unit.
  template <class Number_without_a_unit, class... None>
    requires(std::is_arithmetic_v<Number_without_a_unit> && sizeof...(None) == 0)
  constexpr Quantity(Number_without_a_unit, None...) = delete;

  [[nodiscard]] constexpr double si() const noexcept { return si_; }
  constexpr Quantity operator-() const noexcept { return Quantity(-si_); }
  constexpr auto operator<=>(const Quantity&) const noexcept = default;

 private:
  double si_ = 0.0;
};

/// What interfaces take.
using Mass = Quantity<Dimension::mass>;
using Length = Quantity<Dimension::length>;
using Time = Quantity<Dimension::time>;
using Angle = Quantity<Dimension::angle>;
using Velocity = Quantity<Dimension::velocity>;
using AngularVelocity = Quantity<Dimension::angular_velocity>;
using Acceleration = Quantity<Dimension::acceleration>;
using AngularAcceleration = Quantity<Dimension::angular_acceleration>;
using Force = Quantity<Dimension::force>;
using Torque = Quantity<Dimension::torque>;
using MomentOfInertia = Quantity<Dimension::moment_of_inertia>;
using Voltage = Quantity<Dimension::voltage>;
using Current = Quantity<Dimension::current>;
using Resistance = Quantity<Dimension::resistance>;
using Frequency = Quantity<Dimension::frequency>;

/// A unit: its dimension and its size in SI.
struct Unit {
  Dimension dimension = Dimension::dimensionless;
  double factor = 1.0;
};

/// Reads a unit's text: "kg", "in", "rpm", "kg m^2", "N·m", "Rotation per Second", …
/// Case matters only where a prefix does (mV, MV); plural and long names are accepted.
/// @errors ArgumentError::wrong_unit with the nearest known unit as hint.
[[nodiscard]] Expected<Unit> parse_unit(std::string_view text);

/// A unit by one of its names.
struct NamedUnit {
  std::string_view text;  ///< Without spaces, "^", "·": "kgm2".
  Dimension dimension = Dimension::dimensionless;
  double factor = 1.0;  ///< To SI.
};

/// Every name that a unit is known by, of a dimension, the SI unit first.
[[nodiscard]] std::vector<NamedUnit> units_of(Dimension dimension);

/// Reads "8 kg", "2.54cm", "-1.5e3 rpm" into SI; a plain number also as a ratio, "3:2", or "5 %".
/// @param dimension  What is expected. @param name  The thing's name, for the message.
/// @errors ArgumentError::wrong_unit (a unit of another dimension, an unknown one, or none where
///         one is needed), malformed (no number), not_finite. A turning where something is wanted
///         that goes straight on, and the other way round, is explained.
[[nodiscard]] Expected<double> parse_quantity(std::string_view text, Dimension dimension,
                                              std::string_view name);

template <class Q>
[[nodiscard]] Expected<Q> parse_quantity(std::string_view text, std::string_view name) {
  return parse_quantity(text, Q::dimension, name).map([](double si) { return Q(si); });
}

/// "8 kg": the SI value and unit, shortest digits that read back to the same number.
[[nodiscard]] std::string to_text(double si, Dimension dimension);

template <Dimension D>
[[nodiscard]] std::string to_text(Quantity<D> quantity) {
  return to_text(quantity.si(), D);
}

namespace literals {

// clang-format off
#define FLYBALL_LITERAL(suffix, Type, factor)                                              \
  constexpr Type operator""_##suffix(long double v) { return Type(static_cast<double>(v) * (factor)); } \
  constexpr Type operator""_##suffix(unsigned long long v) { return Type(static_cast<double>(v) * (factor)); }

FLYBALL_LITERAL(kg, Mass, 1.0)
FLYBALL_LITERAL(g, Mass, 1e-3)
FLYBALL_LITERAL(lb, Mass, 0.45359237)
FLYBALL_LITERAL(m, Length, 1.0)
FLYBALL_LITERAL(cm, Length, 1e-2)
FLYBALL_LITERAL(mm, Length, 1e-3)
FLYBALL_LITERAL(in, Length, 0.0254)
FLYBALL_LITERAL(ft, Length, 0.3048)
FLYBALL_LITERAL(s, Time, 1.0)
FLYBALL_LITERAL(ms, Time, 1e-3)
FLYBALL_LITERAL(us, Time, 1e-6)
FLYBALL_LITERAL(rad, Angle, 1.0)
FLYBALL_LITERAL(deg, Angle, 0.017453292519943295)
FLYBALL_LITERAL(rot, Angle, 6.283185307179586)
FLYBALL_LITERAL(mps, Velocity, 1.0)
FLYBALL_LITERAL(rad_per_s, AngularVelocity, 1.0)
FLYBALL_LITERAL(rpm, AngularVelocity, 0.10471975511965977)
FLYBALL_LITERAL(mps2, Acceleration, 1.0)
FLYBALL_LITERAL(N, Force, 1.0)
FLYBALL_LITERAL(Nm, Torque, 1.0)
FLYBALL_LITERAL(kg_m2, MomentOfInertia, 1.0)
FLYBALL_LITERAL(V, Voltage, 1.0)
FLYBALL_LITERAL(A, Current, 1.0)
FLYBALL_LITERAL(mA, Current, 1e-3)
FLYBALL_LITERAL(Ohm, Resistance, 1.0)
FLYBALL_LITERAL(mOhm, Resistance, 1e-3)
FLYBALL_LITERAL(Hz, Frequency, 1.0)

#undef FLYBALL_LITERAL
// clang-format on

}  // namespace literals

}  // namespace flyball
