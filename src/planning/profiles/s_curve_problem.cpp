#include <algorithm>
#include <cmath>

#include "planning/profiles/s_curve_problem.hpp"

namespace flyball::detail {

namespace {

constexpr double near = 1e-13;  // relative: rounding of a state that an earlier plan gave

bool is_limit(double value) {
  return value >= 1.0 / largest_motion;
}
bool is_state(const MotionState& s) {
  return std::abs(s.position) <= largest_motion && std::abs(s.velocity) <= largest_motion &&
         std::abs(s.acceleration) <= largest_motion;
}

struct Braking {
  SCurvePlan::Step steps[3]{};
  double v = 0.0;
  double a = 0.0;
  double time = 0.0;
  double distance = 0.0;

  void add(int i, double duration, double jerk) {
    const double t = std::max(0.0, duration);
    steps[i] = {t, jerk};
    distance += (v + (0.5 * a + jerk * t / 6.0) * t) * t;
    v += (a + 0.5 * jerk * t) * t;
    a += jerk * t;
    time += t;
  }
};

/// From above the limit, with v + a²/2 (a > 0) or v beyond it, down to it with whatever
/// acceleration it has by then.
Braking brake_first(double v, double a, double high, double low, double down) {
  Braking b{.v = v, .a = a};
  const double deepest = std::min(down, std::sqrt(2.0 * (high + low)));  // can still be let go
  const double lowest = v + 0.5 * (a * a - deepest * deepest);
  if (lowest >= high) {
    b.add(0, a + deepest, -1.0);
    b.add(1, (b.v - high) / deepest, 0.0);
  } else {
    b.add(0, a + std::sqrt(std::max(0.0, a * a + 2.0 * (v - high))), -1.0);
  }
  b.v = high;
  return b;
}

/// Down to the limit with the acceleration of zero there.
Braking brake_smoothly(double v, double a, double high, const SCurveProblem& p) {
  SCurveProblem change = p;
  change.v_0 = v;
  change.a_0 = a;
  change.v_f = high;
  change.a_f = 0.0;
  const SCurvePhases phases = fastest_velocity_change(change);
  Braking b{.v = v, .a = a};
  b.add(0, phases.t[0], phases.sign);
  b.add(1, phases.t[1], 0.0);
  b.add(2, phases.t[2] + phases.t[4], -phases.sign);
  b.v = high;
  b.a = 0.0;
  return b;
}

void mirror(SCurveProblem& p) {
  p.distance = -p.distance;
  p.v_0 = -p.v_0;
  p.a_0 = -p.a_0;
  p.v_f = -p.v_f;
  p.a_f = -p.a_f;
  std::swap(p.up, p.down);
  std::swap(p.high, p.low);
}

/// Begins the plan with `b`; `side` is -1 if the problem was mirrored for it.
void begin_with(SCurvePlan& plan, const Braking& b, double side) {
  for (const SCurvePlan::Step& step : b.steps) {
    if (step.duration > 0.0 && plan.brakes < 4) {
      plan.brake[plan.brakes++] = {step.duration, side * step.jerk};
    }
  }
  plan.brake_time += b.time;
  plan.problem.distance -= side * b.distance;
  plan.problem.v_0 = side * b.v;
  plan.problem.a_0 = side * b.a;
}

void bring_acceleration_inside(SCurvePlan& plan) {
  SCurveProblem& p = plan.problem;
  const bool above = p.a_0 > p.up * (1.0 + near);
  if (above || p.a_0 < -p.down * (1.0 + near)) {
    Braking b{.v = p.v_0, .a = p.a_0};
    b.add(0, above ? p.a_0 - p.up : -p.down - p.a_0, above ? -1.0 : 1.0);
    b.a = above ? p.up : -p.down;
    begin_with(plan, b, 1.0);
  }
}

/// Whether a start is beyond the upper limit, or cannot but go beyond.
bool overshoots(double v, double a, double limit) {
  return v + (a > 0.0 ? 0.5 * a * a : 0.0) > limit * (1.0 + near);
}

/// Whether the phases end at the goal and keep the velocity limits all the way behind the start.
bool keeps(const SCurveProblem& p, const SCurvePhases& phases) {
  constexpr double jerks[7] = {1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0};
  constexpr double close = 1e-9;
  Braking along{.v = p.v_0, .a = p.a_0};
  const double high = p.high * (1.0 + near);
  const double low = -p.low * (1.0 + near);
  for (int i = 0; i < 7; ++i) {
    const double jerk = phases.sign * jerks[i];
    // A place of zero acceleration is an extreme of the velocity.
    const double extreme = -along.a * jerk;
    if (jerk != 0.0 && extreme >= 0.0 && extreme < phases.t[i]) {
      const double v = along.v + 0.5 * along.a * extreme;
      if (v > high || v < low) {
        return false;
      }
    }
    along.add(0, phases.t[i], jerk);
    if (along.time > 0.0 && (along.v > high || along.v < low) && along.v != p.v_f &&
        !(std::abs(along.v - p.v_f) <= close * (p.high + p.low))) {
      return false;
    }
  }
  const double reach = std::abs(p.distance) + (p.high + p.low) * along.time;
  return std::abs(along.v - p.v_f) <= close * (p.high + p.low) &&
         std::abs(along.a - p.a_f) <= close * (p.up + p.down) &&
         std::abs(along.distance - p.distance) <= close * reach;
}

void solve(SCurvePlan& plan, bool inside_first) {
  bring_acceleration_inside(plan);
  const SCurveProblem& from = plan.problem;
  const bool above = overshoots(from.v_0, from.a_0, from.high);
  if (!above && !overshoots(-from.v_0, -from.a_0, from.low)) [[likely]] {
    plan.phases = fastest_motion(plan.problem);
    return;
  }
  SCurveProblem p = plan.problem;
  const double side = above ? 1.0 : -1.0;
  if (!above) {
    mirror(p);
  }
  // Near a goal that can itself not be gone on from within the limits, they still hold to there;
  // and the fastest motion may brake all the way.
  if (!inside_first) {
    plan.phases = fastest_motion(plan.problem);
    plan.straight = keeps(plan.problem, plan.phases);
    if (plan.straight) {
      return;
    }
  }
  SCurvePlan first = plan;
  SCurvePlan smooth = plan;
  begin_with(smooth, brake_smoothly(p.v_0, p.a_0, p.high, p), side);
  smooth.phases = fastest_motion(smooth.problem);
  if (-p.a_0 <= std::min(p.down, std::sqrt(2.0 * (p.high + p.low))) * (1.0 + near)) {
    begin_with(first, brake_first(p.v_0, p.a_0, p.high, p.low, p.down), side);
    first.phases = fastest_motion(first.problem);
    plan = first.duration() < smooth.duration() ? first : smooth;
  } else {
    plan = smooth;
  }
}

SCurvePlan prepared(const MotionLimits& limits, const MotionState& start, const MotionState& goal) {
  SCurvePlan plan;
  plan.usable = is_usable(limits, start, goal);
  if (!plan.usable) {
    return plan;
  }
  const MotionLimits all = limits.both_ways();
  const double J = all.jerk;
  const double per = 1.0 / J;
  SCurveProblem& p = plan.problem;
  p.up = std::min(all.acceleration, largest_motion) * per;
  p.down = std::min(all.deceleration, largest_motion) * per;
  p.high = std::min(all.velocity, largest_motion) * per;
  p.low = std::min(all.reverse_velocity, largest_motion) * per;
  p.distance = (goal.position - start.position) * per;
  p.v_0 = start.velocity * per;
  p.a_0 = start.acceleration * per;
  p.v_f = std::clamp(goal.velocity * per, -p.low, p.high);
  p.a_f = std::clamp(goal.acceleration * per, -p.down, p.up);
  // Before the goal the velocity was v_f + a_f²/2 (a_f < 0) where the acceleration was zero.
  if (p.a_f < 0.0 && p.v_f + 0.5 * p.a_f * p.a_f > p.high * (1.0 + near)) {
    p.a_f = -std::sqrt(2.0 * (p.high - p.v_f));
  } else if (p.a_f > 0.0 && p.v_f - 0.5 * p.a_f * p.a_f < -p.low * (1.0 + near)) {
    p.a_f = std::sqrt(2.0 * (p.v_f + p.low));
  }
  // A state that was sampled on the way is off by rounding. It must not miss a goal that moves, as
  // far as that moves one: by the time that rounding of the velocity is made up for in.
  const double v = std::abs(p.v_0) + std::abs(p.v_f);
  p.slack = 4e-15 * per * (std::abs(goal.position) + std::abs(start.position)) +
            2e-14 * v * (v / std::min(p.up, p.down) + p.up + p.down);
  const bool cut = p.v_f != goal.velocity * per || p.a_f != goal.acceleration * per;
  plan.goal = cut ? MotionState{goal.position, p.v_f * J, p.a_f * J} : goal;
  plan.jerk = J;
  return plan;
}

}  // namespace

bool is_usable(const MotionLimits& limits, const MotionState& start,
               const MotionState& goal) noexcept {
  const MotionLimits all = limits.both_ways();
  return is_limit(all.velocity) && is_limit(all.reverse_velocity) && is_limit(all.acceleration) &&
         is_limit(all.deceleration) && is_limit(all.jerk) && is_state(start) && is_state(goal);
}

SCurvePlan plan_motion(const MotionLimits& limits, const MotionState& start,
                       const MotionState& goal, bool inside_first) noexcept {
  SCurvePlan plan = prepared(limits, start, goal);
  if (plan.usable) {
    solve(plan, inside_first);
    plan.usable = plan.duration() <= longest_motion;
  }
  return plan;
}

SCurvePlan plan_velocity(const MotionLimits& limits, const MotionState& start,
                         const MotionState& goal) noexcept {
  SCurvePlan plan = prepared(limits, start, goal);
  if (plan.usable) {
    bring_acceleration_inside(plan);
    plan.phases = fastest_velocity_change(plan.problem);
    plan.usable = plan.duration() <= longest_motion;
  }
  return plan;
}

}  // namespace flyball::detail
