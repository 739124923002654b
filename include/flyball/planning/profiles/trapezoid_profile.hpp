#pragma once

#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// The fastest motion between two states under limits of velocity and acceleration: accelerate,
/// cruise, brake. Any velocities at the ends, other limits up than down.
///
/// A start above the velocity limit is braked down to it at the acceleration limit; a goal velocity
/// above it is cut to it. Run-time object: noexcept, allocation-free, and finite for whatever it is
/// given: limits below 1e-100, accelerations above 1e100, states that are not finite or beyond
/// `largest_signal` (all together), or a motion of more than 1e300 s, give a profile that is at the
/// goal from the start. A velocity limit may be infinite.
/// The jerk limit has no part in it. Planning and one sample take some ten nanoseconds, so that it
/// may be planned anew each period. Source: book, section 15.1.3.
class TrapezoidProfile {
 public:
  /// @param start  Where it is (its acceleration is ignored). @param goal  Where it is to be.
  TrapezoidProfile(const MotionLimits& limits, const MotionState& start,
                   const MotionState& goal) noexcept;

  /// The fastest change to a velocity, wherever it ends (`goal`): straight at the limit of its
  /// direction. A velocity beyond the limits is cut to them.
  [[nodiscard]] static TrapezoidProfile to_velocity(const MotionLimits& limits,
                                                    const MotionState& start,
                                                    double velocity) noexcept;
  /// Where it ends, and how fast.
  [[nodiscard]] const MotionState& goal() const noexcept { return goal_; }

  /// How long it takes, s.
  [[nodiscard]] double total_time() const noexcept { return time_[2]; }
  /// What is left of it t s after the start; all of it before.
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return t > 0.0 ? (t < time_[2] ? time_[2] - t : 0.0) : time_[2];
  }
  /// The velocity of the cruise, signed.
  [[nodiscard]] double cruise_velocity() const noexcept { return cruise_; }
  /// Ends of the acceleration, the cruise and the braking, s since the start.
  [[nodiscard]] const double (&phase_ends() const noexcept)[3] { return time_; }
  [[nodiscard]] MotionLimits limits() const noexcept { return limits_.both_ways(); }
  /// Backwards the same accelerations go with opposite velocities.
  [[nodiscard]] bool reversible() const noexcept;
  [[nodiscard]] TrapezoidProfile replanned(const MotionState& state,
                                           const MotionState& goal) const noexcept {
    return {limits_, state, goal};
  }

  /// @param t  s since the start; before it the start, after the end the goal, moving on with its
  ///           velocity. The acceleration is that of the interval which begins at t.
  [[nodiscard]] MotionState sample(double t) const noexcept;

 private:
  MotionLimits limits_;
  MotionState start_;
  MotionState goal_;
  double cruise_ = 0.0;
  double first_acceleration_ = 0.0;
  double last_acceleration_ = 0.0;
  double time_[3] = {0.0, 0.0, 0.0};  ///< Ends of the three phases, s since the start.
};

inline bool TrapezoidProfile::reversible() const noexcept {
  const MotionLimits all = limits();
  const double low = __builtin_fmin(start_.velocity, __builtin_fmin(goal_.velocity, cruise_));
  const double high = __builtin_fmax(start_.velocity, __builtin_fmax(goal_.velocity, cruise_));
  return -low <= all.velocity && high <= all.reverse_velocity;
}

