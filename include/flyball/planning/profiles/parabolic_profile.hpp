#pragma once

#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

namespace flyball {

/// A motion whose velocity is a parabola of time: the acceleration is the limit at rest, falls
/// linearly in time and is zero at the velocity limit, a = a_max √(1 - |v|/v_max), as the torque of
/// a step motor does. It brakes as it accelerated. Any velocities at the ends; accelerations jump.
///
/// A start above the velocity limit is braked at the acceleration limit first, a goal velocity
/// above it is cut. The limits are `velocity` and `acceleration`, of both directions. Run-time
/// object as TrapezoidProfile. Source: book, section 15.1.4.
class ParabolicProfile : public JerkMotion {
 public:
  /// A motion from one state to another.
  ParabolicProfile(const MotionLimits& limits, const MotionState& start,
                   const MotionState& goal) noexcept;

  /// The fastest change to a velocity, wherever it ends (`goal`). A velocity beyond the limit is
  /// cut to it.
  [[nodiscard]] static ParabolicProfile to_velocity(const MotionLimits& limits,
                                                    const MotionState& start,
                                                    double velocity) noexcept;

  [[nodiscard]] MotionLimits limits() const noexcept { return limits_; }
  [[nodiscard]] bool reversible() const noexcept { return true; }
  /// The motion from another state on, within the same limits.
  [[nodiscard]] ParabolicProfile replanned(const MotionState& state,
                                           const MotionState& goal) const noexcept {
    return {limits_, state, goal};
  }

 private:
  void add_ramp(double from, double to) noexcept;
  /// Brakes a start above the velocity limit down to it. @return  The velocity then.
  double come_within(double velocity) noexcept;

  MotionLimits limits_;
};

static_assert(MotionProfile<ParabolicProfile>);

/// A trapezoid that jumps to a velocity when it starts and from it when it ends, over the speeds at
/// which a step motor's own resonance would take its torque (mid-range instability). Ends that move
/// faster keep their velocity; slower ones jump to the side with which the whole is fastest: of a
/// start that passes its goal before it has braked, backwards at the end. Run-time object as
/// TrapezoidProfile. Source: book, section 15.1.4.
class StepperProfile {
 public:
  /// @param jump  Velocity, >= 0; at most the velocity limit is taken.
  StepperProfile(const MotionLimits& limits, double jump, const MotionState& start,
                 const MotionState& goal) noexcept;
  /// The fastest change to a velocity, wherever it ends: over what is slower than the jump at once.
  [[nodiscard]] static StepperProfile to_velocity(const MotionLimits& limits, double jump,
                                                  const MotionState& start,
                                                  double velocity) noexcept;
  /// Where it ends, and how fast.
  [[nodiscard]] const MotionState& goal() const noexcept { return goal_; }
  /// Its motion between the jumps.
  [[nodiscard]] const TrapezoidProfile& between() const noexcept { return profile_; }

  [[nodiscard]] double total_time() const noexcept { return profile_.total_time(); }
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return profile_.remaining_time(t);
  }
  /// Before the start and after the end it stands, or moves as the start and the goal do.
  [[nodiscard]] MotionState sample(double t) const noexcept;
  [[nodiscard]] MotionLimits limits() const noexcept { return profile_.limits(); }
  [[nodiscard]] double jump() const noexcept { return jump_; }
  /// Ends of the acceleration, the cruise and the braking, s since the start.
  [[nodiscard]] const double (&phase_ends() const noexcept)[3] { return profile_.phase_ends(); }
  [[nodiscard]] bool reversible() const noexcept { return profile_.reversible(); }
  /// The motion from another state on, within the same limits.
  [[nodiscard]] StepperProfile replanned(const MotionState& state,
                                         const MotionState& goal) const noexcept {
    return {profile_.limits(), jump_, state, goal};
  }

 private:
  double jump_ = 0.0;
  MotionState start_;
  MotionState goal_;
  TrapezoidProfile profile_;
};

static_assert(MotionProfile<StepperProfile>);

}  // namespace flyball
