#include <flyball/control/quadratic_cost.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "control/appendix_b_plant.hpp"

namespace flyball::quadratic_cost_test {
namespace {

using test::appendix_b_plant;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

Eigen::MatrixXd scalar(double value) {
  return Eigen::MatrixXd::Constant(1, 1, value);
}

// SciPy 1.10.1, solve_discrete_are with s = N: facts of the reference data for Theorem B.2.1.
TEST(OutputCost, IsTheBooksExample) {
  const auto cost =
      output_cost(appendix_b_plant().C, appendix_b_plant().D, scalar(3.0), scalar(0.5)).value();
  EXPECT_NEAR(cost.Q(0, 0), 3.0, 1e-15);
  EXPECT_NEAR(cost.Q(0, 1), 0.9, 1e-15);
  EXPECT_NEAR(cost.Q(1, 1), 0.27, 1e-15);
  EXPECT_NEAR(cost.R(0, 0), 0.62, 1e-15);
  EXPECT_NEAR(cost.N(0, 0), 0.6, 1e-15);
  EXPECT_NEAR(cost.N(1, 0), 0.18, 1e-15);
  const auto design = output_lqr(appendix_b_plant(), scalar(3.0), scalar(0.5)).value();
  static_assert(decltype(design.K)::ColsAtCompileTime == 2);
  EXPECT_NEAR(design.K(0, 0), 2.0792724950117867, 1e-12);
  EXPECT_NEAR(design.K(0, 1), 1.334944324646523, 1e-12);
}

// yᵀQy + uᵀRu is the quadratic form of the weights, at any x and u.
TEST(OutputCost, IsTheOutputsCost) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::Index p = 1 + trial % 5;
    const Eigen::MatrixXd C = random_matrix(random, p, n);
    const Eigen::MatrixXd D = random_matrix(random, p, m);
    const Eigen::MatrixXd G = random_matrix(random, p, p);
    const Eigen::MatrixXd Q = G * G.transpose();
    const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(m, m);
    const auto cost = output_cost(C, D, Q, R).value();
    const Eigen::VectorXd x = random_matrix(random, n, 1);
    const Eigen::VectorXd u = random_matrix(random, m, 1);
    const Eigen::VectorXd y = C * x + D * u;
    const double direct = y.dot(Q * y) + u.dot(R * u);
    const double folded = x.dot(cost.Q * x) + 2.0 * x.dot(cost.N * u) + u.dot(cost.R * u);
    ASSERT_NEAR(folded, direct, 1e-11 * (1.0 + direct));
  }
}

// The output being the state: the plain regulator.
TEST(OutputCost, OfTheStateIsThePlainOne) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const auto cost = output_cost(I, Eigen::MatrixXd::Zero(2, 1), I, scalar(2.0)).value();
  EXPECT_EQ(cost.Q, I);
  EXPECT_EQ(cost.R, scalar(2.0));
  EXPECT_EQ(cost.N, Eigen::MatrixXd::Zero(2, 1));
}

TEST(OutputCost, Errors) {
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(output_cost(I * nan, B, I, scalar(1.0)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(output_cost(I, B, I, bryson({-1.0})).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(output_cost(I, Eigen::MatrixXd::Ones(1, 1), I, scalar(1.0))
                  .error()
                  .is(ArgumentError::wrong_shape));
  Eigen::Matrix2d skew = I;
  skew(0, 1) = 1.0;
  EXPECT_TRUE(output_cost(I, B, skew, scalar(1.0)).error().is(ArgumentError::not_symmetric));
}

}  // namespace
}  // namespace flyball::quadratic_cost_test