[[gnu::always_inline]] inline TrapezoidProfile::TrapezoidProfile(const MotionLimits& limits,
                                                                 const MotionState& start,
                                                                 const MotionState& goal) noexcept
    : limits_(limits),
      start_{start.position, start.velocity, 0.0},
      goal_{goal.position, goal.velocity, 0.0} {
  const double up = limits.acceleration;
  const double down = limits.deceleration == 0.0 ? up : limits.deceleration;
  const double v_high = limits.velocity;
  const double v_low = limits.reverse_velocity == 0.0 ? v_high : limits.reverse_velocity;
  // Within these nothing below overflows, nor does any place on the way. What is not a number makes
  // the sum none.
  constexpr double largest = 1e100;  // core/signal.hpp
  constexpr double least = 1e-100;
  const double places = __builtin_fabs(start.position) + __builtin_fabs(goal.position);
  const double sum =
      places + __builtin_fabs(start.velocity) + __builtin_fabs(goal.velocity) + (up + down);
  const double lowest = up < down ? up : down;
  if (!(sum <= largest && lowest >= least && v_high >= least && v_low >= least)) [[unlikely]] {
    goal_.position = __builtin_isfinite(goal.position) ? goal.position : 0.0;
    goal_.velocity = 0.0;
    start_ = goal_;
    return;
  }
  const double at_most = goal.velocity < v_high ? goal.velocity : v_high;
  const double end = at_most > -v_low ? at_most : -v_low;
  goal_.velocity = end;

  // Going straight from one velocity to the other covers |v_g - v_0| (v_g + v_0)/2s with the
  // acceleration s of that sign. What lies beyond it needs acceleration first, what falls short of
  // it braking first: the same motion mirrored.
  const double distance = goal.position - start.position;
  const double change = end - start.velocity;
  const double s = up == down || change >= 0.0 ? up : down;
  const double beyond = 2.0 * s * distance - __builtin_fabs(change) * (end + start.velocity);
  const bool forward = beyond >= 0.0;
  const double sign = forward ? 1.0 : -1.0;
  const double a = forward ? up : down;
  const double b = forward ? down : up;
  const double v_max = forward ? v_high : v_low;
  const double v_0 = sign * start.velocity;
  const double v_g = sign * end;

  // The peak c of a motion without cruise, (c² - v_0²)/2a + (c² - v_g²)/2b = d, from the larger of
  // the ends' velocities up, where one of the terms is the straight change and the other what lies
  // beyond it. Divisions cost most: with equal limits one is enough, and none of them waits for
  // the states.
  const double larger = v_0 > v_g ? v_0 : v_g;
  // Of what is straight only rounding is left (of states that were sampled on the way, too). Its
  // root must not become a phase, nor a goal that moves be missed by it.
  const double speeds = __builtin_fabs(start.velocity) + __builtin_fabs(end);
  double rounding = 4e-15 * s * places + 1e-15 * speeds * speeds;
  const double per_a = 1.0 / a;
  double per_b = per_a;
  double per_both = per_a;
  double share = 0.5;
  if (a != b) {
    per_b = 1.0 / b;
    per_both = 0.5 * (per_a + per_b);
    share = (s == a ? b : a) / (a + b);
    // In the peak's square.
    const double lost = 1e-15 * larger * larger * (a + b) * (s == a ? per_b : per_a);
    rounding = rounding > lost ? rounding : lost;
  }
  const double more = share * __builtin_fabs(beyond);
  const double excess = (larger - v_max) * (larger + v_max) + more;  // of the peak's square
  double c = v_max;
  double t_2 = 0.0;
  if (excess < 0.0) {
    c = __builtin_sqrt(larger * larger + more);
    c = c > larger ? c : larger;  // also where its square is no number
  } else {
    t_2 = excess * per_both / v_max;
  }
  first_acceleration_ = sign * a;
  last_acceleration_ = -sign * b;
  double t_1 = (c - v_0) * per_a;
  if (__builtin_fabs(beyond) <= rounding || v_0 > v_max) [[unlikely]] {
    c = larger < v_max ? larger : v_max;
    t_1 = (c - v_0) * per_a;
    if (v_0 > v_max) {
      t_1 = (v_0 - c) * per_b;
      first_acceleration_ = last_acceleration_;
    }
    // What is more than rounding of places is cruised.
    const double slack =
        sign * distance - 0.5 * ((v_0 + c) * t_1 + (c + v_g) * ((c - v_g) * per_b));
    t_2 = c > 0.0 && slack > 2e-15 * places ? slack / c : 0.0;
  }
  cruise_ = sign * c;
  time_[0] = t_1;
  time_[1] = t_1 + t_2;
  time_[2] = t_1 + t_2 + (c - v_g) * per_b;
  if (!(time_[2] <= 1e300)) [[unlikely]] {
    goal_.velocity = 0.0;
    start_ = goal_;
    time_[0] = time_[1] = time_[2] = cruise_ = 0.0;
  }
}

inline TrapezoidProfile TrapezoidProfile::to_velocity(const MotionLimits& limits,
                                                      const MotionState& start,
                                                      double velocity) noexcept {
  // What cannot be planned from place to place cannot be here: it stands.
  TrapezoidProfile profile(limits, start, {start.position, velocity});
  const double end = profile.goal_.velocity;
  const double change = end - start.velocity;
  if (profile.start_.velocity != start.velocity || change == 0.0) {
    profile =
        TrapezoidProfile(limits, {profile.goal_.position, end}, {profile.goal_.position, end});
    return profile;
  }
  const MotionLimits all = limits.both_ways();
  const double a = change > 0.0 ? all.acceleration : -all.deceleration;
  const double t = change / a;
  profile.first_acceleration_ = profile.last_acceleration_ = a;
  profile.cruise_ = end;
  profile.time_[0] = profile.time_[1] = profile.time_[2] = t;
  profile.goal_.position = start.position + 0.5 * (start.velocity + end) * t;
  return profile;
}

[[gnu::always_inline]] inline MotionState TrapezoidProfile::sample(double t) const noexcept {
  if (!(t > 0.0)) {
    const double first = time_[0] > 0.0        ? first_acceleration_
                         : time_[1] > 0.0      ? 0.0
                         : time_[2] > time_[1] ? last_acceleration_
                                               : 0.0;
    return {start_.position, start_.velocity, t == 0.0 ? first : 0.0};
  }
  if (t < time_[0]) {
    return {start_.position + (start_.velocity + 0.5 * first_acceleration_ * t) * t,
            start_.velocity + first_acceleration_ * t, first_acceleration_};
  }
  if (t < time_[1]) {
    const double t_1 = time_[0];
    const double x_1 = start_.position + (start_.velocity + 0.5 * first_acceleration_ * t_1) * t_1;
    return {x_1 + cruise_ * (t - t_1), cruise_, 0.0};
  }
  if (t < time_[2]) {
    // Backwards from the goal, so that the end is met exactly.
    const double left = time_[2] - t;
    return {goal_.position - (goal_.velocity - 0.5 * last_acceleration_ * left) * left,
            goal_.velocity - last_acceleration_ * left, last_acceleration_};
  }
  const double past = __builtin_isfinite(t) ? t - time_[2] : 0.0;
  const double position = goal_.position + goal_.velocity * past;
  return {__builtin_isfinite(position) ? position : goal_.position, goal_.velocity, 0.0};
}

static_assert(MotionProfile<TrapezoidProfile>);

}  // namespace flyball
