#include <flyball/control/integral_control.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqg.hpp>
#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/augment.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::integral_control_test {
namespace {

using namespace flyball::literals;
using Scalar = Eigen::Matrix<double, 1, 1>;
constexpr double infinity = std::numeric_limits<double>::infinity();

DiscreteSystem<2, 1, 1> elevator() {
  return discretize(mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value(),
                    20_ms)
      .value();
}

// The gains are those of the book's augmented plant [A 0; -T C  I], [B; 0].
TEST(Lqi, IsTheAugmentedPlantsRegulator) {
  const auto plant = elevator();
  const auto design = lqi(plant, bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  A.topLeftCorner(2, 2) = plant.A;
  A(2, 0) = -0.02;
  A(2, 2) = 1.0;
  const Eigen::Vector3d B(plant.B(0), plant.B(1), 0.0);
  const auto direct = lqr(A, B, bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  EXPECT_LT((design.K - direct.K.leftCols(2)).norm(), 1e-12 * direct.K.norm());
  EXPECT_LT((design.K_I - direct.K.rightCols(1)).norm(), 1e-12 * direct.K.norm());
  // More output than reference takes input away: K_I acts against the integral of r - y.
  EXPECT_LT(design.K_I(0, 0), 0.0);
  EXPECT_LT(design.poles.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_EQ(design.S.rows(), 3);
}

// A constant force of 1.5 V leaves the proportional loop short; the integral removes the error.
TEST(Lqi, RemovesTheErrorOfAConstantDisturbance) {
  const auto plant = elevator();
  const auto design = lqi(plant, bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  IntegralStateFeedback<2, 1, 1> controller(design.K, design.K_I, 0.02, Scalar(-12.0),
                                            Scalar(12.0));
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  const Eigen::Vector2d r(0.5, 0.0);
  for (int k = 0; k < 1000; ++k) {
    const Scalar error(r(0) - x(0));
    const Scalar u = controller.calculate(x, r, error, Scalar(0.0));
    ASSERT_LE(std::abs(u(0)), 12.0);
    x = (plant.A * x + plant.B * (u(0) - 1.5)).eval();
  }
  EXPECT_NEAR(x(0), 0.5, 1e-9);
  // The integral holds what the disturbance needs.
  EXPECT_NEAR((-design.K_I * controller.integral())(0), 1.5, 1e-6);
}

// A long way under a tight limit does not wind the integral up.
TEST(Lqi, DoesNotWindUp) {
  const auto plant = elevator();
  const auto design = lqi(plant, bryson({0.02, 0.4, 0.01}), bryson({12.0})).value();
  IntegralStateFeedback<2, 1, 1> controller(design.K, design.K_I, 0.02, Scalar(-2.0), Scalar(2.0));
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  const Eigen::Vector2d r(3.0, 0.0);
  double peak = 0.0;
  for (int k = 0; k < 2000; ++k) {
    x = (plant.A * x + plant.B * controller.calculate(x, r, Scalar(r(0) - x(0)), Scalar(0.0)))
            .eval();
    peak = std::max(peak, x(0));
  }
  EXPECT_NEAR(x(0), 3.0, 1e-6);
  EXPECT_LT(peak, 3.2);
}

TEST(Lqi, RandomPlantsAreStableAndTrack) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Index n = 2 + trial % 3;
    const Eigen::Index m = 1 + trial % 2;
    DiscreteSystem<> plant;
    plant.A = 0.6 * Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    plant.B = Eigen::MatrixXd::NullaryExpr(n, m, [&] { return random.normal(); });
    plant.C = Eigen::MatrixXd::NullaryExpr(m, n, [&] { return random.normal(); });
    plant.D = 0.1 * Eigen::MatrixXd::NullaryExpr(m, m, [&] { return random.normal(); });
    plant.period = 0.1_s;
    const Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(n + m, n + m);
    const auto design = lqi(plant, Q, Eigen::MatrixXd::Identity(m, m));
    ASSERT_TRUE(design.has_value()) << to_string(design.error());
    // At rest of the augmented loop y = r_y: x_I stands still.
    Eigen::MatrixXd closed(n + m, n + m);
    const Eigen::MatrixXd B_K = plant.B * design->K;
    closed << plant.A - B_K, -plant.B * design->K_I, -0.1 * (plant.C - plant.D * design->K),
        Eigen::MatrixXd::Identity(m, m) + 0.1 * plant.D * design->K_I;
    ASSERT_LT(test::eigenvalues(closed).cwiseAbs().maxCoeff(), 1.0) << trial;
  }
}

TEST(Lqi, SaysWhatCannotBeTracked) {
  // Two outputs, one input.
  DiscreteSystem<> two{elevator().A, elevator().B, Eigen::MatrixXd::Identity(2, 2),
                       Eigen::MatrixXd::Zero(2, 1), 20_ms};
  const auto outputs = lqi(two, Eigen::MatrixXd::Identity(4, 4), Eigen::MatrixXd::Ones(1, 1));
  EXPECT_TRUE(outputs.error().is(IntegralControlError::not_trackable));
  EXPECT_EQ(outputs.error().where(), "lqi");
  // The velocity of a mechanism with an end position cannot be held: a zero at 1.
  DiscreteSystem<> spring{Eigen::Matrix2d{{1.0, 0.1}, {-0.1, 0.9}}, Eigen::Vector2d(0.0, 0.1),
                          Eigen::RowVector2d(0.0, 1.0), Eigen::MatrixXd::Zero(1, 1), 100_ms};
  EXPECT_TRUE(lqi(spring, Eigen::MatrixXd::Identity(3, 3), Eigen::MatrixXd::Ones(1, 1))
                  .error()
                  .is(IntegralControlError::not_trackable));
  const auto Q = lqi(elevator(), Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Ones(1, 1));
  EXPECT_EQ(to_string(Q.error()),
            "lqi: Q is 2x2; it must be (states + outputs) x (states + outputs) (3x3)");
  EXPECT_EQ(lqi(elevator(), bryson({1.0, 1.0, 0.0}), bryson({1.0})).error().where(), "bryson");
}

// Section 6.7.2: B k_error = B_error.
TEST(InputErrorGain, CancelsTheDisturbance) {
  Random random(2);
  const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(4, 2, [&] { return random.normal(); });
  EXPECT_LT((input_error_gain(B, B).value() - Eigen::Matrix2d::Identity()).norm(), 1e-14);
  const Eigen::MatrixXd mixed = B * Eigen::Vector2d(0.3, -2.0);
  EXPECT_LT((input_error_gain(B, mixed).value() - Eigen::Vector2d(0.3, -2.0)).norm(), 1e-13);
  const auto other = input_error_gain(B, Eigen::MatrixXd::Ones(4, 1));
  EXPECT_TRUE(other.error().is(IntegralControlError::not_matched));
  EXPECT_TRUE(
      input_error_gain(B, Eigen::MatrixXd::Ones(3, 1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(input_error_gain(Eigen::MatrixXd(0, 0), B).error().is(ArgumentError::empty));
}

// The whole of 6.7.2: observer with u_error, controller with k_error; a constant disturbance of
// 1.5 V leaves no error, which the same loop without it does.
TEST(InputErrorEstimation, RemovesTheError) {
  const auto continuous =
      mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value();
  const auto plant = discretize(continuous, 20_ms).value();
  const auto augmented = discretize(augment_input_error(continuous).value(), 20_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const auto K_aug = augment_gain_input_error(K);
  const auto K_e =
      kalman_gain(augmented, standard_deviations({1e-3, 0.05, 0.5}), standard_deviations({1e-3}))
          .value()
          .K;
  auto loop = lqg(augmented, K_aug, K_e, 12.0).value();
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  const Eigen::Vector3d r(0.5, 0.0, 0.0);
  for (int k = 0; k < 1500; ++k) {
    const Scalar u = loop.step(r, r, Scalar(x(0)));
    x = (plant.A * x + plant.B * (u(0) - 1.5)).eval();
  }
  EXPECT_NEAR(x(0), 0.5, 1e-8);
  EXPECT_NEAR(loop.x_hat()(2), -1.5, 1e-6);
}

TEST(IntegralStateFeedback, FixedIsDynamicAndAllocatesNothing) {
  const Eigen::RowVector2d K(10.0, 2.0);
  IntegralStateFeedback<2, 1, 1> fixed(K, Scalar(-3.0), 0.02, Scalar(-1.0), Scalar(1.0));
  IntegralStateFeedback<> dynamic(K, Scalar(-3.0), 0.02, Scalar(-1.0), Scalar(1.0));
  const Eigen::Vector2d at_rest = Eigen::Vector2d::Zero();
  const Scalar none(0.0);
  static_assert(noexcept(fixed.calculate(at_rest, at_rest, none, none)));
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d x(0.1 * random.normal(), 0.1 * random.normal());
    const Scalar error(random.normal());
    const Eigen::Vector2d r = Eigen::Vector2d::Zero();
    ASSERT_DOUBLE_EQ(fixed.calculate(x, r, error, Scalar(0.1))(0),
                     dynamic.calculate(x, r, error, Scalar(0.1))(0));
  }
  const Scalar before = fixed.integral();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
  EXPECT_TRUE(std::isfinite(fixed.calculate(zero, zero, Scalar(nan), Scalar(0.0))(0)));
  EXPECT_TRUE(std::isfinite(fixed.calculate(zero * nan, zero, Scalar(infinity), Scalar(0.0))(0)));
  EXPECT_EQ(fixed.integral(), before);
  fixed.reset(Scalar(0.0));
  EXPECT_EQ(fixed.integral(), Scalar(0.0));
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    EXPECT_TRUE(std::isfinite(fixed.calculate(zero, zero, Scalar(0.1), Scalar(0.0))(0)));
    EXPECT_EQ(counter.count(), 0u);
  }
}

}  // namespace
}  // namespace flyball::integral_control_test
