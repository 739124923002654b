// Profiles: how long a plan takes, and whether any of many millions breaks a law.
//
//   bench_profiles                  times of each profile over random states, and how many of the
//                                   trapezoid's times that is
//   bench_profiles --campaign N     N random boundary-value problems a profile through the law
//                                   suite (tests/planning/profiles/profile_laws.hpp); says each
//                                   law broken
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>
#include <flyball/planning/profiles/synchronized_motion.hpp>

#include "plain_trapezoid.hpp"
#include "planning/profiles/fastest_duration.hpp"
#include "planning/profiles/more_profile_laws.hpp"
#include "planning/profiles/profile_laws.hpp"

namespace {

using namespace flyball;

/// States as Ruckig's own benchmark draws them: places N(0, 4), velocities and accelerations N(0,
/// 0.8) or zero, limits U(0.1, 12) above those of the goal.
struct Case {
  MotionLimits limits;
  MotionState start;
  MotionState goal;
};

Case random_case(Random& random) {
  const auto moving = [&](double share) {
    return random.uniform() < share ? random.normal(0.0, 0.8) : 0.0;
  };
  while (true) {
    Case c;
    c.start = {random.normal(0.0, 4.0), moving(0.9), moving(0.8)};
    c.goal = {random.normal(0.0, 4.0), moving(0.7), moving(0.6)};
    c.limits = {random.uniform(0.1, 12.0) + std::abs(c.goal.velocity),
                random.uniform(0.1, 12.0) + std::abs(c.goal.acceleration)};
    c.limits.jerk = random.uniform(0.1, 12.0);
    const double drift = 0.5 * c.goal.acceleration * std::abs(c.goal.acceleration) / c.limits.jerk;
    if (std::abs(c.goal.velocity - drift) <= c.limits.velocity &&
        std::abs(c.goal.velocity + drift) <= c.limits.velocity) {
      return c;
    }
  }
}

/// Mean over all, ns, of the least of several passes over each block of them: another process may
/// hold the machine in any pass.
template <class Run>
double nanoseconds(std::size_t count, Run&& run) {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t block = 500;
  double sum = 0.0;
  for (std::size_t from = 0; from < count; from += block) {
    const std::size_t to = std::min(from + block, count);
    double best = 1e300;
    for (int pass = 0; pass < 9; ++pass) {
      const auto start = Clock::now();
      for (std::size_t i = from; i < to; ++i) {
        run(i);
      }
      const std::chrono::duration<double, std::nano> elapsed = Clock::now() - start;
      best = std::min(best, elapsed.count());
    }
    sum += best;
  }
  return sum / static_cast<double>(count);
}

template <class Plan>
double nanoseconds(const std::vector<Case>& cases, Plan&& plan, double& sum) {
  return nanoseconds(cases.size(), [&](std::size_t i) { sum += plan(cases[i]); });
}

template <int Axes>
double synchronized_nanoseconds(const std::vector<Case>& cases, double& sum) {
  using Motion = SynchronizedMotion<Axes>;
  std::vector<typename Motion::Limits> limits(cases.size() / Axes);
  std::vector<typename Motion::States> start(limits.size());
  std::vector<typename Motion::States> goal(limits.size());
  for (std::size_t k = 0; k < limits.size(); ++k) {
    for (std::size_t i = 0; i < Axes; ++i) {
      const Case& c = cases[k * Axes + i];
      limits[k][i] = c.limits;
      start[k][i] = c.start;
      goal[k][i] = c.goal;
    }
  }
  return nanoseconds(limits.size(), [&](std::size_t k) {
    sum += Motion(limits[k], start[k], goal[k]).total_time();
  });
}

void time_all() {
  Random random(42);
  std::vector<Case> cases(21000);
  for (Case& c : cases) {
    c = random_case(random);
  }
  double sum = 0.0;
  const double period = 0.02;
  // Rebuilt each period from its own last sample, as a loop on a robot does.
  const auto loop = [&]<class Profile>(const Profile*, const MotionLimits& limits) {
    constexpr int periods = 200;
    const MotionState goal{4.0};
    const double motion = nanoseconds(500, [&](std::size_t) {
      MotionState at{};
      for (int k = 0; k < periods; ++k) {
        at = Profile(limits, at, goal).sample(period);
      }
      sum += at.position;
    });
    return motion / periods;
  };
  const auto step = [&]<class Profile>(const Profile*) {
    return nanoseconds(
        cases,
        [&](const Case& c) { return Profile(c.limits, c.start, c.goal).sample(period).position; },
        sum);
  };
  constexpr const TrapezoidProfile* ours = nullptr;
  constexpr const bench::PlainTrapezoid* plain = nullptr;
  constexpr MotionLimits equal{1.5, 3.0};
  constexpr MotionLimits unequal{1.5, 3.0, 2.0, 1.2};
  // In turns, so that what else the machine does meets both.
  double trapezoid_loop = 1e300;
  double unequal_loop = 1e300;
  double plain_loop = 1e300;
  double trapezoid = 1e300;
  double plain_step = 1e300;
  for (int turn = 0; turn < 5; ++turn) {
    trapezoid_loop = std::min(trapezoid_loop, loop(ours, equal));
    plain_loop = std::min(plain_loop, loop(plain, equal));
    unequal_loop = std::min(unequal_loop, loop(ours, unequal));
    trapezoid = std::min(trapezoid, step(ours));
    plain_step = std::min(plain_step, step(plain));
  }
  const double s_curve = nanoseconds(
      cases, [&](const Case& c) { return SCurveProfile(c.limits, c.start, c.goal).total_time(); },
      sum);
  const double parabolic = nanoseconds(
      cases,
      [&](const Case& c) { return ParabolicProfile(c.limits, c.start, c.goal).total_time(); }, sum);
  const double exponential = nanoseconds(
      cases,
      [&](const Case& c) {
        const MotorMotionLimits motor{
            .kV = 12.0 / c.limits.velocity, .kA = 12.0 / c.limits.acceleration, .voltage = 12.0};
        return ExponentialProfile(motor, c.start, c.goal).total_time();
      },
      sum);
  const std::vector<Case> few(cases.begin(), cases.begin() + 500);
  const double minimum_jerk = nanoseconds(
      few,
      [&](const Case& c) { return MinimumJerkProfile(c.limits, c.start, c.goal).total_time(); },
      sum);
  const double three = synchronized_nanoseconds<3>(cases, sum);
  const double seven = synchronized_nanoseconds<7>(cases, sum);
  std::printf("%-44s %10s %10s\n", "plan", "ns", "ratio");
  const auto row = [&](const char* name, double ns) {
    std::printf("%-44s %10.1f %10.2f\n", name, ns, ns / trapezoid);
  };
  row("trapezoid and one sample, rebuilt in a loop", trapezoid_loop);
  row("  with unequal limits", unequal_loop);
  row("  by plain formulas, equal limits only", plain_loop);
  row("trapezoid and one sample, random states", trapezoid);
  row("  by plain formulas", plain_step);
  row("S-curve, random states", s_curve);
  row("S-curve, 3 axes at once", three);
  row("S-curve, 7 axes at once", seven);
  row("parabolic", parabolic);
  row("exponential", exponential);
  row("minimum jerk", minimum_jerk);
  std::printf("(checksum %.9g)\n", sum);
}

/// Which campaigns run: those whose name begins so.
std::string_view only;

template <class Try>
void campaign(std::string_view name, long count, Try&& attempt) {
  if (!name.starts_with(only)) {
    return;
  }
  Random random(20260101);
  long broken = 0;
  for (long i = 0; i < count; ++i) {
    const std::string law = attempt(random);
    if (!law.empty() && ++broken <= 10) {
      std::printf("%s, problem %ld: %s\n", name.data(), i, law.c_str());
    }
  }
  std::printf("%-28s %10ld problems, %ld broke a law\n", name.data(), count, broken);
  std::fflush(stdout);
}

std::string try_trapezoid(Random& random, bool outside) {
  const test::ProfileDemand demand = test::random_demand(random, 2, outside);
  const TrapezoidProfile profile(demand.limits, demand.start, demand.goal);
  std::string law = test::broken_law(profile, demand);
  const MotionLimits all = demand.limits.both_ways();
  return law.empty()
             ? test::broken_optimality(
                   profile.total_time(), test::ConstantEffort{all.acceleration, all.deceleration},
                   all.velocity, all.reverse_velocity, demand.start, demand.goal)
             : law;
}

std::string try_s_curve(Random& random, bool outside) {
  const test::ProfileDemand demand = test::random_demand(random, 3, outside);
  return test::broken_law(SCurveProfile(demand.limits, demand.start, demand.goal), demand);
}

std::string try_parabolic(Random& random, bool outside) {
  test::ProfileDemand demand = test::random_demand(random, 2, outside);
  const double V = demand.limits.velocity;
  demand.limits = {V, demand.limits.acceleration};
  if (!outside) {
    demand.start.velocity = std::clamp(demand.start.velocity, -V, V);
  }
  demand.goal.velocity = std::clamp(demand.goal.velocity, -V, V);
  demand.replan = false;
  const ParabolicProfile profile(demand.limits, demand.start, demand.goal);
  std::string law = test::broken_law(profile, demand);
  return law.empty() ? test::broken_optimality(profile.total_time(),
                                               test::ParabolicEffort{V, demand.limits.acceleration},
                                               V, V, demand.start, demand.goal)
                     : law;
}

std::string try_stepper(Random& random, bool outside) {
  const test::ProfileDemand demand = test::random_demand(random, 2, outside);
  const double jump = random.uniform() < 0.2 ? 0.0 : demand.limits.velocity * random.uniform();
  return test::broken_law_of_jumps(StepperProfile(demand.limits, jump, demand.start, demand.goal),
                                   demand);
}

/// The change of a velocity by each profile.
std::string try_velocities(Random& random, bool outside) {
  const test::ProfileDemand demand = test::random_demand(random, 2, outside);
  return test::broken_law_of_velocity_targets(demand);
}

std::string try_exponential(Random& random, bool outside) {
  test::ProfileDemand demand = test::random_demand(random, 2, outside);
  MotorMotionLimits motor{.kV = 12.0 / demand.limits.velocity,
                          .kA = 12.0 / demand.limits.acceleration,
                          .voltage = 12.0,
                          .kS = random.uniform(0.0, 1.0),
                          .kG = random.uniform(-3.0, 3.0)};
  const double top = 8.0 / motor.kV;
  if (random.uniform() < 0.5) {
    motor.current_voltage = random.uniform(5.0, 20.0);
  }
  if (random.uniform() < 0.5) {
    motor.velocity = random.uniform(0.1, 1.0) * top;
  }
  const double most = std::min(top, motor.velocity);
  if (!outside) {
    demand.start.velocity = std::clamp(demand.start.velocity, -most, most);
  }
  demand.goal.velocity = std::clamp(demand.goal.velocity, -most, most);
  demand.replan = false;
  const ExponentialProfile profile(motor, demand.start, demand.goal);
  // At speed it brakes harder than it accelerates from rest.
  const double fastest = std::max(std::abs(demand.start.velocity), 2.0 * demand.limits.velocity);
  demand.limits = {2.0 * demand.limits.velocity, (28.0 + motor.kV * fastest) / motor.kA};
  std::string law = test::broken_law(profile, demand);
  if (!law.empty()) {
    return law;
  }
  constexpr double nearly = 1.0 - 1e-9;  // of the top speed: the profile's own limit
  const double free = motor.voltage - motor.kS;
  return test::broken_optimality(profile.total_time(), test::MotorEffort{motor},
                                 std::min(motor.velocity, nearly * (free - motor.kG) / motor.kV),
                                 std::min(motor.velocity, nearly * (free + motor.kG) / motor.kV),
                                 demand.start, demand.goal);
}

/// @param rest  From rest to rest, which every limit lets be kept.
/// @param kept  Counts those that keep their limits.
std::string try_minimum_jerk(Random& random, bool rest, bool looks_for_shorter, long& kept) {
  test::ProfileDemand demand = test::random_demand(random, 3, false);
  demand.replan = false;
  if (rest) {
    demand.start = {demand.start.position};
    demand.goal = {demand.goal.position};
  }
  const MinimumJerkProfile profile(demand.limits, demand.start, demand.goal);
  if (!profile.keeps_limits()) {
    return rest ? "from rest to rest it breaks the limits" : "";
  }
  ++kept;
  std::string law = test::broken_law(profile, demand);
  if (!law.empty() || profile.total_time() == 0.0) {
    return law;
  }
  if (rest) {
    const MotionLimits all = demand.limits.both_ways();
    const double d = demand.goal.position - demand.start.position;
    const double v = d > 0.0 ? all.velocity : all.reverse_velocity;
    const double a = std::min(all.acceleration, all.deceleration);
    const double best =
        std::max({1.875 * std::abs(d) / v, std::sqrt(10.0 / std::sqrt(3.0) * std::abs(d) / a),
                  std::cbrt(60.0 * std::abs(d) / all.jerk)});
    return std::abs(profile.total_time() - best) <= 2e-9 * best ? "" : "not the shortest";
  }
  constexpr int tries = 30;
  return looks_for_shorter ? test::shorter_polynomial(profile, demand, tries) : law;
}

std::string try_three_axes(Random& random) {
  SynchronizedMotion<3>::Limits limits;
  SynchronizedMotion<3>::States start;
  SynchronizedMotion<3>::States goal;
  test::ProfileDemand demands[3];
  for (std::size_t i = 0; i < 3; ++i) {
    demands[i] = test::random_demand(random, 3, false);
    limits[i] = demands[i].limits;
    start[i] = demands[i].start;
    goal[i] = demands[i].goal;
  }
  const SynchronizedMotion<3> motion(limits, start, goal);
  for (std::size_t i = 0; i < 3; ++i) {
    const JerkMotion& axis = motion.axis(static_cast<int>(i));
    if (std::abs(axis.total_time() - motion.total_time()) > 1e-9 * motion.total_time()) {
      return "an axis ends by itself";
    }
    std::string law = test::broken_law(axis, demands[i]);
    if (!law.empty()) {
      return law;
    }
  }
  return "";
}

void run_campaigns(long count) {
  for (const bool outside : {false, true}) {
    const auto run = [&](const char* inside_name, const char* outside_name, auto&& attempt) {
      campaign(outside ? outside_name : inside_name, count,
               [&](Random& random) { return attempt(random, outside); });
    };
    run("trapezoid", "trapezoid, from outside", try_trapezoid);
    run("s-curve", "s-curve, from outside", try_s_curve);
    run("parabolic", "parabolic, from outside", try_parabolic);
    run("exponential", "exponential, from outside", try_exponential);
    run("stepper", "stepper, from outside", try_stepper);
    run("velocities", "velocities, from outside", try_velocities);
  }
  for (const bool rest : {true, false}) {
    long kept = 0;
    long tried = 0;
    campaign(rest ? "minimum jerk, at rest" : "minimum jerk", count, [&](Random& random) {
      return try_minimum_jerk(random, rest, ++tried % 50 == 0, kept);
    });
    if (tried > 0) {
      std::printf("%-28s %10ld of them can keep their limits\n", "", kept);
    }
  }
  campaign("three axes at once", count / 3, try_three_axes);
}

}  // namespace

int main(int argc, char** argv) {
  if ((argc == 3 || argc == 4) && std::strcmp(argv[1], "--campaign") == 0) {
    only = argc == 4 ? argv[3] : "";
    run_campaigns(std::atol(argv[2]));
    return 0;
  }
  time_all();
  return 0;
}
