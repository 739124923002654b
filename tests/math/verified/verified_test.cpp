#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "math/verified/common_lyapunov.hpp"
#include "math/verified/contraction.hpp"

namespace flyball::detail::verified_test {
namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Whether `range` holds near + rest, where near is the rounded value and rest what rounding took.
bool holds(const Interval& range, double near, double rest) {
  return range.low - near <= rest && rest <= range.high - near;
}

// What rounding took is known exactly: of a sum by Knuth's two-sum, of a product by a fused one.
// Without outward rounding most of these fail.
TEST(Interval, HoldsExactSumsAndProducts) {
  Random random(1);
  int inexact = 0;
  for (int k = 0; k < 20000; ++k) {
    const double x = std::ldexp(uniform(random, -1.0, 1.0), static_cast<int>(random() % 40));
    const double y = uniform(random, -1.0, 1.0);
    const double sum = x + y;
    const double back = sum - x;
    const double lost = (x - (sum - back)) + (y - back);
    EXPECT_TRUE(holds(Interval(x) + Interval(y), sum, lost)) << x << " " << y;
    const double product = x * y;
    const double missed = std::fma(x, y, -product);
    EXPECT_TRUE(holds(Interval(x) * Interval(y), product, missed)) << x << " " << y;
    const Interval quotient = Interval(x) / Interval(y);
    EXPECT_TRUE((quotient * Interval(y)).contains(x));
    EXPECT_LE(quotient.high - quotient.low, 9e-16 * std::abs(x / y));
    inexact += lost != 0.0 || missed != 0.0 ? 1 : 0;
  }
  EXPECT_GT(inexact, 10000);
}

// e = 2.718281828459045 + 1.4456468917292502e-16.
TEST(Interval, ExponentialHoldsE) {
  const Interval e = exp(1.0);
  EXPECT_TRUE(holds(e, 2.718281828459045, 1.4456468917292502e-16));
  EXPECT_LT(e.high - e.low, 1e-13);
  Random random(2);
  for (int k = 0; k < 2000; ++k) {
    const double x = uniform(random, -60.0, 60.0);
    EXPECT_TRUE((exp(x) * exp(-x)).contains(1.0)) << x;
    EXPECT_TRUE(exp(x).contains(std::exp(x))) << x;
  }
  EXPECT_EQ(exp(-1e4).low, 0.0);
  EXPECT_LT(exp(-1e4).high, 1e-300);
  EXPECT_EQ(exp(1e4).high, std::numeric_limits<double>::infinity());
}

/// Of the polynomial part of a form at ε, in extended precision.
long double at(const TaylorForm& x, const std::array<double, 2>& epsilon) {
  long double value = x.centre;
  for (std::size_t i = 0; i < 2; ++i) {
    value += static_cast<long double>(x.slope[i]) * epsilon[i];
    for (std::size_t j = i; j < 2; ++j) {
      value += static_cast<long double>(x.square[square_index(i, j)]) * epsilon[i] * epsilon[j];
    }
  }
  return value;
}

// e^{-0.3 p} (p + q)/q and its like, over boxes from wide to a point; there only the rounding is
// left, which the radius must hold: on x86 the reference has eleven bits more.
TEST(TaylorForm, HoldsFunctionsOfTheBox) {
  Random random(3);
  int strict = 0;
  for (int k = 0; k < 4000; ++k) {
    const double half = k % 4 == 0 ? 0.0 : std::pow(10.0, uniform(random, -6.0, -0.5));
    const double p_0 = uniform(random, -2.0, 2.0);
    const double q_0 = uniform(random, 1.0, 3.0);
    const TaylorForm p = TaylorForm::parameter(0, p_0, half);
    const TaylorForm q = TaylorForm::parameter(1, q_0, half);
    const TaylorForm y = exp(-(TaylorForm(0.3) * p)) * (p + q) * reciprocal(q);
    const std::array<double, 2> epsilon{uniform(random, -1.0, 1.0), uniform(random, -1.0, 1.0)};
    const long double exact_p = p_0 + static_cast<long double>(half) * epsilon[0];
    const long double exact_q = q_0 + static_cast<long double>(half) * epsilon[1];
    const long double exact =
        std::exp(-(static_cast<long double>(0.3) * exact_p)) * (exact_p + exact_q) / exact_q;
    const long double miss = std::abs(at(y, epsilon) - exact);
    EXPECT_LE(miss, y.radius * (1.0L + 1e-3L)) << half;
    strict += miss > 1e-17L ? 1 : 0;
  }
  EXPECT_GT(strict, 3000);
}

// What is left is of the third order.
TEST(TaylorForm, RadiusFallsWithTheCube) {
  const auto radius = [](double half) {
    const TaylorForm p = TaylorForm::parameter(0, 0.7, half);
    return (exp(p) * reciprocal(p)).radius;
  };
  EXPECT_NEAR(radius(0.02) / radius(0.01), 8.0, 0.5);
}

TEST(FormMatrix, ExponentialOfANilpotentAndOfADiagonal) {
  // [0 p; 0 0] has e^H = [1 p; 0 1]; diag(p) has e^p.
  FormMatrix H(2, 2);
  H(0, 1) = TaylorForm::parameter(0, 3.0, 0.5);
  const FormMatrix E = *exponential(H);
  EXPECT_TRUE(E(0, 1).range().contains(2.5) && E(0, 1).range().contains(3.5));
  EXPECT_LT(E(0, 1).radius, 1e-13);
  EXPECT_NEAR(E(0, 1).slope[0], 0.5, 1e-15);
  FormMatrix D(1, 1);
  D(0, 0) = TaylorForm::parameter(0, -1.0, 0.1);
  const TaylorForm e = (*exponential(D))(0, 0);
  for (const double x : {-1.1, -1.0, -0.95, -0.9}) {
    EXPECT_TRUE(e.range().contains(std::exp(x)));
  }
  EXPECT_LT(e.deviation(), 0.042);
  D(0, 0) = TaylorForm(1e9);
  EXPECT_FALSE(exponential(D).has_value());
}

TEST(FormMatrix, SolvesAndRefusesASingularMember) {
  FormMatrix E(2, 2);
  E(0, 0) = TaylorForm(2.0);
  E(0, 1) = TaylorForm::parameter(0, 1.0, 0.1);
  E(1, 1) = TaylorForm(4.0);
  const FormMatrix X = *solve(E, FormMatrix(Eigen::MatrixXd::Identity(2, 2)));
  EXPECT_TRUE(X(0, 1).range().contains(-0.9 / 8.0) && X(0, 1).range().contains(-1.1 / 8.0));
  EXPECT_LT(X(0, 1).deviation(), 0.02);
  E(1, 1) = TaylorForm::parameter(1, 1.0, 1.0);
  EXPECT_FALSE(solve(E, E).has_value());
}

MatrixFamily scalar_family(double centre, double slope) {
  FormMatrix M(1, 1);
  M(0, 0) = TaylorForm::parameter(0, centre, slope);
  return family_of(M);
}

// |0.5 ± s| < 1 for s < 0.5 and for no other; a bound within rounding of one is not shown.
TEST(Contraction, IsDecidedAtTheVertices) {
  const Eigen::MatrixXd T = Eigen::MatrixXd::Identity(1, 1);
  EXPECT_TRUE(contracts(scalar_family(0.5, 0.4999999999), T));
  EXPECT_FALSE(contracts(scalar_family(0.5, 0.5), T));
  EXPECT_FALSE(contracts(scalar_family(0.5, 0.5000000001), T));
  EXPECT_TRUE(contracts(scalar_family(1.0 - 1e-12, 0.0), T));
  EXPECT_FALSE(contracts(scalar_family(1.0 - 1e-16, 0.0), T));
  EXPECT_FALSE(contracts(scalar_family(0.5, 0.1), Eigen::MatrixXd::Zero(1, 1)));
}

// What is not at a vertex counts whole: 0.5 ± 0.4 ± rest is below one for a rest below 0.1, be it
// in a square, in the radius or in both, in any coordinates.
TEST(Contraction, SquaresAndRemaindersCount) {
  const auto with = [](double square, double radius) {
    MatrixFamily family = scalar_family(0.5, 0.4);
    family.squares.push_back(Eigen::MatrixXd::Constant(1, 1, square));
    family.pairs.push_back({0, 0});
    family.radius.setConstant(radius);
    return family;
  };
  for (const double scale : {1.0, 1e-3, 1e3}) {
    const Eigen::MatrixXd T = Eigen::MatrixXd::Constant(1, 1, scale);
    EXPECT_TRUE(contracts(with(0.0999, 0.0), T));
    EXPECT_FALSE(contracts(with(0.1001, 0.0), T));
    EXPECT_FALSE(contracts(with(-0.1001, 0.0), T));
    EXPECT_TRUE(contracts(with(0.0, 0.0999), T));
    EXPECT_FALSE(contracts(with(0.0, 0.1001), T));
    EXPECT_TRUE(contracts(with(0.05, 0.0499), T));
    EXPECT_FALSE(contracts(with(0.05, 0.0501), T));
  }
  // In two states the radius is any matrix within it: of [0 r; r 0] added to 0.9 I the norm is
  // 0.9 + r; in coordinates diag(1, 10) it is ten times as large.
  MatrixFamily plane = family_of(FormMatrix(Eigen::MatrixXd(0.9 * Eigen::Matrix2d::Identity())));
  plane.radius = Eigen::MatrixXd{{0.0, 0.0}, {0.09, 0.0}};
  EXPECT_TRUE(contracts(plane, Eigen::MatrixXd::Identity(2, 2)));
  EXPECT_FALSE(contracts(plane, Eigen::MatrixXd{{1.0, 0.0}, {0.0, 10.0}}));
  // Nor is an instability sure that a square or the radius may take back.
  MatrixFamily away = scalar_family(1.5, 0.2);
  EXPECT_TRUE(surely_unstable(away));
  away.radius.setConstant(0.4);
  EXPECT_FALSE(surely_unstable(away));
  away.radius.setZero();
  away.squares.push_back(Eigen::MatrixXd::Constant(1, 1, 0.4));
  away.pairs.push_back({0, 0});
  EXPECT_FALSE(surely_unstable(away));
}

TEST(Contraction, InstabilityIsProvenBeyondRounding) {
  EXPECT_TRUE(surely_unstable(scalar_family(1.0 + 1e-9, 0.0)));
  EXPECT_TRUE(surely_unstable(scalar_family(-1.5, 0.1)));
  EXPECT_FALSE(surely_unstable(scalar_family(-1.5, 0.6)));
  EXPECT_FALSE(surely_unstable(scalar_family(0.999, 0.0)));
  EXPECT_FALSE(surely_unstable(scalar_family(1.0 + 1e-16, 0.0)));
}

// Each of the two is nilpotent to 0.45, their product doubles twice: no common function exists.
TEST(CommonLyapunov, IsFoundIfThereIsOne) {
  const Eigen::MatrixXd A{{0.0, 2.0}, {0.1, 0.0}};
  const Eigen::MatrixXd B{{0.0, 0.1}, {2.0, 0.0}};
  const auto any = [](const Eigen::MatrixXd&) { return true; };
  LyapunovSearch search;
  EXPECT_FALSE(common_lyapunov({A, B}, 0, search, any).has_value());
  EXPECT_LE(search.steps, search.most_steps);
  // Shears that P = diag(1, s) bears with s near 4, and P = I does not.
  const Eigen::MatrixXd up{{0.5, 1.2}, {0.0, 0.5}};
  const Eigen::MatrixXd down{{0.5, 0.0}, {-0.1, 0.5}};
  LyapunovSearch other;
  const auto T = common_lyapunov({up, down}, 0, other, any);
  ASSERT_TRUE(T.has_value());
  EXPECT_GT(other.steps, 0);
  for (const Eigen::MatrixXd& M : {up, down}) {
    EXPECT_TRUE(contracts(family_of(FormMatrix(M)), *T));
  }
}

}  // namespace
}  // namespace flyball::detail::verified_test
