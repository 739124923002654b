#include <cmath>

#include <gtest/gtest.h>

#include <flyball/control/pole_placement.hpp>
#include <flyball/core/random.hpp>

#include "math/extended/quad_double.hpp"

// Poles that are nothing beside the plant and the other poles: the last digits of K move them by
// more than they are. Each counts relative to itself.
namespace flyball::pole_placement_small_poles_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

/// Σ 1/λ of A - BK, its smallest pole's almost alone, in 60 digits.
double inverse_trace(const MatrixXd& A, const MatrixXd& B, const MatrixXd& K) {
  using detail::QuadDoubleMatrix;
  const auto closed =
      detail::add_product(QuadDoubleMatrix(A), -1.0, QuadDoubleMatrix(B), QuadDoubleMatrix(K));
  return detail::solve(closed, QuadDoubleMatrix::identity(A.rows())).value().rounded().trace();
}

double inverse_sum(const Eigen::VectorXcd& poles) {
  return poles.cwiseInverse().sum().real();
}

double largest_error(const Eigen::VectorXcd& got, const Eigen::VectorXcd& wanted) {
  return (got - wanted).cwiseQuotient(wanted).cwiseAbs().maxCoeff();
}

// One input: K is the only one, its last digits are 1e-9, and the pole at -1e-7 ends at -3.6e-4
// (mpmath 1.3, eig at 60 digits: -0.000362561530293).
TEST(PlaceSmallPoles, WhatNoDoublesReachIsRefused) {
  const MatrixXd A{{-162.0, -0.54, -1934000.0, -0.002496},
                   {-1.52, 1.255, 0.409, 0.001244},
                   {548000.0, 732.0, 1322000.0, -660000.0},
                   {-0.564, -1366000.0, -1.07, 1.274}};
  const MatrixXd B{{-1.127}, {0.983}, {0.109}, {-0.691}};
  const Complex fast(-817733.84232737, 31638.802929925714);
  const Complex slow = -0.5526105973392476;
  const auto placed = place(A, B, {fast, std::conj(fast), -1.12573626410975e-07, slow});
  ASSERT_FALSE(placed.has_value());
  const Error& error = placed.error();
  EXPECT_TRUE(error.is(PolePlacementError::not_reached));
  EXPECT_NE(to_string(error).find("ask for 0"), std::string::npos) << to_string(error);
  ASSERT_EQ(error.evidence().size(), 4u);
  EXPECT_NEAR(error.evidence()[0].values.at(0), 3219.66, 0.01);
  EXPECT_EQ(error.evidence()[2].values.at(0), -1.12573626410975e-07);
  EXPECT_NEAR(error.evidence()[3].values.at(0), -0.000362561530293, 1e-14);
  // A zero has no size: it is as near as the largest pole's digits allow.
  const auto zero = place(A, B, {fast, std::conj(fast), 0.0, slow}).value();
  EXPECT_LT(zero.pole_error, 0.01);
  EXPECT_GE(zero.pole_error, std::abs(zero.poles(3) - slow) / std::abs(slow));
}

// One input, and the pole is reached to five digits.
TEST(PlaceSmallPoles, TheErrorIsRelativeToThePole) {
  const MatrixXd A{{2.517, 0.000637, 1126000.0, -88000.0},
                   {-598000.0, 0.000342, 0.484, 0.132},
                   {1.433, 532.0, -0.677, -1.984},
                   {-0.644, -0.151, -347.0, -2833000.0}};
  const MatrixXd B{{-0.626}, {1.391}, {-0.404}, {-0.088}};
  const Eigen::VectorXcd poles{{Complex(-851313.6266303522, 503602.50940204854),
                                Complex(-851313.6266303522, -503602.50940204854), -342077.088759771,
                                -1.8463411143839968e-07}};
  const auto placed = place(A, B, poles).value();
  EXPECT_GE(placed.pole_error, largest_error(placed.poles, poles));
  EXPECT_LT(placed.pole_error, 1e-5);
  const double truth = inverse_trace(A, B, placed.K);
  EXPECT_NEAR(inverse_sum(placed.poles) / truth, 1.0, 1e-9);
  EXPECT_GE(placed.pole_error * 1.001, std::abs(1.0 / truth / poles(3).real() - 1.0));
}

