#pragma once

namespace flyball {

/// Position, velocity and acceleration of one degree of freedom, in m or rad and s.
struct MotionState {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// What a motion must not exceed; both > 0.
struct MotionLimits {
  double velocity = 0.0;      ///< m/s or rad/s
  double acceleration = 0.0;  ///< m/s² or rad/s²
};

/// The fastest motion between two states under limits of velocity and acceleration: accelerate,
/// cruise, brake.
///
/// A start (or goal) above the velocity limit is braked down (or accelerated up) to, at the
/// acceleration limit; everything between keeps both limits. Run-time object: noexcept,
/// allocation-free, and finite for whatever it is given: a limit that is not positive and finite,
/// or a state that is not finite or beyond `largest_signal`, gives a profile that is at the goal
/// from the start. Source: book, section 15.1.3.
class TrapezoidProfile {
 public:
  /// @param start  Where it is (its acceleration is ignored). @param goal  Where it is to be.
  TrapezoidProfile(const MotionLimits& limits, const MotionState& start,
                   const MotionState& goal) noexcept;

  /// How long it takes, s.
  [[nodiscard]] double total_time() const noexcept { return time_[2]; }
  /// The velocity of the cruise, signed.
  [[nodiscard]] double cruise_velocity() const noexcept { return cruise_; }

  /// @param t  s since the start; before it the start, after the end the goal, moving on with its
  ///           velocity. The acceleration is that of the interval which begins at t.
  [[nodiscard]] MotionState sample(double t) const noexcept;

 private:
  MotionState start_;
  MotionState goal_;
  double cruise_ = 0.0;
  double first_acceleration_ = 0.0;
  double last_acceleration_ = 0.0;
  double time_[3] = {0.0, 0.0, 0.0};  ///< Ends of the three phases, s since the start.
};

}  // namespace flyball
