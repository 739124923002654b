#pragma once

#include <cmath>
#include <type_traits>

#include <flyball/mechanisms/mechanism_kind.hpp>

namespace flyball::mechanisms {

/// g, standard gravity, m/s². The book's figures use 9.81.
inline constexpr double standard_gravity = 9.80665;

/// What holds a mechanism against gravity, V, over generic scalars: 0 without gravity, kG for an
/// elevator, kG cos(position + angle_offset) for an arm.
/// @param kG  V; an arm's when it is level. @param position  m or rad. @param angle_offset  rad,
/// true angle from horizontal less the measured one.
/// Source: book, sections 6.9.3 and 6.11.3.
template <class Gain, class Position, class Offset>
[[nodiscard]] std::common_type_t<Gain, Position, Offset> gravity_voltage(
    MechanismKind kind, const Gain& kG, const Position& position, const Offset& angle_offset) {
  using std::cos;
  using Scalar = std::common_type_t<Gain, Position, Offset>;
  if (kind == MechanismKind::arm) {
    return kG * cos(Scalar(position + angle_offset));
  }
  return kind == MechanismKind::elevator ? Scalar(kG) : Scalar(0.0);
}

}  // namespace flyball::mechanisms
