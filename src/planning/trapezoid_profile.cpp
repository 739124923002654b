#include <flyball/planning/trapezoid_profile.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/signal.hpp>

namespace flyball {

TrapezoidProfile::TrapezoidProfile(const MotionLimits& limits, const MotionState& start,
                                   const MotionState& goal) noexcept
    : start_{start.position, start.velocity, 0.0}, goal_{goal.position, goal.velocity, 0.0} {
  const double v_max = limits.velocity;
  const double a = limits.acceleration;
  const bool usable = v_max > 0.0 && a > 0.0 && std::isfinite(v_max) && std::isfinite(a) &&
                      is_signal(start.position) && is_signal(start.velocity) &&
                      is_signal(goal.position) && is_signal(goal.velocity);
  if (!usable) {
    goal_.position = std::isfinite(goal.position) ? goal.position : 0.0;
    goal_.velocity = 0.0;
    start_ = goal_;
    return;
  }
  goal_.velocity = std::clamp(goal.velocity, -v_max, v_max);

  // Going straight from one velocity to the other covers `direct`. What lies beyond it needs
  // acceleration first, what falls short of it braking first: the same motion mirrored.
  const double distance = goal.position - start.position;
  const double direct =
      0.5 * (start.velocity + goal_.velocity) * (std::abs(goal_.velocity - start.velocity) / a);
  const double sign = distance >= direct ? 1.0 : -1.0;
  const double d = sign * distance;
  const double v_0 = sign * start.velocity;
  const double v_g = sign * goal_.velocity;

  // The peak c of a motion without cruise: (c² - v_0²)/2a + (c² - v_g²)/2a = d.
  const double scale = std::abs(d) + std::abs(direct);
  const bool straight = std::abs(distance - direct) <= 4e-16 * scale;
  const double peak = straight ? std::max(v_0, v_g)
                               : std::sqrt(std::max(0.0, a * d + 0.5 * (v_0 * v_0 + v_g * v_g)));
  const double c = std::min(std::isfinite(peak) ? peak : v_max, v_max);

  const double t_1 = std::abs(c - v_0) / a;
  const double t_3 = std::abs(v_g - c) / a;
  const double covered = 0.5 * (v_0 + c) * t_1 + 0.5 * (c + v_g) * t_3;
  const double t_2 = c > 0.0 && peak > v_max ? std::max(0.0, (d - covered) / c) : 0.0;
  const double total = t_1 + t_2 + t_3;
  // No place on the way may overflow, even if the ends do not.
  const double reach =
      (std::abs(v_0) + std::abs(c)) * t_1 + std::abs(c) * t_2 + (std::abs(c) + std::abs(v_g)) * t_3;
  if (!std::isfinite(total) || !std::isfinite(reach)) {
    goal_.velocity = 0.0;
    start_ = goal_;
    return;
  }
  cruise_ = sign * c;
  first_acceleration_ = sign * (c > v_0 ? a : c < v_0 ? -a : 0.0);
  last_acceleration_ = sign * (v_g > c ? a : v_g < c ? -a : 0.0);
  time_[0] = t_1;
  time_[1] = t_1 + t_2;
  time_[2] = total;
}

MotionState TrapezoidProfile::sample(double t) const noexcept {
  if (!(t >= 0.0)) {
    return start_;
  }
  if (t >= time_[2]) {
    const double past = std::isfinite(t) ? t - time_[2] : 0.0;
    const double position = goal_.position + goal_.velocity * past;
    return {std::isfinite(position) ? position : goal_.position, goal_.velocity, 0.0};
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
  // Backwards from the goal, so that the end is met exactly.
  const double left = time_[2] - t;
  return {goal_.position - (goal_.velocity - 0.5 * last_acceleration_ * left) * left,
          goal_.velocity - last_acceleration_ * left, last_acceleration_};
}

}  // namespace flyball
