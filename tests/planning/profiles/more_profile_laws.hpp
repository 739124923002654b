#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include "planning/profiles/fastest_duration.hpp"
#include "planning/profiles/profile_laws.hpp"

/// Laws of a profile that jumps at its ends, and of changes of a velocity.
namespace flyball::test {

/// The first law that a stepper profile breaks. Between its jumps it is a trapezoid that keeps the
/// laws of one; it jumps from slow ends alone, to the jump's velocity; and no pair of sides to jump
/// to is faster, by bisection.
inline std::string broken_law_of_jumps(const StepperProfile& profile, const ProfileDemand& demand) {
  const double end = profile.total_time();
  const double jump = profile.jump();
  const MotionLimits all = demand.limits.both_ways();
  if (!(end >= 0.0) || !std::isfinite(end)) {
    return "the duration is none";
  }
  const double goal_velocity =
      std::clamp(demand.goal.velocity, -all.reverse_velocity, all.velocity);
  const MotionState after = profile.sample(end);
  if (after.velocity != goal_velocity || after.position != demand.goal.position) {
    return "it does not end at the goal";
  }
  const bool slow_start = std::abs(demand.start.velocity) < jump;
  const bool slow_goal = std::abs(demand.goal.velocity) < jump;
  const double distance = demand.goal.position - demand.start.position;
  if (distance == 0.0 && slow_start && slow_goal) {
    return end == 0.0 ? "" : "it goes nowhere, and takes time";
  }
  ProfileDemand inner = demand;
  const MotionState first = profile.between().sample(0.0);
  const MotionState last = profile.between().goal();
  if (end > 0.0) {
    const MotionState before = profile.sample(-1e-9);
    if (before.velocity != demand.start.velocity || before.position != demand.start.position) {
      return "it does not begin at the start";
    }
  }
  const auto side = [&](bool slow, double own, double got) {
    return slow ? std::abs(got) == jump : got == own;
  };
  if (!side(slow_start, demand.start.velocity, first.velocity)) {
    return "it jumps at the start to another velocity";
  }
  if (!side(slow_goal, goal_velocity, last.velocity)) {
    return "it jumps at the end from another velocity";
  }
  inner.start = first;
  inner.start.acceleration = 0.0;
  inner.goal.velocity = last.velocity;
  inner.goal.acceleration = 0.0;
  if (std::string law = broken_law(profile.between(), inner); !law.empty()) {
    return law;
  }
  for (int k = 1; k < 8; ++k) {
    const double t = end * k / 8.0;
    if (profile.sample(t).position != profile.between().sample(t).position) {
      return "between the jumps it is another motion";
    }
  }
  const ConstantEffort effort{all.acceleration, all.deceleration};
  if (std::string slower = broken_optimality(end, effort, all.velocity, all.reverse_velocity,
                                             inner.start, inner.goal);
      !slower.empty()) {
    return slower;
  }
  for (const double from : {1.0, -1.0}) {
    for (const double to : {1.0, -1.0}) {
      MotionState start = demand.start;
      MotionState goal = demand.goal;
      start.velocity = slow_start ? from * jump : start.velocity;
      goal.velocity = slow_goal ? to * jump : goal_velocity;
      const auto other = static_cast<double>(fastest_duration(
          effort, all.velocity, all.reverse_velocity,
          static_cast<long double>(goal.position) - static_cast<long double>(start.position),
          start.velocity, goal.velocity));
      // A way that is just missed is known as the rounding of its ends lets it be, and no way at
      // all takes the oracle's own rounding.
      const double least_effort = std::min(all.acceleration, all.deceleration);
      const double slack =
          1e-9 * end + 1e-17 * all.velocity / least_effort +
          std::sqrt(1e-14 * (std::abs(start.position) + std::abs(goal.position)) / least_effort);
      if (other < end - slack) {
        return "jumping to another side is faster";
      }
    }
  }
  return "";
}

/// The first law that a change of a velocity breaks: of a trapezoid, a parabola, a motor, a
/// stepper. The durations are closed: |Δv|/a, the parabola's 2 V/A (√(1 - v/V)) from zero, the
/// motor's logarithms over its two stretches by the oracle of `fastest_duration`.
inline std::string broken_law_of_velocity_targets(const ProfileDemand& given) {
  const MotionLimits all = given.limits.both_ways();
  ProfileDemand demand = given;
  demand.replan = false;
  const double v_0 = demand.start.velocity;
  demand.start.acceleration = 0.0;
  demand.goal.acceleration = 0.0;
  const auto check = [&](const auto& profile, double best, const char* name) -> std::string {
    ProfileDemand reached = demand;
    reached.goal.position = profile.goal().position;
    reached.goal.velocity = profile.goal().velocity;
    if (std::string law = broken_law(profile, reached); !law.empty()) {
      return std::string(name) + ": " + law;
    }
    if (std::abs(profile.total_time() - best) > 1e-9 * best + 1e-300) {
      return std::string(name) + ": not the fastest";
    }
    return "";
  };
  const double v = std::clamp(demand.goal.velocity, -all.reverse_velocity, all.velocity);
  const auto trapezoid = TrapezoidProfile::to_velocity(demand.limits, demand.start, v);
  const double best = v > v_0 ? (v - v_0) / all.acceleration : (v_0 - v) / all.deceleration;
  if (trapezoid.goal().velocity != v) {
    return "trapezoid: another velocity";
  }
  if (std::string law = check(trapezoid, best, "trapezoid"); !law.empty()) {
    return law;
  }
  // A jump takes its part of the change at once.
  const double jump = 0.3 * std::min(all.velocity, all.reverse_velocity);
  const auto stepper = StepperProfile::to_velocity(demand.limits, jump, demand.start, v);
  const bool slow = std::abs(v_0) < jump && std::abs(v) < jump;
  const double from = std::abs(v_0) < jump ? std::copysign(jump, v) : v_0;
  const double to = std::abs(v) < jump ? std::copysign(jump, v_0) : v;
  const double rest = slow        ? 0.0
                      : to > from ? (to - from) / all.acceleration
                                  : (from - to) / all.deceleration;
  if (stepper.goal().velocity != v || stepper.sample(-1.0).velocity != (rest > 0.0 ? v_0 : v) ||
      std::abs(stepper.total_time() - rest) > 1e-9 * rest) {
    return "stepper: not the jump and the rest of the change";
  }
  // The parabola, of both directions alike.
  const double V = demand.limits.velocity;
  const double A = demand.limits.acceleration;
  ProfileDemand same = demand;
  same.limits = {V, A};
  std::swap(demand, same);
  const double w = std::clamp(v, -V, V);
  const auto parabolic = ParabolicProfile::to_velocity({V, A}, demand.start, w);
  const auto from_zero = [&](double u) {
    return 2.0 * V / A * (1.0 - std::sqrt(std::max(0.0, 1.0 - std::abs(u) / V)));
  };
  const double u = std::clamp(v_0, -V, V);
  const double ramp =
      u * w < 0.0 ? from_zero(u) + from_zero(w) : std::abs(from_zero(u) - from_zero(w));
  const double parabola = std::abs(v_0 - u) / A + ramp;
  // From a velocity near the limit √(1 - v/V) has half of the digits.
  if (std::abs(parabolic.total_time() - parabola) > 1e-9 * parabola + 1e-7 * V / A) {
    return "parabola: not the fastest";
  }
  if (std::string law = check(parabolic, parabolic.total_time(), "parabola"); !law.empty()) {
    return law;
  }
  // The motor: from the velocity to the velocity at full effort by its oracle.
  const MotorMotionLimits motor{
      .kV = 12.0 / V, .kA = 12.0 / A, .voltage = 12.0, .kS = 0.5, .kG = 1.0};
  const double top = 0.8 * V;
  demand.start.velocity = std::clamp(v_0, -top, top);
  const double x = std::clamp(v, -top, top);
  const auto motion = ExponentialProfile::to_velocity(motor, demand.start, x);
  demand.limits = {2.0 * V, 40.0 / motor.kA};
  const auto full = static_cast<double>(MotorEffort{motor}.change(demand.start.velocity, x).time);
  if (motion.goal().velocity != x) {
    return "motor: another velocity";
  }
  return check(motion, full, "motor");
}

}  // namespace flyball::test
