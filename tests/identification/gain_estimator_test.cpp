#include <flyball/identification/gain_estimator.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/core/signal.hpp>

#include "support/allocation_count.hpp"

namespace flyball::identification::gain_estimator_test {
namespace {

using mechanisms::FeedforwardGains;
using mechanisms::MechanismKind;

/// A mechanism with friction, 1000 steps a sample; the voltage swings slowly and steps.
struct Rig {
  MechanismKind kind = MechanismKind::flywheel;
  FeedforwardGains gains{};
  double noise = 0.0;
  double delay = 0.0;  ///< s, whole steps of 1 ms.
  double period = 0.02;
  Random random{1};
  double position = 0.3;
  double velocity = 0.0;
  double time = 0.0;
  std::vector<double> past{};

  double voltage() const {
    const double wave = 7.0 * std::sin(0.9 * time) + (std::fmod(time, 2.0) < 1.0 ? 3.0 : -3.0);
    const double hold = kind == MechanismKind::flywheel ? 0.0 : gains.kG;
    return std::clamp(wave + hold, -12.0, 12.0);
  }
  void advance(double u) {
    constexpr double step = 1e-3;
    for (int i = 0; i < static_cast<int>(std::lround(period / step)); ++i) {
      const double load = u - gains.gravity_voltage(kind, position);
      const double friction = velocity != 0.0 ? std::copysign(gains.kS, velocity)
                                              : std::clamp(load, -gains.kS, gains.kS);
      const double before = velocity;
      // Exact for a constant force, so that Euler's step does not count.
      const double rate = gains.kV / gains.kA;
      const double end = (load - friction) / gains.kV;
      velocity = end + (velocity - end) * std::exp(-rate * step);
      if (before != 0.0 && before * velocity < 0.0 && std::abs(load) < gains.kS) {
        velocity = 0.0;
      }
      position += 0.5 * step * (before + velocity);
      past.push_back(velocity);
      time += step;
    }
  }
  double measured() {
    const auto back = static_cast<std::size_t>(std::lround(delay / 1e-3));
    const double value = past.size() > back ? past[past.size() - 1 - back] : 0.0;
    return value + noise * random.normal();
  }
};

GainEstimatorSettings settings_of(const Rig& rig) {
  GainEstimatorSettings settings;
  settings.mechanism = rig.kind;
  settings.period = rig.period;
  settings.top_speed = 12.0 / rig.gains.kV;
  settings.velocity_delay = rig.delay;
  return settings;
}

GainEstimator run(Rig& rig, const GainEstimatorSettings& settings, double seconds) {
  auto estimator = GainEstimator::create(settings).value();
  for (int k = 0; k < static_cast<int>(seconds / rig.period); ++k) {
    const double u = rig.voltage();
    estimator.update(u, rig.measured(), rig.position);
    rig.advance(u);
  }
  return estimator;
}

void expect_gains(const FeedforwardGains& found, const FeedforwardGains& truth, double share) {
  EXPECT_NEAR(found.kS, truth.kS, share * truth.kS + share * 0.5);
  EXPECT_NEAR(found.kV, truth.kV, share * truth.kV);
  EXPECT_NEAR(found.kA, truth.kA, share * truth.kA);
  EXPECT_NEAR(found.kG, truth.kG, share * truth.kG);
  EXPECT_NEAR(found.angle_offset, truth.angle_offset, share);
}

// Without noise only the straight lines between the samples are not exact.
TEST(GainEstimator, FindsTheGains) {
  Rig flywheel{.kind = MechanismKind::flywheel, .gains = {0.3, 0.02, 0.01}};
  const auto wheel = run(flywheel, settings_of(flywheel), 20.0);
  expect_gains(wheel.gains(), flywheel.gains, 0.01);
  EXPECT_TRUE(wheel.found().all());
  EXPECT_LE(wheel.progress(), 1.0);

  Rig elevator{.kind = MechanismKind::elevator, .gains = {0.4, 3.0, 0.4, 1.1}};
  expect_gains(run(elevator, settings_of(elevator), 20.0).gains(), elevator.gains, 0.01);

  Rig arm{.kind = MechanismKind::arm, .gains = {0.2, 1.5, 0.3, 0.8, 0.25}};
  const auto turning = run(arm, settings_of(arm), 30.0);
  expect_gains(turning.gains(), arm.gains, 0.02);
  EXPECT_TRUE(turning.found().all());
}

TEST(GainEstimator, KnowsOfTheSensorsDelay) {
  Rig rig{.kind = MechanismKind::elevator, .gains = {0.4, 3.0, 0.4, 1.1}, .delay = 0.033};
  expect_gains(run(rig, settings_of(rig), 20.0).gains(), rig.gains, 0.02);
  Rig again{.kind = MechanismKind::elevator, .gains = {0.4, 3.0, 0.4, 1.1}, .delay = 0.033};
  GainEstimatorSettings settings = settings_of(again);
  settings.velocity_delay = 0.0;
  // Unknown, the delay is taken for inertia: kA + kV delay.
  EXPECT_GT(run(again, settings, 20.0).gains().kA, 0.44);
}

// Of 200 noisy runs the intervals hold the truth as often as they say, or more.
TEST(GainEstimator, IntervalsHold) {
  int hold = 0;
  int all = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Rig rig{.kind = MechanismKind::elevator,
            .gains = {0.4, 3.0, 0.4, 1.1},
            .noise = 0.02,
            .random = Random(seed)};
    const auto estimator = run(rig, settings_of(rig), 15.0);
    const FeedforwardGains k = estimator.gains();
    const FeedforwardGains w = estimator.half_widths();
    hold += (std::abs(k.kS - 0.4) <= w.kS) + (std::abs(k.kV - 3.0) <= w.kV) +
            (std::abs(k.kG - 1.1) <= w.kG);
    all += 3;
    EXPECT_NEAR(k.kA, 0.4, 0.04);
    EXPECT_NEAR(k.kV, 3.0, 0.06);
  }
  EXPECT_GE(hold, 0.9 * all);
}

// What the motion does not tell is not found, however long it lasts: a wheel at one speed.
TEST(GainEstimator, SaysWhatItDoesNotKnow) {
  GainEstimatorSettings settings;
  settings.mechanism = MechanismKind::flywheel;
  settings.top_speed = 500.0;
  auto estimator = GainEstimator::create(settings).value();
  EXPECT_FALSE(estimator.found().all());
  EXPECT_GT(estimator.progress(), 1.0);
  Random random(4);
  for (int k = 0; k < 3000; ++k) {
    estimator.update(5.0, 240.0 + 0.5 * random.normal());
  }
  EXPECT_FALSE(estimator.found().kV);
  EXPECT_FALSE(estimator.found().kA);
  EXPECT_GT(estimator.progress(), 1.0);
  // At rest nothing is learnt.
  auto resting = GainEstimator::create(settings).value();
  for (int k = 0; k < 100; ++k) {
    EXPECT_FALSE(resting.update(0.2, 0.0));
  }
  EXPECT_EQ(resting.samples(), 0.0);
}

// A game piece doubles the mass: with a memory of 5 s the gain follows.
TEST(GainEstimator, FollowsAChange) {
  Rig rig{.kind = MechanismKind::elevator, .gains = {0.4, 3.0, 0.4, 1.1}};
  GainEstimatorSettings settings = settings_of(rig);
  settings.memory = 5.0;
  auto estimator = GainEstimator::create(settings).value();
  for (int k = 0; k < 3000; ++k) {
    if (k == 1500) {
      rig.gains.kA = 0.6;
      rig.gains.kG = 1.6;
    }
    const double u = rig.voltage();
    estimator.update(u, rig.measured(), rig.position);
    rig.advance(u);
  }
  expect_gains(estimator.gains(), rig.gains, 0.02);
}

TEST(GainEstimator, StaysFiniteWithoutAllocation) {
  GainEstimatorSettings settings;
  settings.mechanism = MechanismKind::arm;
  settings.top_speed = 8.0;
  settings.memory = 1.0;
  settings.velocity_delay = 0.05;
  auto estimator = GainEstimator::create(settings).value();
  Random random(2);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const test::AllocationCounter allocations;
  bool finite = true;
  for (int k = 0; k < 20'000; ++k) {
    const auto wild = [&] {
      const double which = random.uniform();
      return which < 0.05  ? nan
             : which < 0.1 ? infinity
                           : random.normal() *
                                 std::pow(10.0, random.uniform(-300.0, which < 0.5 ? 2.0 : 300.0));
    };
    estimator.update(wild(), wild(), wild());
    const auto fits = [](const FeedforwardGains& of) {
      return is_signal(of.kS) && is_signal(of.kV) && is_signal(of.kA) && is_signal(of.kG) &&
             is_signal(of.angle_offset);
    };
    finite = finite && fits(estimator.gains()) && fits(estimator.half_widths()) &&
             is_signal(estimator.progress()) && std::isfinite(estimator.residual_deviation());
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  EXPECT_TRUE(finite);
}

TEST(GainEstimator, Refusals) {
  GainEstimatorSettings settings;
  EXPECT_TRUE(GainEstimator::create(settings).error().is(ArgumentError::out_of_range));
  settings.top_speed = 3.0;
  EXPECT_TRUE(GainEstimator::create(settings));
  settings.memory = 0.1;
  EXPECT_EQ(to_string(GainEstimator::create(settings).error()),
            "GainEstimator: memory is 0.1 s; it must be ten periods or longer");
  settings.memory = 5.0;
  settings.filter_time = 1e-3;
  EXPECT_TRUE(GainEstimator::create(settings).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::identification::gain_estimator_test
