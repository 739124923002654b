#include <flyball/math/search/minimum.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::minimum_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// cosh(x - 0.7) + 1; x^x, smallest at 1/e with e^{-1/e}; a parabola, found by the first parabola.
TEST(FindMinimum, KnownMinima) {
  const auto curve = find_minimum([](double x) { return std::cosh(x - 0.7) + 1.0; }, -3.0, 5.0);
  EXPECT_NEAR(curve->x, 0.7, 4e-8);
  EXPECT_EQ(curve->value, 2.0);
  EXPECT_LE(curve->low, curve->x);
  EXPECT_GE(curve->high, curve->x);
  const auto power = find_minimum([](double x) { return std::pow(x, x); }, 0.0, 2.0);
  EXPECT_NEAR(power->x, 1.0 / std::numbers::e, 1e-8);
  EXPECT_NEAR(power->value, std::exp(-1.0 / std::numbers::e), 2e-16);
  EXPECT_LT(power->evaluations, 60);
  EXPECT_EQ(find_minimum([](double x) { return (x - 3.0) * (x - 3.0); }, 0.0, 10.0)->value, 0.0);
}

// A kink is found to the tolerance, whatever the slopes beside it; a minimum at an end is that end.
TEST(FindMinimum, KinksAndEnds) {
  Random random(11);
  for (int trial = 0; trial < 200; ++trial) {
    const double place = random.uniform(0.1, 1.0);
    const double slope = std::pow(10.0, random.uniform(-3.0, 3.0));
    const auto kink = find_minimum(
        [&](double x) { return x < place ? place - x : slope * (x - place); }, -1.0, 2.0);
    EXPECT_NEAR(kink->x, place, 4e-12);
    EXPECT_LT(kink->evaluations, 200);
    const auto wall = find_minimum(
        [&](double x) { return x < place ? infinity : std::sqrt(x - place); }, -1.0, 2.0);
    EXPECT_NEAR(wall->x, place, 4e-12);
  }
  EXPECT_NEAR(find_minimum([](double x) { return x; }, 2.0, 3.0)->x, 2.0, 1e-11);
  EXPECT_NEAR(find_minimum([](double x) { return -x; }, 2.0, 3.0)->x, 3.0, 1e-11);
  EXPECT_TRUE(find_minimum([](double) { return 7.0; }, 2.0, 3.0).has_value());
  EXPECT_NEAR(find_minimum([](double x) { return std::abs(x - 1.0); }, 0.0, 5.0,
                           {.absolute_tolerance = 0.1})
                  ->x,
              1.0, 0.11);
}

TEST(FindMinimum, Refusals) {
  const auto square = [](double x) { return x * x; };
  EXPECT_TRUE(find_minimum(square, 0.0, infinity).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(find_minimum(square, 1.0, 2.0, {.relative_tolerance = 2.0})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      find_minimum([](double) { return NAN; }, 0.0, 1.0).error().is(SearchError::not_finite));
  EXPECT_TRUE(find_minimum([](double x) { return x < 0.5 ? x : NAN; }, 0.0, 1.0)
                  .error()
                  .is(SearchError::not_finite));
  EXPECT_TRUE(find_minimum(square, 0.0, 1.0, {.most_evaluations = 5})
                  .error()
                  .is(SearchError::no_convergence));
  EXPECT_EQ(to_string(find_minimum(square, 1.0, 1.0).error()),
            "find_minimum: the interval is from 1 to 1; it must be increasing");
}

}  // namespace
}  // namespace flyball::minimum_test