// Two inputs: rounded each for itself the gain's entries move the pole at -5.6e-8 to -2.9e-6,
// rounded together they do not.
TEST(PlaceSmallPoles, SeveralInputsAreRoundedTogether) {
  const MatrixXd A{{8.8e-05, 576000.0, -1.572, -0.726},
                   {428000.0, -1.354, -741000.0, -1.172},
                   {1759000.0, 0.885, 0.84, -0.001869},
                   {-7.0, 0.684, -0.611, -1.341}};
  const MatrixXd B{{1.196, -2.322}, {-0.789, 0.502}, {-1.67, 0.881}, {-0.463, -0.006}};
  const Complex pair(-0.0008674527233070936, 0.0009023946386592941);
  const Eigen::VectorXcd poles{
      {-5.595664790428245e-08, -0.5997234487012529, pair, std::conj(pair)}};
  const auto placed = place(A, B, poles).value();
  EXPECT_GE(placed.pole_error, largest_error(placed.poles, poles));
  EXPECT_LT(placed.pole_error, 0.05);
  EXPECT_NEAR(inverse_sum(placed.poles) / inverse_trace(A, B, placed.K), 1.0, 1e-6);
}

// Entries over nine decades, poles over thirteen: an answer is told pole by pole, and true.
TEST(PlaceSmallPoles, StiffPlants) {
  Random random(44);
  int placed_ones = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const Index n = 2 + trial % 5;
    const Index m = 1 + trial % 2;
    const auto size = [&](double low, double high) {
      return std::pow(10.0, 3.0 * std::round(random.uniform(low, high)));
    };
    const MatrixXd A =
        MatrixXd::NullaryExpr(n, n, [&] { return random.normal() * size(-1.0, 2.0); });
    const MatrixXd B = MatrixXd::NullaryExpr(n, m, [&] { return random.normal(); });
    Eigen::VectorXcd poles(n);
    for (Index i = 0; i < n; ++i) {
      const double scale = size(-2.0, 2.0);
      poles(i) = -scale * (0.05 + random.uniform());
      if (i + 1 < n && random.uniform() < 0.5) {
        poles(i).imag(scale * random.uniform());
        poles(i + 1) = std::conj(poles(i));
        ++i;
      }
    }
    const auto placed = place(A, B, poles);
    if (!placed) {
      EXPECT_EQ(placed.error().kind(), ErrorKind::no_answer);
      continue;
    }
    ++placed_ones;
    EXPECT_LE(placed->pole_error, 0.1) << trial;
    EXPECT_GE(placed->pole_error * (1.0 + 1e-12), largest_error(placed->poles, poles)) << trial;
    // What the bound leaves to the reported poles.
    const double truth = inverse_trace(A, B, placed->K);
    EXPECT_LT(std::abs(inverse_sum(placed->poles) - truth),
              1e-6 * placed->poles.cwiseInverse().cwiseAbs().maxCoeff())
        << trial;
  }
  EXPECT_GT(placed_ones, 60);
}

// A double pole at zero beside one at 1e20: the vectors of the small poles are nearly dependent,
// and X⁻¹ (A - B K) X of them in 31 digits has others, ±3e14 j.
TEST(PlaceSmallPoles, OfDependentVectors) {
  const MatrixXd A{{-1.48883056640625, 1.0, 0.675537109375},
                   {0.5, 2.2e-16, 2.0},
                   {1.93048095703125, 1.82867431640625, 1.9901123046875}};
  const MatrixXd B{{0.0}, {-1e20}, {0.0}};
  const auto placed = place(A, B, {Complex(1e20), Complex(0.0), Complex(0.0)}).value();
  // The truth, by mpmath 1.3 at 400 bits, is -1.82 and -0.0047.
  EXPECT_LT(placed.pole_error, 1e-14);
  EXPECT_LT(std::abs(placed.poles(1)), 1e6);
  EXPECT_LT(std::abs(placed.poles(2)), 1e6);
}

}  // namespace
}  // namespace flyball::pole_placement_small_poles_test
