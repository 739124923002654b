#include <flyball/planning/profiles/parabolic_profile.hpp>

#include <algorithm>
#include <cmath>

#include "planning/profiles/s_curve_problem.hpp"

namespace flyball {

namespace {

/// The parabola v = V (1 - s²/T²) with T = 2 V/A, by the time s that is left to the top.
struct Parabola {
  double V = 0.0;
  double T = 0.0;

  [[nodiscard]] double left(double v) const { return T * std::sqrt(std::max(0.0, (V - v) / V)); }
  [[nodiscard]] double velocity(double s) const { return V * (1.0 - s * s / (T * T)); }
  /// The way from s to t, 0 <= t <= s.
  [[nodiscard]] double way(double s, double t) const {
    return V * (s - t) * (1.0 - (s * s + s * t + t * t) / (3.0 * T * T));
  }
};

/// The way from one velocity to another: over zero, where the parabola is mirrored.
double change(const Parabola& p, double from, double to) {
  if (from * to < 0.0) {
    return change(p, from, 0.0) + change(p, 0.0, to);
  }
  const double sign = from + to < 0.0 ? -1.0 : 1.0;
  const double a = p.left(std::abs(from));
  const double b = p.left(std::abs(to));
  return sign * p.way(std::max(a, b), std::min(a, b));
}

}  // namespace

void ParabolicProfile::add_ramp(double from, double to) noexcept {
  if (from * to < 0.0) {
    add_ramp(from, 0.0);
    add_ramp(0.0, to);
    return;
  }
  const Parabola p{limits_.velocity, 2.0 * limits_.velocity / limits_.acceleration};
  const double jerk = limits_.acceleration / p.T;
  const double sign = from + to < 0.0 ? -1.0 : 1.0;
  const double a = p.left(std::abs(from));
  const double b = p.left(std::abs(to));
  // Faster: the acceleration falls. Slower: the same backwards.
  goal_.velocity = from;
  goal_.acceleration = sign * jerk * (a > b ? a : -a);
  add(std::abs(a - b), -sign * jerk);
  goal_.velocity = to;
}

double ParabolicProfile::come_within(double velocity) noexcept {
  const double V = limits_.velocity;
  if (!(std::abs(velocity) > V)) {
    return velocity;
  }
  goal_.acceleration = velocity > 0.0 ? -limits_.acceleration : limits_.acceleration;
  const double end = std::copysign(V, velocity);
  add((end - velocity) / goal_.acceleration, 0.0);
  return end;
}

ParabolicProfile ParabolicProfile::to_velocity(const MotionLimits& limits, const MotionState& start,
                                               double velocity) noexcept {
  const MotionState still{start.position, 0.0, 0.0};
  ParabolicProfile profile(limits, still, still);
  const MotionLimits& all = profile.limits_;
  if (!detail::is_usable(all, start, {start.position, velocity, 0.0}) ||
      all.velocity > detail::largest_motion || all.acceleration > detail::largest_motion) {
    return profile;
  }
  profile.begin({start.position, start.velocity, 0.0});
  const double end = std::clamp(velocity, -all.velocity, all.velocity);
  const double from = profile.come_within(start.velocity);
  profile.add_ramp(from, end);
  profile.finish({profile.goal_.position, end, 0.0});
  return profile;
}

ParabolicProfile::ParabolicProfile(const MotionLimits& limits, const MotionState& start,
                                   const MotionState& goal) noexcept
    : limits_{limits.velocity, limits.acceleration, limits.acceleration, limits.velocity} {
  const double V = limits_.velocity;
  const double A = limits_.acceleration;
  if (!detail::is_usable(limits_, start, goal) || V > detail::largest_motion ||
      A > detail::largest_motion) {
    begin({std::isfinite(goal.position) ? goal.position : 0.0, 0.0, 0.0});
    return;
  }
  begin({start.position, start.velocity, 0.0});
  const Parabola p{V, 2.0 * V / A};
  const double v_0 = come_within(start.velocity);
  const MotionState end{goal.position, std::clamp(goal.velocity, -V, V), 0.0};
  const double d = end.position - goal_.position;
  const double straight = change(p, v_0, end.velocity);
  const double rounding = 4e-15 * (std::abs(end.position) + std::abs(goal_.position)) +
                          1e-14 * V * p.T * (v_0 != 0.0 || end.velocity != 0.0 ? 1.0 : 0.0);
  if (std::abs(d - straight) <= rounding) {
    add_ramp(v_0, end.velocity);
    finish(end);
    return;
  }
  const double sign = d > straight ? 1.0 : -1.0;
  // Up to a peak and down: by s at the peak, the way falls as s grows, down to zero speed.
  double high = std::min(
      {p.T, p.left(std::max(0.0, sign * v_0)), p.left(std::max(0.0, sign * end.velocity))});
  double low = 0.0;
  const auto way = [&](double s) {
    const double peak = sign * p.velocity(s);
    return sign * (change(p, v_0, peak) + change(p, peak, end.velocity));
  };
  const double at_top = way(0.0);
  if (sign * d >= at_top) {
    add_ramp(v_0, sign * V);
    goal_.acceleration = 0.0;
    add((sign * d - at_top) / V, 0.0);
    add_ramp(sign * V, end.velocity);
    finish(end);
    return;
  }
  double s = 0.5 * high;
  constexpr int max_iterations = 100;
  for (int i = 0; i < max_iterations; ++i) {
    const double miss = way(s) - sign * d;
    (miss > 0.0 ? low : high) = s;
    const double slope = -2.0 * p.velocity(s);  // of the way by s
    double next = slope < 0.0 ? s - miss / slope : low;
    if (!(next > low && next < high)) {
      next = 0.5 * (low + high);
    }
    if (std::abs(next - s) <= 1e-16 * p.T || !(low < high)) {
      break;
    }
    s = next;
  }
  const double peak = sign * p.velocity(s);
  add_ramp(v_0, peak);
  add_ramp(peak, end.velocity);
  finish(end);
}

namespace {

/// The velocities that an end may have after a jump: both sides, or its own if it is faster.
struct JumpedEnd {
  double velocities[2];
  int count;
};

JumpedEnd jumped(double velocity, double jump, double direction) {
  if (!(std::abs(velocity) < jump)) {
    return {{velocity, velocity}, 1};
  }
  const double first = std::copysign(jump, direction);
  return {{first, -first}, 2};
}

/// The fastest of the trapezoids between ends that jump.
TrapezoidProfile fastest_jumps(const MotionLimits& limits, double jump, const MotionState& start,
                               const MotionState& goal) {
  const double d = goal.position - start.position;
  const JumpedEnd from = jumped(start.velocity, jump, d);
  const JumpedEnd to = jumped(goal.velocity, jump, d);
  TrapezoidProfile best(limits, {start.position, from.velocities[0]},
                        {goal.position, to.velocities[0]});
  if (d == 0.0 && from.count == 2 && to.count == 2) {
    return {limits, goal, goal};  // nowhere to go is no jump
  }
  for (int i = 0; i < from.count; ++i) {
    for (int k = 0; k < to.count; ++k) {
      const TrapezoidProfile other(limits, {start.position, from.velocities[i]},
                                   {goal.position, to.velocities[k]});
      // One that cannot be, of more than 1e300 s or of a way that drowns in the rounding of its
      // velocities' squares, is at the goal at once.
      const bool stands = other.total_time() == 0.0 && (d != 0.0 || other.goal().velocity == 0.0);
      if (!stands && other.total_time() < best.total_time()) {
        best = other;
      }
    }
  }
  return best;
}

double usable_jump(const MotionLimits& limits, double jump) {
  const MotionLimits all = limits.both_ways();
  return jump > 0.0 ? std::min({jump, all.velocity, all.reverse_velocity}) : 0.0;
}

}  // namespace

StepperProfile::StepperProfile(const MotionLimits& limits, double jump, const MotionState& start,
                               const MotionState& goal) noexcept
    : jump_(usable_jump(limits, jump)),
      start_{start.position, start.velocity, 0.0},
      goal_(goal),
      profile_(fastest_jumps(limits, jump_, start, goal)) {
  goal_ = profile_.sample(profile_.total_time());
  if (std::abs(goal.velocity) < jump_) {
    goal_.velocity = goal.velocity;
  }
}

StepperProfile StepperProfile::to_velocity(const MotionLimits& limits, double jump,
                                           const MotionState& start, double velocity) noexcept {
  const MotionState still{start.position, 0.0, 0.0};
  StepperProfile profile(limits, jump, still, still);
  const double least = profile.jump_;
  profile.start_ = {start.position, start.velocity, 0.0};
  // Both sides of what is jumped over are next to each other.
  const bool slow_start = std::abs(start.velocity) < least;
  const bool slow_end = std::abs(velocity) < least;
  const double toward = std::copysign(least, slow_end ? start.velocity : velocity);
  const double from = slow_start ? (slow_end ? velocity : toward) : start.velocity;
  const double to = slow_end ? (slow_start ? velocity : toward) : velocity;
  profile.profile_ = TrapezoidProfile::to_velocity(limits, {start.position, from}, to);
  profile.goal_ = profile.profile_.goal();
  if (slow_end) {
    profile.goal_.velocity = velocity;
  }
  return profile;
}

MotionState StepperProfile::sample(double t) const noexcept {
  const double end = profile_.total_time();
  if (!(t >= 0.0)) {
    return end > 0.0 ? start_ : goal_;
  }
  if (t < end) {
    return profile_.sample(t);
  }
  const double past = std::isfinite(t) ? t - end : 0.0;
  const double position = goal_.position + goal_.velocity * past;
  return {std::isfinite(position) ? position : goal_.position, goal_.velocity, 0.0};
}

}  // namespace flyball
