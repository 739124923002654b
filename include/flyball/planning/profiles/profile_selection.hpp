#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// The kinds of profiles.
enum class ProfileKind { trapezoid, s_curve, exponential, parabolic, stepper, minimum_jerk };

/// "trapezoid", "s-curve", "exponential", "parabolic", "stepper", "minimum-jerk".
[[nodiscard]] const char* to_string(ProfileKind kind) noexcept;
/// @errors ArgumentError::unknown_name, with the nearest.
[[nodiscard]] Expected<ProfileKind> parse_profile_kind(std::string_view name);

/// What turns the mechanism.
enum class ActuatorKind {
  dc_motor,    ///< Brushed or brushless, driven by a voltage.
  step_motor,  ///< Its torque falls with its speed, and may have a hole at its resonance.
};

/// What a profile is asked to do.
struct ProfileNeeds {
  MotionLimits limits{};   ///< Velocity and acceleration.
  double distance = 0.0;   ///< Of a typical move from rest to rest; its sign does not matter.
  std::string unit = "m";  ///< Of the distance, for the reasons: "m", "rad".
  ActuatorKind actuator = ActuatorKind::dc_motor;
  /// Constants of the motor, if they are known.
  std::optional<MotorMotionLimits> motor{};
  /// The lowest mode that the move shakes (a long arm, a swinging load), Hz; none: it is stiff.
  std::optional<double> resonance{};
  /// Of that mode.
  double damping_ratio = 0.0;
  /// Seconds after which an oscillation that is left would have to be gone; what is gone sooner
  /// does no harm.
  double patience = 0.1;
  /// What is carried must not be jostled: liquid, an open stack.
  bool delicate = false;
  /// Velocity at which a step motor resonates (mid-range instability), if it does.
  std::optional<double> resonant_velocity{};
};

/// Which profile, and why.
struct ProfileAdvice {
  ProfileKind kind = ProfileKind::trapezoid;
  MotionLimits limits{};               ///< With the jerk that is advised.
  double ramp_time = 0.0;              ///< s, from no to full acceleration; 0 without a jerk limit.
  double jump = 0.0;                   ///< Starting velocity of a stepper profile.
  double duration = 0.0;               ///< s, of the typical move.
  double trapezoid_duration = 0.0;     ///< s, of the trapezoid with the same limits.
  std::vector<std::string> reasons{};  ///< Sentences, the one that decided it first.
};

/// Selects a profile by what the book's sections 15.1.2 and 15.1.4 weigh, with numbers where they
/// leave it at words:
///
/// - a step motor: the parabola, whose acceleration is least where it is fast, or a jump over the
///   speeds at which it resonates; if the load oscillates an S-curve within its torque at speed;
/// - delicate cargo: an S-curve without constant acceleration, its ramps as long as they can be;
/// - a resonance that rings for longer than the patience: an S-curve whose ramps last one period of
///   the mode, which leave (without damping) nothing of it, as a moving average of that length is
///   blind to it; not shorter than five percent of the constant acceleration, the least of the
///   book's;
/// - a motor whose constants are known and which has not the acceleration up to the velocity limit:
///   its exponential profile;
/// - otherwise the trapezoid: first-order motors follow jumps of acceleration by a feedforward.
///
/// @errors ArgumentError::not_positive, not_finite, out_of_range (damping ratio not in 0..1).
/// Source: book, sections 15.1.2, 15.1.4; N. Singer, W. Seering, Preshaping command inputs to
/// reduce system vibration, J. Dyn. Syst. Meas. Control 112 (1990), for the zeros of a moving
/// average.
[[nodiscard]] Expected<ProfileAdvice> select_profile(const ProfileNeeds& needs);

}  // namespace flyball
