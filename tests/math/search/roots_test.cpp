#include <flyball/math/search/roots.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

namespace flyball::roots_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// x² = 2, cos x = x (0.739085133215160641655312…), e^x = 1e-5 at ln 1e-5, tan x = 1 at π/4.
TEST(FindRoot, KnownRoots) {
  const auto square = find_root([](double x) { return x * x - 2.0; }, 0.0, 2.0).value();
  EXPECT_NEAR(square.x, std::numbers::sqrt2, 4e-16);
  EXPECT_LT(square.evaluations, 15);
  const auto cosine = find_root([](double x) { return std::cos(x) - x; }, 3.0, -1.0).value();
  EXPECT_NEAR(cosine.x, 0.7390851332151607, 2e-16);
  EXPECT_LT(cosine.low, cosine.high);
  EXPECT_NEAR(find_root([](double x) { return std::exp(x) - 1e-5; }, -700.0, 700.0)->x,
              std::log(1e-5), 4e-15);
  EXPECT_NEAR(find_root([](double x) { return std::tan(x) - 1.0; }, 0.0, 1.5)->x,
              0.25 * std::numbers::pi, 2e-16);
}

// Where interpolation fails: a flat root of order 19, a jump, a root among infinities, and a curve
// that is flat on one side (Newton's and the secant method's worst).
TEST(FindRoot, EndsWithinItsBound) {
  const auto bound = [](auto f, double a, double b, double root, double tolerance) {
    int calls = 0;
    const auto counted = [&](double x) {
      ++calls;
      return f(x);
    };
    const auto found = find_root(counted, a, b, {.absolute_tolerance = tolerance}).value();
    EXPECT_EQ(found.evaluations, calls);
    EXPECT_LE(calls, 3.0 * std::ceil(std::log2(std::abs(b - a) / tolerance)) + 5.0);
    EXPECT_LE(std::abs(found.x - root), 1.01 * tolerance + 4e-16 * std::abs(root));
  };
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const double root = random.uniform(-1.0, 1.0);
    const double tolerance = std::pow(10.0, random.uniform(-14.0, -2.0));
    bound([&](double x) { return x < root ? -1.0 : 1e-9; }, -3.0, 2.0, root, tolerance);
    bound([&](double x) { return x < root ? -infinity : infinity; }, -3.0, 2.0, root, tolerance);
    bound([&](double x) { return std::cbrt(x - root); }, -3.0, 2.0, root, tolerance);
    bound([&](double x) { return std::exp(40.0 * (x - root)) - 1.0; }, -3.0, 2.0, root, tolerance);
    bound([&](double x) { return 1.0 - std::exp(40.0 * (x - root)); }, 2.0, -3.0, root, tolerance);
    bound([&](double x) { return std::atan(1e6 * (x - root)); }, -3.0, 2.0, root, tolerance);
  }
  const auto flat = find_root([](double x) { return std::pow(x - 0.3, 19); }, -1.0, 2.0).value();
  EXPECT_LT(std::abs(std::pow(flat.x - 0.3, 19)), 1e-300);
}

TEST(FindRoot, KnowsTheEnds) {
  int calls = 0;
  const auto f = [&](double x) {
    ++calls;
    return x - 1.0;
  };
  EXPECT_EQ(find_root(f, 1.0, 2.0, 0.0, 1.0)->x, 1.0);
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(find_root(f, 0.0, 4.0, -1.0, 3.0)->x, 1.0);
}

TEST(FindRoot, Refusals) {
  const auto line = [](double x) { return x; };
  EXPECT_TRUE(find_root(line, 1.0, 2.0).error().is(SearchError::no_sign_change));
  EXPECT_EQ(to_string(find_root(line, 1.0, 2.0).error()),
            "find_root: the bracket: the function has one sign at both ends; give two places where "
            "the function has different signs (bracket = [1, 2], values = [1, 2])");
  EXPECT_TRUE(find_root(line, -1.0, infinity).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(find_root(line, -1.0, 1.0, {.absolute_tolerance = -1.0})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(find_root([](double x) { return x < 0.0   ? -1.0
                                              : x > 1.0 ? 1.0
                                                        : NAN; }, -1.0, 2.0)
                  .error()
                  .is(SearchError::not_finite));
  EXPECT_TRUE(find_root([](double) { return NAN; }, -1.0, 2.0).error().is(SearchError::not_finite));
  // Towards zero there is always a smaller double.
  EXPECT_TRUE(find_root([](double x) { return std::cbrt(x); }, -1.0, 2.0)
                  .error()
                  .is(SearchError::no_convergence));
}

}  // namespace
}  // namespace flyball::roots_test
