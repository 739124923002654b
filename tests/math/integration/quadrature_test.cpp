#include <flyball/math/integration/quadrature.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace flyball::quadrature_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(Quadrature, ClosedForms) {
  EXPECT_NEAR(quadrature([](double x) { return std::exp(x); }, 0.0, 1.0)->value, M_E - 1.0, 1e-15);
  EXPECT_NEAR(quadrature([](double x) { return std::exp(x); }, 1.0, 0.0)->value, 1.0 - M_E, 1e-15);
  // The slope at 0 is infinite, the logarithm is, too.
  EXPECT_NEAR(quadrature([](double x) { return std::sqrt(x); }, 0.0, 1.0)->value, 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(quadrature([](double x) { return std::log(x); }, 0.0, 1.0)->value, -1.0, 1e-12);
  // A kink away from every halving.
  EXPECT_NEAR(quadrature([](double x) { return std::abs(x - 0.3); }, 0.0, 1.0)->value, 0.29, 1e-13);
  EXPECT_EQ(quadrature([](double x) { return x; }, 2.0, 2.0)->value, 0.0);
}

TEST(Quadrature, EndsMayBeInfinite) {
  const auto bell = [](double x) { return std::exp(-x * x); };
  const double root_pi = std::sqrt(M_PI);
  EXPECT_NEAR(quadrature(bell, -infinity, infinity)->value, root_pi, 1e-13);
  EXPECT_NEAR(quadrature(bell, 0.0, infinity)->value, root_pi / 2.0, 1e-13);
  EXPECT_NEAR(quadrature(bell, -infinity, 0.0)->value, root_pi / 2.0, 1e-13);
  EXPECT_NEAR(quadrature(bell, infinity, 0.0)->value, -root_pi / 2.0, 1e-13);
  EXPECT_NEAR(quadrature([](double x) { return 1.0 / (1.0 + x * x); }, -infinity, infinity)->value,
              M_PI, 1e-12);
}

TEST(Quadrature, Refusals) {
  const auto one = [](double) { return 1.0; };
  EXPECT_TRUE(quadrature(one, std::nan(""), 1.0).error().is(ArgumentError::not_finite));
  const auto hole = quadrature([](double x) { return x > 0.5 ? std::nan("") : 1.0; }, 0.0, 1.0);
  ASSERT_FALSE(hole);
  EXPECT_TRUE(hole.error().is(IntegrationError::not_finite));
  EXPECT_GT(hole.error().evidence().front().values.front(), 0.5);
  const auto wild = quadrature([](double x) { return std::sin(1.0 / x) / x; }, 1e-9, 1.0,
                               {.most_evaluations = 3000});
  EXPECT_TRUE(wild.error().is(IntegrationError::too_many_steps));
}

}  // namespace
}  // namespace flyball::quadrature_test
