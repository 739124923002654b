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
  double v_0 = start.velocity;
  if (std::abs(v_0) > V) {
    goal_.acceleration = v_0 > 0.0 ? -A : A;
    const double end = std::copysign(V, v_0);
    add((end - v_0) / goal_.acceleration, 0.0);
    v_0 = end;
  }
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

/// The velocity at an end, with a jump in the direction of the motion if it is slower than that.
MotionState jumped(const MotionState& end, double jump, double direction) {
  MotionState moving = end;
  if (std::abs(end.velocity) < jump && direction != 0.0) {
    moving.velocity = std::copysign(jump, direction);
  }
  return moving;
}

double usable_jump(const MotionLimits& limits, double jump) {
  const MotionLimits all = limits.both_ways();
  return jump > 0.0 ? std::min({jump, all.velocity, all.reverse_velocity}) : 0.0;
}

}  // namespace

StepperProfile::StepperProfile(const MotionLimits& limits, double jump, const MotionState& start,
                               const MotionState& goal) noexcept
    : jump_(usable_jump(limits, jump)),
      start_(start),
      goal_(goal),
      profile_(limits, jumped(start, jump_, goal.position - start.position),
               jumped(goal, jump_, goal.position - start.position)) {
  start_.acceleration = 0.0;
  goal_ = profile_.sample(profile_.total_time());
  if (std::abs(goal.velocity) < jump_) {
    goal_.velocity = goal.velocity;
  }
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
