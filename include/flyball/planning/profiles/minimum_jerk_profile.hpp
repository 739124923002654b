#pragma once

#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// The smoothest motion between two states: of all that take its time the one with the least
/// integral of the squared jerk, a polynomial of fifth degree. Its duration is the shortest at
/// which it keeps the limits of velocity, acceleration and jerk (within a billionth), from 1.875
/// d/T, 5.77 d/T² and 60 d/T³ at rest.
///
/// Where no duration keeps them (a start outside of the limits), the one that breaks them least of
/// those tried is taken and `keeps_limits()` is false. Run-time object: noexcept, allocation-free,
/// bounded (at most 260 durations are looked at; four on average, and 64 where none keeps the
/// limits, each in under a microsecond), finite: unusable numbers give a profile that is at the
/// goal from the start. Source: T. Flash, N. Hogan, The coordination of arm movements, J.
/// Neuroscience 5 (1985), (6).
class MinimumJerkProfile {
 public:
  MinimumJerkProfile(const MotionLimits& limits, const MotionState& start,
                     const MotionState& goal) noexcept;
  /// Of a given duration, whatever it needs; 0 or less: at the goal at once.
  [[nodiscard]] static MinimumJerkProfile with_duration(double duration, const MotionState& start,
                                                        const MotionState& goal) noexcept;

  [[nodiscard]] double total_time() const noexcept { return end_; }
  /// s, from t to the end.
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return t > 0.0 ? (t < end_ ? end_ - t : 0.0) : end_;
  }
  /// @param t  s; before the start the start, after the end the goal, moving on with its velocity.
  [[nodiscard]] MotionState sample(double t) const noexcept;
  /// Its jerk, m/s³ or rad/s³. @param t  s.
  [[nodiscard]] double jerk(double t) const noexcept;
  [[nodiscard]] MotionLimits limits() const noexcept { return limits_.both_ways(); }
  [[nodiscard]] bool keeps_limits() const noexcept { return keeps_limits_; }
  [[nodiscard]] bool reversible() const noexcept;
  /// The motion from another state on, within the same limits.
  [[nodiscard]] MinimumJerkProfile replanned(const MotionState& state,
                                             const MotionState& goal) const noexcept {
    return {limits_, state, goal};
  }

 private:
  MinimumJerkProfile() = default;
  void set(double duration, const MotionState& start, const MotionState& goal) noexcept;

  MotionLimits limits_{};
  MotionState goal_{};
  double end_ = 0.0;
  double c_[6] = {};  ///< x = Σ c_k t^k.
  bool keeps_limits_ = true;
};

static_assert(MotionProfile<MinimumJerkProfile>);

}  // namespace flyball
