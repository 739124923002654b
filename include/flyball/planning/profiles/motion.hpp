#pragma once

#include <concepts>
#include <limits>

namespace flyball {

/// Position, velocity and acceleration of one degree of freedom, in m or rad and s.
struct MotionState {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
};

/// What a motion must not exceed, each as a size > 0. Limits belong to a direction, not to the
/// start or the end of a motion: an elevator that gravity helps down has another `deceleration`
/// than `acceleration`, whichever way it goes.
struct MotionLimits {
  double velocity = 0.0;      ///< m/s or rad/s
  double acceleration = 0.0;  ///< m/s² or rad/s²
  /// Of accelerations below zero; 0: as `acceleration`.
  double deceleration = 0.0;
  /// Of velocities below zero; 0: as `velocity`.
  double reverse_velocity = 0.0;
  /// m/s³ or rad/s³, of both directions.
  double jerk = std::numeric_limits<double>::infinity();

  /// The limits with what is 0 for "as the other" written out.
  [[nodiscard]] constexpr MotionLimits both_ways() const noexcept {
    return {velocity, acceleration, deceleration == 0.0 ? acceleration : deceleration,
            reverse_velocity == 0.0 ? velocity : reverse_velocity, jerk};
  }
  /// The limits of the mirrored motion.
  [[nodiscard]] constexpr MotionLimits mirrored() const noexcept {
    const MotionLimits all = both_ways();
    return {all.reverse_velocity, all.deceleration, all.acceleration, all.velocity, jerk};
  }
  /// These limits for a motion over a signed distance, if `acceleration` is how hard it may speed
  /// up and `deceleration` how hard it may brake, whichever way it goes.
  [[nodiscard]] constexpr MotionLimits along(double distance) const noexcept {
    const MotionLimits all = both_ways();
    return distance < 0.0 ? MotionLimits{all.velocity, all.deceleration, all.acceleration,
                                         all.reverse_velocity, jerk}
                          : all;
  }
  bool operator==(const MotionLimits&) const = default;
};

/// A motion of one degree of freedom in time: what every profile here can tell. All of it is
/// noexcept, allocation-free, bounded in time and finite.
///
/// - `sample(t)`: the state t seconds after the start; before it the start, after the end the goal,
///   moving on with its velocity.
/// - `total_time()`, `remaining_time(t)`: s.
/// - `limits()`: what it keeps; what a kind of profile does not limit is infinite.
/// - `reversible()`: whether the same way from the goal back to the start (`ReversedMotion`) keeps
///   the limits too.
/// - `replanned(state, goal)`: the profile of its kind and limits from another state, such as the
///   one that it is in, to another goal. Asked each period with the state that it gave it stays on
///   its way; but on the last arc of an S-curve to a goal of no velocity and some acceleration,
///   which a state that is rounded the wrong way reaches by another turn alone.
template <class P>
concept MotionProfile =
    std::copyable<P> && requires(const P profile, double t, const MotionState& state) {
      { profile.sample(t) } noexcept -> std::same_as<MotionState>;
      { profile.total_time() } noexcept -> std::same_as<double>;
      { profile.remaining_time(t) } noexcept -> std::same_as<double>;
      { profile.limits() } noexcept -> std::convertible_to<MotionLimits>;
      { profile.reversible() } noexcept -> std::same_as<bool>;
      { profile.replanned(state, state) } noexcept -> std::same_as<P>;
    };

/// A motion backwards in time: from the goal to the start over the same places. Velocities change
/// their sign, accelerations do not.
template <MotionProfile Profile>
class ReversedMotion {
 public:
  /// @param motion  What is to be gone back.
  explicit ReversedMotion(const Profile& motion) noexcept : motion_(motion) {}

  [[nodiscard]] double total_time() const noexcept { return motion_.total_time(); }
  [[nodiscard]] double remaining_time(double t) const noexcept { return motion_.remaining_time(t); }
  [[nodiscard]] MotionState sample(double t) const noexcept {
    const double end = total_time();
    const MotionState there = motion_.sample(t > 0.0 ? (t < end ? end - t : 0.0) : end);
    return {there.position, -there.velocity, there.acceleration};
  }

 private:
  Profile motion_;
};

/// Where to go on a circle: the place nearest to `from` that is a whole number of turns from
/// `goal`. A profile to it goes the short way and its angle never jumps.
/// @param period  The size of a turn: 2π rad unless told otherwise; > 0, else `goal` is returned.
[[nodiscard]] inline double nearest_turn(double goal, double from,
                                         double period = 6.283185307179586476925287) noexcept {
  if (!(period > 0.0)) {
    return goal;
  }
  const double turns = __builtin_rint((from - goal) / period);
  const double there = goal + turns * period;
  return __builtin_isfinite(there) ? there : goal;
}

}  // namespace flyball
