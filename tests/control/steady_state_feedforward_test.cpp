#include <flyball/control/steady_state_feedforward.hpp>

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::steady_state_feedforward_test {
namespace {

using namespace flyball::literals;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// The book's second-order CIM of figures C.1 to C.3: [angular velocity, current].
ContinuousSystem<2, 1, 1> cim() {
  constexpr double J = 7.75e-5, b = 8.91e-5, Kt = 0.0184, Ke = 0.0211, R = 0.0916, L = 5.9e-5;
  ContinuousSystem<2, 1, 1> motor;
  motor.A << -b / J, Kt / J, -Ke / L, -R / L;
  motor.B << 0.0, 1.0 / L;
  motor.C << 1.0, 0.0;
  motor.D << 0.0;
  return motor;
}

// At rest i = b ω/Kt and V = Ke ω + R i: facts of the reference data for Theorem C.2.1.
TEST(SteadyStateFeedforward, IsTheBooksMotor) {
  const auto continuous = steady_state_feedforward(cim()).value();
  EXPECT_NEAR(continuous.N_x(0), 1.0, 1e-12);
  EXPECT_NEAR(continuous.N_x(1), 0.004842391304347827, 1e-14);
  EXPECT_NEAR(continuous.N_u(0), 0.02154356304347826, 1e-14);
  // Sampling does not move an equilibrium.
  const auto discrete = steady_state_feedforward(discretize(cim(), Time(1e-4)).value()).value();
  EXPECT_NEAR(discrete.N_x(1), 0.004842391304347827, 1e-12);
  EXPECT_NEAR(discrete.N_u(0), 0.02154356304347826, 1e-12);
  // N_u N_x⁺ r, N_x⁺ = N_xᵀ/‖N_x‖².
  const Eigen::Vector2d r(209.4, 0.0);
  const double size = 1.0 + 0.004842391304347827 * 0.004842391304347827;
  EXPECT_NEAR(continuous.calculate(r)(0), 0.02154356304347826 * 209.4 / size, 1e-10);
}

// The plant rests where it is told to: A x_ss + B u_ss = 0 and C x_ss + D u_ss = y_ss.
TEST(SteadyStateFeedforward, RandomPlantsRest) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::Index p = 1 + trial % static_cast<int>(m);
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const Eigen::MatrixXd C = random_matrix(random, p, n);
    const Eigen::MatrixXd D = random_matrix(random, p, m);
    const auto rest = steady_state_feedforward(A, B, C, D);
    ASSERT_TRUE(rest.has_value()) << to_string(rest.error());
    const double size = 1.0 + rest->N_x.norm() + rest->N_u.norm();
    ASSERT_LT((A * rest->N_x + B * rest->N_u).norm(), 1e-10 * size * size);
    ASSERT_LT((C * rest->N_x + D * rest->N_u - Eigen::MatrixXd::Identity(p, p)).norm(),
              1e-10 * size * size);
  }
}

// Two motors side by side: pair by pair is each motor's own, summed.
TEST(SteadyStateFeedforward, Pairs) {
  const auto one = steady_state_feedforward(cim()).value();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(4, 4);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(4, 2);
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(2, 4);
  for (int i = 0; i < 2; ++i) {
    A.block(2 * i, 2 * i, 2, 2) = cim().A;
    B.block(2 * i, i, 2, 1) = cim().B;
    C.block(i, 2 * i, 1, 2) = cim().C;
  }
  const Eigen::MatrixXd D = Eigen::MatrixXd::Zero(2, 2);
  const std::array inputs{0, 1};
  const auto pairs = steady_state_feedforward_of_pairs(A, B, C, D, inputs).value();
  EXPECT_NEAR(pairs.N_u(0, 0), one.N_u(0), 1e-14);
  EXPECT_NEAR(pairs.N_u(1, 1), one.N_u(0), 1e-14);
  EXPECT_EQ(pairs.N_u(0, 1), 0.0);
  EXPECT_NEAR(pairs.K_ff(1, 2), one.K_ff(0), 1e-14);
  const std::array outside{0, 2};
  EXPECT_TRUE(steady_state_feedforward_of_pairs(A, B, C, D, outside)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(steady_state_feedforward_of_pairs(A, B, C, D, std::array{0})
                  .error()
                  .is(ArgumentError::wrong_shape));
}

// No input holds the velocity of a mass on a spring.
TEST(SteadyStateFeedforward, SaysWhatCannotBeHeld) {
  Eigen::Matrix2d A;
  A << 0.0, 1.0, -1.0, -0.1;
  const auto refused = steady_state_feedforward(
      A, Eigen::Vector2d(0.0, 1.0), Eigen::RowVector2d(0.0, 1.0), Eigen::MatrixXd::Zero(1, 1));
  ASSERT_FALSE(refused.has_value());
  EXPECT_TRUE(refused.error().is(FeedforwardError::no_steady_state));
  EXPECT_EQ(refused.error().subject(), "output 0");
  EXPECT_TRUE(steady_state_feedforward(A, Eigen::Vector3d::Zero(), Eigen::RowVector2d(0.0, 1.0),
                                       Eigen::MatrixXd::Zero(1, 1))
                  .error()
                  .is(ArgumentError::wrong_shape));
}

// Theorem C.1.1: u minimises (Bu - d)ᵀQ(Bu - d) + uᵀRu.
TEST(QrWeightedInversion, Minimises) {
  Random random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Index n = 1 + trial % 4;
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::MatrixXd B = random_matrix(random, n, m);
    const Eigen::MatrixXd G = random_matrix(random, n, n);
    const Eigen::MatrixXd Q = G * G.transpose();
    const Eigen::MatrixXd R = 0.1 * Eigen::MatrixXd::Identity(m, m);
    const Eigen::MatrixXd K = qr_weighted_gain(B, Q, R).value();
    const Eigen::VectorXd d = random_matrix(random, n, 1);
    const auto cost = [&](const Eigen::VectorXd& u) {
      const Eigen::VectorXd miss = B * u - d;
      return miss.dot(Q * miss) + u.dot(R * u);
    };
    const Eigen::VectorXd u = K * d;
    for (int i = 0; i < 3; ++i) {
      ASSERT_GT(cost(u + 0.01 * random_matrix(random, m, 1)), cost(u));
    }
  }
}

