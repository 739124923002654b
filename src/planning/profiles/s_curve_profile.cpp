#include <flyball/planning/profiles/s_curve_profile.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include "planning/profiles/s_curve_problem.hpp"

namespace flyball {

namespace {

/// A goal that may be stood at, whatever it is.
MotionState resting(const MotionState& goal) {
  return {std::isfinite(goal.position) ? goal.position : 0.0, 0.0, 0.0};
}

}  // namespace

void JerkMotion::add_plan(const detail::SCurvePlan& plan) noexcept {
  for (int i = 0; i < plan.brakes; ++i) {
    add(plan.brake[i].duration, plan.brake[i].jerk * plan.jerk);
  }
  const double jerk = plan.phases.sign * plan.jerk;
  const double* const t = plan.phases.t;
  add(t[0], jerk);
  add(t[1], 0.0);
  add(t[2], -jerk);
  if (t[3] > 0.0) {
    goal_.acceleration = 0.0;  // over a long cruise its rounding would add up
    add(t[3], 0.0);
  }
  add(t[4], -jerk);
  add(t[5], 0.0);
  add(t[6], jerk);
}

void JerkMotion::add_trapezoid(const MotionLimits& limits, const MotionState& start,
                               const MotionState& goal) noexcept {
  constexpr double largest = 1e99;
  const MotionLimits all = limits.both_ways();
  const TrapezoidProfile profile(
      {std::min(all.velocity, largest), std::min(all.acceleration, largest),
       std::min(all.deceleration, largest), std::min(all.reverse_velocity, largest)},
      start, goal);
  double before = 0.0;
  for (const double end : profile.phase_ends()) {
    goal_.acceleration = profile.sample(before).acceleration;
    add(end - before, 0.0);
    before = end;
  }
  finish(profile.sample(profile.total_time()));
}

SCurveProfile::SCurveProfile(const MotionLimits& limits, const MotionState& start,
                             const MotionState& goal) noexcept
    : limits_(limits) {
  if (limits.jerk >= detail::largest_motion && detail::is_usable(limits, start, goal)) {
    begin({start.position, start.velocity, 0.0});
    add_trapezoid(limits, start, goal);
    return;
  }
  const detail::SCurvePlan plan = detail::plan_motion(limits, start, goal);
  begin(plan.usable ? start : resting(goal));
  if (plan.usable) {
    add_plan(plan);
    finish(plan.goal);
  }
}

SCurveProfile SCurveProfile::to_velocity(const MotionLimits& limits, const MotionState& start,
                                         double velocity, double acceleration) noexcept {
  SCurveProfile profile(limits);
  if (limits.jerk >= detail::largest_motion) {
    const MotionState goal{start.position, velocity, 0.0};
    const bool usable = detail::is_usable(limits, start, goal);
    profile.begin(usable ? start : resting(start));
    if (usable) {
      const MotionLimits all = limits.both_ways();
      const double end = std::clamp(velocity, -all.reverse_velocity, all.velocity);
      const double change = end - start.velocity;
      const double a = change > 0.0 ? all.acceleration : -all.deceleration;
      profile.goal_.acceleration = a;
      profile.add(change / a, 0.0);
      profile.finish({profile.goal_.position, end, 0.0});
    }
    return profile;
  }
  const detail::SCurvePlan plan =
      detail::plan_velocity(limits, start, {start.position, velocity, acceleration});
  profile.begin(plan.usable ? start : resting(start));
  if (plan.usable) {
    profile.add_plan(plan);
    profile.finish({profile.goal_.position, plan.goal.velocity, plan.goal.acceleration});
  }
  return profile;
}

bool SCurveProfile::reversible() const noexcept {
  const MotionLimits all = limits();
  double low = goal().velocity;
  double high = low;
  for (int i = 0; i < pieces(); ++i) {
    const Piece p = piece(i);
    low = std::min(low, p.at.velocity);
    high = std::max(high, p.at.velocity);
    // Between, where the acceleration is zero.
    const double t = p.jerk != 0.0 ? -p.at.acceleration / p.jerk : -1.0;
    const double end = i + 1 < pieces() ? piece(i + 1).begin : total_time();
    if (t > 0.0 && p.begin + t < end) {
      const double v = p.at.velocity + 0.5 * p.at.acceleration * t;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  }
  constexpr double rounding = 1.0 + 1e-12;
  return -low <= all.velocity * rounding && high <= all.reverse_velocity * rounding;
}

}  // namespace flyball
