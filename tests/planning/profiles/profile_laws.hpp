#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <flyball/planning/profiles/motion.hpp>

namespace flyball::test {

/// What is asked of a profile beyond the laws of all.
struct ProfileDemand {
  MotionLimits limits{};
  MotionState start{};
  MotionState goal{};
  int order = 2;  ///< 2: accelerations may jump; 3: they do not, and the jerk is limited.
  int samples = 32;
  bool replan = true;  ///< A plan made on the way is the rest of the way.
};

/// Of `broken_law`: plans from the way, and the way back.
template <MotionProfile Profile>
std::string broken_law_of_plans(const Profile& profile, const ProfileDemand& demand, double x_tol,
                                double v_tol, double a_out) {
  const double end = profile.total_time();
  const MotionLimits limits = demand.limits.both_ways();
  const MotionState& start = demand.start;
  const MotionState& goal = demand.goal;
  char text[400];
  const auto broken = [&](const char* law, double t, double got, double limit) {
    std::snprintf(text, sizeof text, "%s at %.17g of %.17g s: %.17g, allowed %.17g", law, t, end,
                  got, limit);
    return std::string(text);
  };
  if (demand.replan && end > 0.0) {
    const double t = 0.37 * end;
    const Profile rest = profile.replanned(profile.sample(t), goal);
    // The time of a way is the root of its length, whose rounding is that of its ends.
    const double ulps = 1e-15 * (std::abs(start.position) + std::abs(goal.position));
    const double root = demand.order >= 3 && std::isfinite(limits.jerk)
                            ? std::cbrt(ulps / limits.jerk)
                            : std::sqrt(ulps / a_out);
    if (!(rest.total_time() <= (end - t) * (1.0 + 1e-6) + 1e-6 * end + root)) {
      return broken("a plan from the way", t, rest.total_time(), end - t);
    }
  }
  if (profile.reversible()) {
    const ReversedMotion<Profile> back(profile);
    const MotionState there = back.sample(0.25 * end);
    const MotionState here = profile.sample(0.75 * end);
    if (std::abs(there.position - here.position) > x_tol ||
        std::abs(there.velocity + here.velocity) > v_tol) {
      return broken("backwards", 0.25 * end, there.velocity, -here.velocity);
    }
  }
  return {};
}

/// The first law that a profile breaks, in words; empty if it keeps all.
///
/// Between any two samples h apart a motion within its limits obeys the inequalities below; a
/// motion that broke a limit in between, jumped, or did not integrate, would break one of them.
template <class Profile>
std::string broken_law(const Profile& profile, const ProfileDemand& demand) {
  const MotionLimits limits = demand.limits.both_ways();
  const MotionState& start = demand.start;
  const MotionState& goal = demand.goal;
  const double end = profile.total_time();
  char text[400];
  const auto broken = [&](const char* law, double t, double got, double limit) {
    std::snprintf(text, sizeof text, "%s at %.17g of %.17g s: %.17g, allowed %.17g", law, t, end,
                  got, limit);
    return std::string(text);
  };
  if (!(end >= 0.0) || !std::isfinite(end)) {
    return broken("duration", 0.0, end, 0.0);
  }
  // What a start outside of the limits may do: it comes back at full braking, with a ramp.
  const double a_out = std::max({limits.acceleration, limits.deceleration,
                                 demand.order >= 3 ? std::abs(start.acceleration) : 0.0});
  const double drift = demand.order >= 3 && std::isfinite(limits.jerk)
                           ? 0.5 * start.acceleration * start.acceleration / limits.jerk
                           : 0.0;
  const double v_high =
      std::max(limits.velocity, start.velocity + (start.acceleration > 0.0 ? drift : 0.0));
  const double v_low =
      std::max(limits.reverse_velocity, -start.velocity + (start.acceleration < 0.0 ? drift : 0.0));
  const double a_high = std::max(limits.acceleration, demand.order >= 3 ? start.acceleration : 0.0);
  const double a_low = std::max(limits.deceleration, demand.order >= 3 ? -start.acceleration : 0.0);
  constexpr double rel = 1e-9;
  const double v_size = std::max({v_high, v_low, 1e-300});
  const double x_size = std::abs(start.position) + std::abs(goal.position) + v_size * end * 1e-3 +
                        v_size * v_size / a_out;
  // The last sample is 1e-15 of the duration before the end.
  const double early = 2e-15 * end;
  const double x_tol = rel * x_size + v_size * early;
  const double v_tol = rel * v_size + a_out * early;
  const double a_tol = rel * a_out + (std::isfinite(limits.jerk) ? limits.jerk * early : 0.0);

  MotionState before = profile.sample(0.0);
  if (before.position != start.position || before.velocity != start.velocity ||
      (demand.order >= 3 && end > 0.0 && before.acceleration != start.acceleration)) {
    return broken("start", 0.0, before.position - start.position, 0.0);
  }
  const MotionState last = profile.sample(end * (1.0 - 1e-15));
  if (!(std::abs(last.position - goal.position) <= x_tol)) {
    return broken("end position", end, last.position - goal.position, x_tol);
  }
  if (!(std::abs(last.velocity - goal.velocity) <= v_tol)) {
    return broken("end velocity", end, last.velocity - goal.velocity, v_tol);
  }
  if (demand.order >= 3 && end > 0.0 && std::isfinite(limits.jerk) &&
      !(std::abs(last.acceleration - goal.acceleration) <= a_tol)) {
    return broken("end acceleration", end, last.acceleration - goal.acceleration, a_tol);
  }
  const MotionState past = profile.sample(end + 1.0);
  if (past.velocity != goal.velocity) {
    return broken("after the end", end + 1.0, past.velocity, goal.velocity);
  }
  if (std::abs(profile.remaining_time(0.25 * end) - 0.75 * end) > rel * end ||
      profile.remaining_time(2.0 * end + 1.0) != 0.0 || profile.remaining_time(-1.0) != end) {
    return broken("remaining time", 0.25 * end, profile.remaining_time(0.25 * end), 0.75 * end);
  }

  const double h = end / demand.samples;
  for (int i = 1; i <= demand.samples; ++i) {
    const double t = i == demand.samples ? end * (1.0 - 1e-15) : i * h;
    const MotionState now = profile.sample(t);
    if (!(now.velocity <= v_high + v_tol) || !(now.velocity >= -v_low - v_tol)) {
      return broken("velocity limit", t, now.velocity, now.velocity > 0.0 ? v_high : -v_low);
    }
    if (!(now.acceleration <= a_high + a_tol) || !(now.acceleration >= -a_low - a_tol)) {
      return broken("acceleration limit", t, now.acceleration,
                    now.acceleration > 0.0 ? a_high : -a_low);
    }
    const double dv = now.velocity - before.velocity;
    if (!(dv <= a_high * h + v_tol) || !(dv >= -a_low * h - v_tol)) {
      return broken("mean acceleration", t, dv / h, dv > 0.0 ? a_high : -a_low);
    }
    const double dx = now.position - before.position;
    const double mean = 0.5 * h * (before.velocity + now.velocity);
    if (!(std::abs(dx - mean) <= 0.125 * (a_high + a_low) * h * h + x_tol)) {
      return broken("the integral of the velocity", t, dx - mean, 0.125 * (a_high + a_low) * h * h);
    }
    if (demand.order >= 3 && std::isfinite(limits.jerk)) {
      const double da = now.acceleration - before.acceleration;
      if (!(std::abs(da) <= limits.jerk * h + a_tol)) {
        return broken("jerk limit", t, da / h, limits.jerk);
      }
      const double ddv = dv - before.acceleration * h;
      if (!(std::abs(ddv) <= 0.5 * limits.jerk * h * h + v_tol)) {
        return broken("the integral of the acceleration", t, ddv, 0.5 * limits.jerk * h * h);
      }
      const double ddx = dx - (before.velocity + 0.5 * before.acceleration * h) * h;
      if (!(std::abs(ddx) <= limits.jerk * h * h * h / 6.0 + x_tol)) {
        return broken("the integral of the integral", t, ddx, limits.jerk * h * h * h / 6.0);
      }
    }
    before = now;
  }
  if constexpr (MotionProfile<Profile>) {
    return broken_law_of_plans(profile, demand, x_tol, v_tol, a_out);
  }
  return {};
}

/// A third of all numbers zero: corners are where profiles break.
template <class Generator>
double often_zero(Generator& random, double scale) {
  return random.uniform(0.0, 1.0) < 0.33 ? 0.0 : scale * random.normal();
}

/// States and limits of all sizes, for a profile of order 2 or 3: velocities at their limits, ends
/// close to each other, starts beyond the limits (`outside`).
template <class Generator>
ProfileDemand random_demand(Generator& random, int order, bool outside) {
  ProfileDemand demand;
  demand.order = order;
  MotionLimits& limits = demand.limits;
  limits.velocity = std::exp(random.uniform(-2.5, 2.5));
  limits.acceleration = std::exp(random.uniform(-2.5, 2.5));
  if (random.uniform(0.0, 1.0) < 0.5) {
    limits.deceleration = std::exp(random.uniform(-2.5, 2.5));
    limits.reverse_velocity = std::exp(random.uniform(-2.5, 2.5));
  }
  if (order >= 3) {
    limits.jerk = std::exp(random.uniform(-2.5, 3.5));
  }
  const MotionLimits all = limits.both_ways();
  const auto velocity = [&](double beyond) {
    const double kind = random.uniform(0.0, 1.0);
    const double v = kind < 0.25   ? 0.0
                     : kind < 0.3  ? all.velocity
                     : kind < 0.35 ? -all.reverse_velocity
                                   : random.uniform(-all.reverse_velocity, all.velocity);
    return beyond * v;
  };
  const auto acceleration = [&](double v) {
    if (order < 3 || random.uniform(0.0, 1.0) < 0.3) {
      return 0.0;
    }
    const double a = random.uniform(0.0, 1.0) < 0.1
                         ? (random.uniform(0.0, 1.0) < 0.5 ? all.acceleration : -all.deceleration)
                         : random.uniform(-all.deceleration, all.acceleration);
    // As much as the velocity limit lets it have.
    const double room = a > 0.0 ? all.velocity - v : v + all.reverse_velocity;
    const double most = std::sqrt(std::max(0.0, 2.0 * all.jerk * room));
    return std::clamp(a, -most, most);
  };
  const double scale = std::exp(random.uniform(-4.0, 4.0));
  demand.start.position = often_zero(random, scale);
  demand.start.velocity = velocity(outside ? 2.0 : 1.0);
  demand.start.acceleration = acceleration(outside ? 0.0 : demand.start.velocity);
  demand.goal.velocity = velocity(1.0);
  // Before the goal: the mirrored demand.
  demand.goal.acceleration = -acceleration(demand.goal.velocity);
  demand.goal.acceleration =
      std::clamp(demand.goal.acceleration, -all.deceleration, all.acceleration);
  if (demand.goal.acceleration != 0.0) {
    const double room = demand.goal.acceleration < 0.0
                            ? all.velocity - demand.goal.velocity
                            : demand.goal.velocity + all.reverse_velocity;
    const double most = std::sqrt(std::max(0.0, 2.0 * all.jerk * room));
    demand.goal.acceleration = std::clamp(demand.goal.acceleration, -most, most);
  }
  demand.goal.position = demand.start.position + often_zero(random, scale);
  return demand;
}

}  // namespace flyball::test