// Q = I, R = 0 is the plain inversion; figure C.1's weights give less than that.
TEST(QrWeightedInversion, OfTheBooksMotor) {
  const auto plant = discretize(cim(), Time(1e-4)).value();
  const Eigen::Vector2d r(209.4, 0.0);
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(1, 1);
  const auto plain = linear_plant_inversion(plant).value();
  const auto unweighted = qr_weighted_inversion(plant, Eigen::Matrix2d::Identity(), none).value();
  EXPECT_NEAR(unweighted.calculate(r, r)(0), plain.calculate(r, r)(0), 1e-9);
  const auto weighted = qr_weighted_inversion(plant, bryson({20, 40}), bryson({12})).value();
  EXPECT_LT(std::abs(weighted.calculate(r, r)(0)), std::abs(plain.calculate(r, r)(0)));
  // (BᵀQB + R)⁻¹BᵀQ by hand for one input.
  const Eigen::Matrix2d Q = Eigen::Vector2d(1.0 / 400.0, 1.0 / 1600.0).asDiagonal();
  const double inner = plant.B.dot(Q * plant.B) + 1.0 / 144.0;
  EXPECT_NEAR(weighted.B_pinv()(0), (plant.B.transpose() * Q / inner)(0), 1e-14);
}

// One state, one input: bq/(b²q + r), where b²q or r leave the doubles' range, and where q and r
// are far apart.
TEST(QrWeightedInversion, InAnyUnits) {
  const auto gain = [](double b, double q, double r) {
    const auto scalar = [](double x) { return Eigen::MatrixXd::Constant(1, 1, x); };
    return qr_weighted_gain(scalar(b), scalar(q), scalar(r)).value()(0, 0);
  };
  EXPECT_NEAR(gain(1e155, 92.85, 0.0) * 1e155, 1.0, 1e-15);
  EXPECT_NEAR(gain(1.7e308, 1.0, 9.0) * 1.7e308, 1.0, 1e-15);
  EXPECT_NEAR(gain(-1e-10, 1.0, 1e300) / -1e-310, 1.0, 1e-8);
  EXPECT_NEAR(gain(0.125, 4.0, 1e300) * 2e300, 1.0, 1e-15);
  // Of two inputs, 1.7e308 and 1e-310 as strong, the weight of the weak one is all that it has.
  const Eigen::MatrixXd K = qr_weighted_gain(Eigen::RowVector2d(1.7e308, 1e-310),
                                             Eigen::MatrixXd::Ones(1, 1), bryson({1.0, 1.0}))
                                .value();
  EXPECT_NEAR(K(0, 0) * 1.7e308, 1.0, 1e-15);
  EXPECT_LT(std::abs(K(1, 0)), 1e-320);
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(
      qr_weighted_gain(1e-310 * one, one, 0.0 * one).error().is(FeedforwardError::overflow));
}

// One input that reaches one state, whose weight and those beside it are 5e-324: K_ff = 1/b times
// the weights' quotients, which are one; what else Q has says nothing.
TEST(QrWeightedInversion, WeightsFarApart) {
  Eigen::MatrixXd Q(3, 3);
  Q << 5e-324, 5e-324, 5e-324, 5e-324, -1.7e308, -1e-154, 5e-324, -1e-154, 1e-8;
  const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(1, 1);
  const auto first = qr_weighted_gain(Eigen::Vector3d(0x1p-52, 0.0, 0.0), Q, zero);
  ASSERT_TRUE(first.has_value()) << to_string(first.error());
  EXPECT_EQ(*first, Eigen::RowVector3d::Constant(0x1p52));
  // bᵀQ/(bᵀQb) with b = (-5e-324, 1e154), Q₁₁ = 5e-324 and the mean of two that differ by rounding.
  Eigen::MatrixXd P(2, 2);
  P << 0.69, 0.0, 1e-224, 5e-324;
  const auto mean = qr_weighted_gain(Eigen::Vector2d(-5e-324, 1e154), P, zero);
  ASSERT_TRUE(mean.has_value()) << to_string(mean.error());
  EXPECT_NEAR((*mean)(0, 1) * 1e154, 1.0, 1e-15);
  EXPECT_NEAR((*mean)(0, 0) / (0.5e-224 / 5e-324 / 1e154), 1.0, 0.02);
}

TEST(QrWeightedInversion, Errors) {
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 1.0);
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(qr_weighted_gain(B, one, one).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(qr_weighted_gain(B, I, I).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(qr_weighted_gain(B, 0.0 * I, 0.0 * one).error().is(FeedforwardError::singular));
  EXPECT_TRUE(qr_weighted_gain(B, I, bryson({0.0})).error().is(ArgumentError::not_positive));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(qr_weighted_gain(B * nan, I, one).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::steady_state_feedforward_test
