#pragma once

#include <array>
#include <span>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/motor.hpp>

/// Moments of inertia by the book's regressions of a recorded step.
namespace flyball::identification {

/// A moment of inertia as a regression tells it.
struct InertiaEstimate {
  MomentOfInertia value{};
  double standard_error = 0.0;               ///< kg m²
  std::array<double, 2> interval{0.0, 0.0};  ///< 95 %, kg m².
  double r_squared = 0.0;
};

/// J of a flywheel, or of an arm that turns about a vertical axis, from a step of constant voltage:
/// the slope of ω over dω/dt is -J K_v R/(G² K_t). Accelerations are differences of neighbours, at
/// their mean velocity.
/// @param motor  All of its motors. @param gearing  G, motor turns per output turn.
/// @param time  s, ascending. @param velocity  rad/s, as many.
/// @errors ArgumentError::wrong_shape, empty (fewer than three), not_finite, not_positive;
///         IdentificationError::unphysical_gains where the speed does not approach an end.
/// Source: book, sections 12.3.2 and 12.4.2, (12.19) and (12.25).
[[nodiscard]] Expected<InertiaEstimate> inertia_from_step(const mechanisms::DcMotor& motor,
                                                          double gearing,
                                                          std::span<const double> time,
                                                          std::span<const double> velocity);

/// J of a robot about its vertical axis, from its speed while it drives straight on and its angular
/// velocity while it turns on the spot, both under the same voltage, at the same times after the
/// step: the slope of v over ω is J/(m r_b). It holds while the motors' back EMF is small beside
/// the voltage; of a whole log `mechanisms::moment_of_inertia` of the identified gains is better.
/// @param mass  m. @param trackwidth  2 r_b. @param speed  m/s. @param angular_velocity  rad/s.
/// @errors As above; unphysical_gains for a slope that is not positive.
/// Source: book, section 12.6.2, (12.37), with r_b where the print has the wheels' radius.
[[nodiscard]] Expected<InertiaEstimate> drive_inertia_from_steps(
    Mass mass, Length trackwidth, std::span<const double> speed,
    std::span<const double> angular_velocity);

/// J = m l²/3 of a thin rod about its end. Source: book, (12.24).
[[nodiscard]] MomentOfInertia rod_moment_of_inertia(Mass mass, Length length);

}  // namespace flyball::identification
