#include <flyball/systems/sampled_cost.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::sampled_cost_test {
namespace {

using Eigen::MatrixXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

// dx/dt = u, cost x²: ∫₀ᵀ (x + uτ)² dτ = x²T + x u T² + u² T³/3.
TEST(SampledCost, IntegratorInClosedForm) {
  const double T = 0.3;
  const auto cost =
      sampled_cost(scalar(0.0), scalar(1.0), scalar(1.0), scalar(0.0), Time(T)).value();
  EXPECT_NEAR(cost.Q(0, 0), T, 1e-16);
  EXPECT_NEAR(cost.N(0, 0), T * T / 2.0, 1e-16);
  EXPECT_NEAR(cost.R(0, 0), T * T * T / 3.0, 1e-17);
}

// One period costs what two halves cost, with the input held: x' = A x + B u of the first half.
TEST(SampledCost, HalvesAddUp) {
  Random random(91);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index m = 1 + trial % 2;
    const MatrixXd A = test::random_matrix(random, n, n);
    const MatrixXd B = std::pow(10.0, trial % 17 - 8) * test::random_matrix(random, n, m);
    const MatrixXd G = test::random_matrix(random, n + m, n + m);
    const MatrixXd W = G * G.transpose();
    const MatrixXd Q = W.topLeftCorner(n, n);
    const MatrixXd R = W.bottomRightCorner(m, m);
    const MatrixXd N = W.topRightCorner(n, m);
    const double T = random.uniform(0.01, 1.0);
    const auto half = sampled_cost(A, B, Q, R, N, Time(T / 2.0)).value();
    const auto whole = sampled_cost(A, B, Q, R, N, Time(T)).value();
    const MatrixXd Q2 = half.Q + half.A.transpose() * half.Q * half.A;
    const MatrixXd N2 = half.N + half.A.transpose() * (half.Q * half.B + half.N);
    const MatrixXd R2 = 2.0 * half.R + half.B.transpose() * half.Q * half.B +
                        half.B.transpose() * half.N + half.N.transpose() * half.B;
    EXPECT_LT((Q2 - whole.Q).norm(), 1e-12 * whole.Q.norm());
    EXPECT_LT((N2 - whole.N).norm(), 1e-11 * (whole.N.norm() + N2.norm()));
    EXPECT_LT((R2 - whole.R).norm(), 1e-11 * whole.R.norm());
  }
}

// The sampled gain tends to the continuous one as T → 0; the cost of x is the DARE's X.
TEST(SampledCost, TendsToTheContinuousRegulator) {
  // Double integrator, Q = diag(1, 0), R = 1: K = [1 √2].
  MatrixXd A(2, 2);
  A << 0.0, 1.0, 0.0, 0.0;
  const MatrixXd B = MatrixXd::Identity(2, 2).col(1);
  MatrixXd Q = MatrixXd::Zero(2, 2);
  Q(0, 0) = 1.0;
  double previous = 1.0;
  for (const double T : {0.1, 0.01, 0.001}) {
    const auto cost = sampled_cost(A, B, Q, scalar(1.0), Time(T)).value();
    const auto solution = dare(cost.A, cost.B, cost.Q, cost.R, cost.N).value();
    const double error = (solution.K - Eigen::RowVector2d(1.0, std::sqrt(2.0))).norm();
    EXPECT_LT(error, 0.2 * previous);
    previous = error;
    // X of the continuous problem is [√2 1; 1 √2].
    EXPECT_NEAR(solution.X(0, 0), std::sqrt(2.0), 2.0 * T * T + 1e-9);
  }
}

// ‖A‖T = 1e4: for a stable A the integral is the solution of AᵀQ + QA = e^{AᵀT}Qe^{AT} - Q.
TEST(SampledCost, StiffPlants) {
  Random random(92);
  for (int trial = 0; trial < 200; ++trial) {
    MatrixXd A(3, 3);
    A << -1.0, random.normal(), random.normal(), 0.0, -1e3, 300.0 * random.normal(), 0.0, 0.0, -1e6;
    const MatrixXd G = test::random_matrix(random, 3, 3);
    const MatrixXd Q = G * G.transpose();
    const Time T(0.01);
    const auto cost = sampled_cost(A, test::random_matrix(random, 3, 1), Q, scalar(1.0), T).value();
    const MatrixXd Phi = expm(A * 0.01).value();
    const MatrixXd right = Phi.transpose() * Q * Phi - Q;
    EXPECT_LT((A.transpose() * cost.Q + cost.Q * A - right).norm(),
              1e-9 * A.norm() * cost.Q.norm());
    EXPECT_NEAR(cost.Q(2, 2) * 2e6, Q(2, 2), 1e-2 * Q.norm());
    // Semidefinite, as a cost has to be.
    EXPECT_GT(test::symmetric_eigenvalues(cost.Q).minCoeff(), -1e-15 * cost.Q.norm());
  }
}

TEST(SampledCost, Errors) {
  const auto I = scalar(1.0);
  EXPECT_TRUE(sampled_cost(I, I, I, I, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(sampled_cost(scalar(NAN), I, I, I, Time(0.1)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(sampled_cost(I, I, MatrixXd::Ones(2, 2), I, Time(0.1))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(sampled_cost(I, I, I, I, MatrixXd::Ones(2, 1), Time(0.1))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(sampled_cost(MatrixXd(), I, I, I, Time(0.1)).error().is(ArgumentError::empty));
  MatrixXd skew = MatrixXd::Identity(2, 2);
  skew(0, 1) = 0.1;
  EXPECT_TRUE(sampled_cost(MatrixXd::Identity(2, 2), MatrixXd::Ones(2, 1), skew, I, Time(0.1))
                  .error()
                  .is(ArgumentError::not_symmetric));
  EXPECT_FALSE(sampled_cost(scalar(400.0), I, I, I, Time(1.0)).has_value());
}

}  // namespace
}  // namespace flyball::sampled_cost_test
