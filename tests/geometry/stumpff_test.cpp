#include <flyball/geometry/stumpff.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace flyball::detail::stumpff_test {
namespace {

/// Σ (-s)^k/(2k + M)! in extended precision; s up to 40 loses 6 digits of 19.
long double series(int m, long double s) {
  long double term = 1.0L;
  for (int i = 2; i <= m; ++i) {
    term /= i;
  }
  long double sum = term;
  for (int k = 0; k < 60; ++k) {
    term *= -s / ((2 * k + m + 1.0L) * (2 * k + m + 2.0L));
    sum += term;
  }
  return sum;
}

template <int M>
void expect_accurate(double roundings) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  for (const double s :
       {0.0, 1e-300, 1e-20,     1e-8, 1e-3,      0.1, 0.2, 0.2499999, 0.25, 0.2500001, 0.5, 1.0,
        2.0, 3.0,    3.9999999, 4.0,  4.0000001, 5.0, 7.0, 9.0,       9.86, 12.0,      20.0}) {
    const double exact = static_cast<double>(series(M, static_cast<long double>(s)));
    // sin and cos pass zero, where only the absolute error is small.
    const double size = M <= 1 ? 1.0 : std::abs(exact);
    EXPECT_NEAR(stumpff<M>(s), exact, roundings * eps * size) << M << ' ' << s;
  }
}

TEST(Stumpff, AgainstTheSeries) {
  expect_accurate<0>(2);
  expect_accurate<1>(2);
  expect_accurate<2>(3);
  expect_accurate<3>(4);
  expect_accurate<4>(6);
  expect_accurate<5>(8);
}

// (1 - (θ/2) cot(θ/2))/θ² at θ = 1, 2, 3, from mpmath: (1 - t/2*cot(t/2))/t**2.
TEST(Stumpff, InverseJacobianCoefficient) {
  EXPECT_NEAR(inverse_jacobian_coefficient(0.0), 1.0 / 12.0, 1e-17);
  EXPECT_NEAR(inverse_jacobian_coefficient(1.0), 0.08475613914377404, 1e-16);
  EXPECT_NEAR(inverse_jacobian_coefficient(4.0), 0.08947684601641732, 1e-16);
  EXPECT_NEAR(inverse_jacobian_coefficient(9.0), 0.09929197039400233, 2e-16);
}

}  // namespace
}  // namespace flyball::detail::stumpff_test
