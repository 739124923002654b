#include <flyball/math/probability/distributions.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace flyball::distributions_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// P(1, x) = 1 - e⁻ˣ and P(1/2, x) = erf √x.
TEST(Distributions, GammaRatioHasItsClosedForms) {
  for (const double x : {1e-8, 0.1, 0.9, 1.9, 2.1, 10.0, 200.0}) {
    EXPECT_NEAR(lower_gamma_ratio(1.0, x), -std::expm1(-x), 1e-14);
    EXPECT_NEAR(upper_gamma_ratio(1.0, x) / std::exp(-x), 1.0, 1e-12);
    EXPECT_NEAR(lower_gamma_ratio(0.5, x), std::erf(std::sqrt(x)), 1e-14);
  }
  EXPECT_NEAR(lower_gamma_ratio(1e5, 1e5), 0.5 + 1.0 / (3.0 * std::sqrt(2e5 * M_PI)), 1e-8);
}

// I_x(a, 1) = xᵃ, I_x(1, b) = 1 - (1 - x)ᵇ, and the symmetry.
TEST(Distributions, BetaRatioHasItsClosedForms) {
  for (const double x : {0.0, 1e-6, 0.2, 0.5, 0.9, 1.0}) {
    EXPECT_NEAR(beta_ratio(2.5, 1.0, x), std::pow(x, 2.5), 1e-14);
    EXPECT_NEAR(beta_ratio(1.0, 3.5, x), 1.0 - std::pow(1.0 - x, 3.5), 1e-14);
    EXPECT_NEAR(beta_ratio(2.0, 7.0, x) + beta_ratio(7.0, 2.0, 1.0 - x), 1.0, 1e-14);
  }
}

// Two degrees of freedom: tail e^(-x/2). Tables: χ²(0.05; 10) = 18.307, F(0.05; 3, 20) = 3.0984.
TEST(Distributions, TailsAreThoseOfTheTables) {
  EXPECT_NEAR(chi_squared_tail(5.0, 2.0), std::exp(-2.5), 1e-15);
  EXPECT_NEAR(chi_squared_tail(18.307038, 10.0), 0.05, 1e-8);
  EXPECT_NEAR(f_tail(3.0983912, 3.0, 20.0), 0.05, 1e-8);
}

// Tables: χ²(0.95; 1) = 1.959964², χ²(0.95; 2) = -2 ln 0.05, χ²(0.99; 3) = 11.3449, and the inverse
// of the tail.
TEST(Distributions, ChiSquaredQuantileIsTheInverseOfItsTail) {
  EXPECT_NEAR(chi_squared_quantile(0.95, 1.0), std::pow(normal_quantile(0.975), 2), 1e-12);
  EXPECT_NEAR(chi_squared_quantile(0.95, 2.0), -2.0 * std::log(0.05), 1e-13);
  EXPECT_NEAR(chi_squared_quantile(0.99, 3.0), 11.344866730144373, 1e-10);
  for (const double freedom : {0.3, 1.0, 4.0, 77.0, 5000.0}) {
    for (const double p : {1e-12, 0.01, 0.4999, 0.5, 0.9, 1.0 - 1e-12}) {
      const double x = chi_squared_quantile(p, freedom);
      EXPECT_NEAR(lower_gamma_ratio(0.5 * freedom, 0.5 * x) / p, 1.0, 1e-9) << p << ' ' << freedom;
      EXPECT_NEAR(chi_squared_tail(x, freedom) / (1.0 - p), 1.0, 1e-9) << p << ' ' << freedom;
    }
  }
  EXPECT_EQ(chi_squared_quantile(0.0, 2.0), 0.0);
  EXPECT_EQ(chi_squared_quantile(1.0, 2.0), infinity);
  EXPECT_TRUE(std::isnan(chi_squared_quantile(-0.1, 2.0)));
  EXPECT_TRUE(std::isnan(chi_squared_quantile(0.5, 0.0)));
}

TEST(Distributions, NormalDensityIsTheFormula) {
  EXPECT_NEAR(normal_pdf(0.0), 1.0 / std::sqrt(2.0 * M_PI), 1e-16);
  EXPECT_NEAR(normal_pdf(2.5, 1.0, 2.0), std::exp(-0.28125) / (2.0 * std::sqrt(2.0 * M_PI)), 1e-16);
  EXPECT_NEAR(normal_log_pdf(100.0), -5000.0 - 0.5 * std::log(2.0 * M_PI), 1e-12);
  EXPECT_TRUE(std::isnan(normal_pdf(0.0, 0.0, 0.0)));
}

// One degree of freedom: tan(π(p - 1/2)). Two: (2p - 1)/√(2p(1 - p)). None to count: the normal's.
TEST(Distributions, StudentsQuantilesHaveTheirClosedForms) {
  for (const double p : {1e-9, 0.025, 0.3, 0.5, 0.975}) {
    EXPECT_NEAR(student_quantile(p, 1.0) / std::tan(M_PI * (p - 0.5) + (p == 0.5 ? 1e-300 : 0.0)),
                1.0, p == 0.5 ? infinity : 1e-7);
    EXPECT_NEAR(student_quantile(p, 2.0), (2.0 * p - 1.0) / std::sqrt(2.0 * p * (1.0 - p)),
                1e-7 * std::abs(student_quantile(p, 2.0)) + 1e-15);
    EXPECT_NEAR(student_cdf(student_quantile(p, 7.3), 7.3), p, 1e-14);
  }
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(student_quantile(0.975, 1e9), 1.959963984540054, 1e-8);
}

TEST(Distributions, WhatIsNoProbabilityIsNoNumber) {
  EXPECT_TRUE(std::isnan(student_quantile(1.1, 3.0)));
  EXPECT_TRUE(std::isnan(beta_ratio(1.0, 1.0, 2.0)));
  EXPECT_TRUE(std::isnan(lower_gamma_ratio(-1.0, 2.0)));
  EXPECT_TRUE(std::isnan(f_tail(std::nan(""), 2.0, 2.0)));
  EXPECT_EQ(normal_quantile(0.0), -infinity);
  EXPECT_EQ(normal_quantile(1.0), infinity);
}

}  // namespace
}  // namespace flyball::distributions_test
