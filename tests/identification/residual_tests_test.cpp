#include <flyball/identification/residual_tests.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::identification::residual_tests_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> noise(std::size_t count, double memory, unsigned long long seed) {
  Random random(seed);
  std::vector<double> made;
  double last = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    last = memory * last + random.normal();
    made.push_back(last);
  }
  return made;
}

// Signs by turns: Σ r(t) r(t + k) is ±(N - k), of N. Q = N (N + 2) Σ ((N - k)/N)²/(N - k)
// = (N + 2)/N Σ (N - k), k = 1, 2.
TEST(ResidualTests, LjungAndBoxOfSignsByTurns) {
  std::vector<std::vector<double>> runs(1);
  for (int i = 0; i < 20; ++i) {
    runs[0].push_back(i % 2 == 0 ? 1.0 : -1.0);
  }
  const Whiteness found = whiteness_of(runs, 2);
  ASSERT_EQ(found.autocorrelation.size(), 2U);
  EXPECT_DOUBLE_EQ(found.autocorrelation[0], -19.0 / 20.0);
  EXPECT_DOUBLE_EQ(found.autocorrelation[1], 18.0 / 20.0);
  EXPECT_NEAR(found.statistic, 22.0 / 20.0 * (19.0 + 18.0), 1e-12);
  EXPECT_NEAR(found.p_value, std::exp(-0.5 * found.statistic), 1e-15);
  EXPECT_FALSE(found.is_white());
}

// Of white noise a twentieth is below 0.05, two standard deviations either way.
TEST(ResidualTests, WhiteNoiseIsWhiteAsOftenAsItIsSaid) {
  int below = 0;
  for (unsigned long long seed = 1; seed <= 400; ++seed) {
    const std::vector<std::vector<double>> runs{noise(300, 0.0, seed)};
    below += whiteness_of(runs).p_value < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(below, 20, 10);
}

TEST(ResidualTests, MemoryIsSeenAndMeasured) {
  const std::vector<std::vector<double>> runs{noise(4000, 0.8, 3), noise(4000, 0.8, 4)};
  const Whiteness found = whiteness_of(runs);
  EXPECT_NEAR(found.autocorrelation[0], 0.8, 0.03);
  EXPECT_NEAR(found.autocorrelation[1], 0.64, 0.05);
  EXPECT_LT(found.p_value, 1e-12);
  EXPECT_GE(found.correlated_lags, 10U);  // 0.8^k falls below 2/√8000 at 17
  EXPECT_LE(found.correlated_lags, 40U);
}

// A missing one takes no part; runs do not touch.
TEST(ResidualTests, MissingOnesAndEndsOfRunsMakeNoPairs) {
  const std::vector<std::vector<double>> apart{{1, 1, nan, 1, 1}, {1, 1, nan, 1, 1}};
  const Whiteness found = whiteness_of(apart, 1);
  EXPECT_EQ(found.samples, 8U);
  EXPECT_DOUBLE_EQ(found.autocorrelation[0], 4.0 / 8.0);
  EXPECT_EQ(whiteness_of(std::vector<std::vector<double>>{}).p_value, 1.0);
}

}  // namespace
}  // namespace flyball::identification::residual_tests_test
