#include <flyball/simulation/sensor.hpp>

#include <cmath>

#include <gtest/gtest.h>

namespace flyball::sensor_test {
namespace {

Sensor sensor(const SensorModel& model, double step = 1e-3) {
  return Sensor::create(model, Time(step), Random(1)).value();
}

TEST(Sensor, PerfectOneTellsTheTruth) {
  Sensor perfect = sensor({});
  for (const double truth : {1.0, -2.0, 3.5}) {
    perfect.record(truth);
    EXPECT_EQ(perfect.read(), truth);
  }
}

TEST(Sensor, Quantises) {
  Sensor coarse = sensor({.resolution = 0.25});
  coarse.record(0.37);
  EXPECT_EQ(coarse.read(), 0.25);
  coarse.record(-0.38);
  EXPECT_EQ(coarse.read(), -0.5);
}

// A ramp of 10 a second: delayed by 3.5 ms it is 0.035 behind, averaged over 20 ms another 0.1.
TEST(Sensor, DelaysAndAverages) {
  Sensor late = sensor({.delay = Time(3.5e-3)});
  Sensor mean = sensor({.delay = Time(3.5e-3), .moving_average = Time(0.02)});
  for (int i = 0; i <= 100; ++i) {
    late.record(0.01 * i);
    mean.record(0.01 * i);
  }
  EXPECT_NEAR(late.read(), 1.0 - 0.035, 1e-14);
  EXPECT_NEAR(mean.read(), 1.0 - 0.035 - 0.1, 1e-13);
}

// Before its first record the truth was constant.
TEST(Sensor, StartsFromRest) {
  Sensor late = sensor({.delay = Time(1.0), .moving_average = Time(0.5)});
  late.record(4.0);
  EXPECT_DOUBLE_EQ(late.read(), 4.0);
  late.record(5.0);
  EXPECT_DOUBLE_EQ(late.read(), 4.0);
}

// A window half before the start: 10 ms of rest at zero and the ramp's first 10 ms, whose mean is
// 0.05, so 0.025.
TEST(Sensor, AveragesAcrossTheStart) {
  Sensor mean = sensor({.moving_average = Time(0.02)});
  for (int i = 0; i <= 10; ++i) {
    mean.record(0.01 * i);
  }
  EXPECT_NEAR(mean.read(), 0.025, 1e-15);
}

// With a refresh of 20 ms and records each 5 ms every fourth reading is new.
TEST(Sensor, HoldsBetweenRefreshes) {
  Sensor slow = sensor({.refresh = Time(0.02)}, 5e-3);
  for (int i = 0; i < 40; ++i) {
    slow.record(i);
    EXPECT_EQ(slow.read(), i - i % 4) << i;
  }
}

// A refresh that the clock cannot count is none.
TEST(Sensor, RefreshesOfNoLength) {
  for (const double refresh : {1e-25, 1e-300, 5e-324}) {
    Sensor quick = sensor({.refresh = Time(refresh)}, 5e-3);
    for (int i = 0; i < 5; ++i) {
      quick.record(i);
      EXPECT_EQ(quick.read(), i) << refresh;
    }
  }
}

// Noise has its standard deviation, comes once a refresh, and is the same for the same seed.
TEST(Sensor, NoiseIsSeeded) {
  Sensor noisy = sensor({.noise = 0.3});
  Sensor again = sensor({.noise = 0.3});
  double squares = 0.0;
  constexpr int samples = 20000;
  for (int i = 0; i < samples; ++i) {
    noisy.record(0.0);
    again.record(0.0);
    const double value = noisy.read();
    ASSERT_EQ(value, noisy.read());
    ASSERT_EQ(value, again.read());
    squares += value * value;
  }
  EXPECT_NEAR(std::sqrt(squares / samples), 0.3, 0.3 * 0.02);
}

TEST(Sensor, Errors) {
  const auto create = [](const SensorModel& model, double step) {
    return Sensor::create(model, Time(step), Random(1));
  };
  EXPECT_TRUE(create({.resolution = -1.0}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.noise = std::nan("")}, 1.0).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(create({.delay = Time(-1.0)}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.refresh = Time(-1.0)}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({.moving_average = Time(-1.0)}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create({}, 0.0).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::sensor_test
