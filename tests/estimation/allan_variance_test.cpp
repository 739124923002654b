// Allan deviations: NIST's test record, noises that are known, what is refused.
#include <flyball/estimation/allan_variance.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::allan_variance_test {
namespace {

double at(const std::vector<AllanPoint>& points, double tau) {
  for (const AllanPoint& point : points) {
    if (std::abs(point.tau - tau) < 1e-9 * tau) {
      return point.deviation;
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// Riley, NIST SP 1065 (2008), tables 30 and 31: the 1000-point set n' = 16807 n mod 2147483647 from
// 1234567890, over 2147483647, with its overlapping Allan deviations.
TEST(AllanDeviation, OfNistsTestRecord) {
  std::vector<double> readings;
  long long n = 1234567890;
  for (int k = 0; k < 1000; ++k) {
    readings.push_back(static_cast<double>(n) / 2147483647.0);
    n = 16807 * n % 2147483647;
  }
  const auto points = allan_deviation(readings, 1.0);
  ASSERT_TRUE(points) << to_string(points.error());
  EXPECT_NEAR(at(*points, 1.0), 2.922319e-1, 1e-7);
  EXPECT_NEAR(at(*points, 10.0), 9.159953e-2, 1e-8);
  EXPECT_NEAR(at(*points, 100.0), 3.241343e-2, 1e-8);
}

// A ramp y = c t: neighbouring averages over τ differ by c τ, so that σ = c τ/√2.
TEST(AllanDeviation, OfARamp) {
  std::vector<double> readings;
  for (int k = 0; k < 200; ++k) {
    readings.push_back(3.0 + 0.02 * k);
  }
  const auto points = allan_deviation(readings, 0.5);
  ASSERT_TRUE(points);
  for (const AllanPoint& point : *points) {
    EXPECT_NEAR(point.deviation, 0.04 * point.tau / std::sqrt(2.0), 1e-12);
  }
}

// White noise of N = 0.01, a bias that walks with K = 0.002, sampled at 100 Hz for 1000 s: the fit
// finds both within the error of its points.
TEST(AllanDeviation, FindsTheNoisesOfAGyroscope) {
  Random random(7);
  constexpr double T = 0.01;
  std::vector<double> readings;
  double bias = 0.1;
  for (int k = 0; k < 100000; ++k) {
    bias += 0.002 * std::sqrt(T) * random.normal();
    readings.push_back(bias + 0.01 / std::sqrt(T) * random.normal());
  }
  const auto points = allan_deviation(readings, T);
  ASSERT_TRUE(points);
  EXPECT_NEAR(at(*points, T), 0.1, 3e-4 * 3.0);
  const auto noise = fit_allan_deviation(*points);
  ASSERT_TRUE(noise) << to_string(noise.error());
  EXPECT_NEAR(noise->random_walk, 0.01, 2e-4);
  EXPECT_NEAR(noise->bias_random_walk, 0.002, 4e-4);
  EXPECT_LT(noise->bias_instability, 0.003);
  EXPECT_LT(noise->quantization, 2e-4);
}

TEST(AllanDeviation, TheFitIsExactOnItsOwnCurve) {
  std::vector<AllanPoint> points;
  for (int k = 0; k < 30; ++k) {
    const double tau = 0.01 * std::pow(1.5, k);
    const double variance = 3.0 * 4e-8 / (tau * tau) + 1e-4 / tau +
                            2.0 * std::log(2.0) / std::numbers::pi * 9e-6 + 4e-6 * tau / 3.0;
    points.push_back({tau, std::sqrt(variance), 0.1});
  }
  const auto noise = fit_allan_deviation(points);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->quantization, 2e-4, 1e-9);
  EXPECT_NEAR(noise->random_walk, 1e-2, 1e-8);
  EXPECT_NEAR(noise->bias_instability, 3e-3, 1e-7);
  EXPECT_NEAR(noise->bias_random_walk, 2e-3, 1e-8);
}

TEST(AllanDeviation, RefusesWhatItCannotUse) {
  std::vector<double> readings(17, 1.0);
  EXPECT_EQ(to_string(allan_deviation(readings, 0.01).error()),
            "allan_deviation: readings is 17 of them; it must be 18 at least");
  readings.resize(30, std::numeric_limits<double>::infinity());
  EXPECT_NE(to_string(allan_deviation(readings, 0.01).error()).find("readings(17)"),
            std::string::npos);
  EXPECT_FALSE(allan_deviation(readings, 0.0));
  EXPECT_FALSE(allan_deviation(readings, 0.01, 0));
  EXPECT_FALSE(fit_allan_deviation(std::vector<AllanPoint>(3, {1.0, 1.0, 0.1})));
  EXPECT_FALSE(fit_allan_deviation(std::vector<AllanPoint>(5, {1.0, 0.0, 0.1})));
}

}  // namespace
}  // namespace flyball::allan_variance_test
