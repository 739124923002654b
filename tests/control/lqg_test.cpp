#include <flyball/control/lqg.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::lqg_test {
namespace {

using namespace flyball::literals;
using Scalar = Eigen::Matrix<double, 1, 1>;

struct Design {
  DiscreteSystem<2, 1, 1> plant;
  Eigen::RowVector2d K;
  Eigen::Vector2d K_e;
};

Design design() {
  const auto elevator = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const auto plant = discretize(elevator, 20_ms).value();
  return {
      plant, lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K,
      kalman_gain(plant, standard_deviations({1e-3, 0.05}), standard_deviations({1e-3})).value().K};
}

// The three equations of the class comment, written out.
TEST(Lqg, IsPredictCorrectControl) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const Eigen::MatrixXd B_pinv = pseudoinverse(plant.B).value().X;
  Random random(5);
  Eigen::Vector2d x_hat = Eigen::Vector2d::Zero();
  double u_model = 0.0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d r(random.normal(), random.normal());
    const Eigen::Vector2d r_next(random.normal(), random.normal());
    const double y = random.normal();
    const double extra = random.normal();
    x_hat = plant.A * x_hat + plant.B * u_model;
    x_hat += K_e * (y - x_hat(0));
    const double u = std::clamp((K * (r - x_hat))(0) + (B_pinv * (r_next - plant.A * r))(0) + extra,
                                -12.0, 12.0);
    u_model = u - extra;
    ASSERT_NEAR(regulator.step(r, r_next, Scalar(y), Scalar(extra))(0), u, 1e-9);
    ASSERT_LT((regulator.x_hat() - x_hat).norm(), 1e-10);
    ASSERT_NEAR(regulator.u_model()(0), u_model, 1e-9);
  }
}

// On the model itself with gravity held by `extra`, a reference that the plant can follow is
// followed without error, and the estimate is the truth: the observer is not told of gravity.
TEST(Lqg, ObserverSeesWhatTheLinearModelSaw) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const double gravity = 0.6;
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Vector2d r = Eigen::Vector2d::Zero();
  double u_linear = 0.0;
  for (int k = 0; k < 300; ++k) {
    x = plant.A * x + plant.B * u_linear;
    ASSERT_LT((x - r).norm(), 1e-11);
    const double wanted = std::sin(0.02 * k);
    const Eigen::Vector2d r_next = plant.A * r + plant.B * wanted;
    const double u = regulator.step(r, r_next, plant.C * x, Scalar(gravity))(0);
    ASSERT_NEAR(u, wanted + gravity, 1e-8);
    u_linear = u - gravity;
    ASSERT_LT((regulator.x_hat() - x).norm(), 1e-11);
    r = r_next;
  }
}

// At the limit the observer is told the limited voltage, so that the estimate stays the truth.
TEST(Lqg, KeepsItsEstimateWhenSaturated) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 3.0).value();
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  double u = 0.0;
  const Eigen::Vector2d r(2.0, 0.0);
  for (int k = 0; k < 400; ++k) {
    x = plant.A * x + plant.B * u;
    u = regulator.step(r, r, plant.C * x)(0);
    ASSERT_LE(std::abs(u), 3.0);
    ASSERT_LT((regulator.x_hat() - x).norm(), 1e-11);
  }
  EXPECT_NEAR(x(0), 2.0, 1e-6);
}

TEST(Lqg, AsksForNoMoreThanTheRail) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const Eigen::Vector2d r(2.0, 0.0);
  EXPECT_EQ(regulator.step(r, r, Scalar(0.0), Scalar(0.6), 9.0)(0), 9.0);
  EXPECT_DOUBLE_EQ(regulator.u_model()(0), 8.4);
}

TEST(Lqg, SurvivesABrokenMeasurement) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const Eigen::Vector2d r(0.1, 0.0);
  (void)regulator.step(r, r, Scalar(0.05));
  const Eigen::Vector2d predicted = plant.A * regulator.x_hat() + plant.B * regulator.u_model();
  const double u = regulator.step(r, r, Scalar(std::nan("")))(0);
  EXPECT_TRUE(std::isfinite(u));
  EXPECT_LT((regulator.x_hat() - predicted).norm(), 1e-15);
}

TEST(Lqg, Resets) {
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const Eigen::Vector2d r(1.0, 0.0);
  (void)regulator.step(r, r, Scalar(0.0));
  regulator.reset(r);
  EXPECT_NEAR(regulator.step(r, r, Scalar(1.0))(0), 0.0, 1e-12);
}

TEST(Lqg, FixedIsDynamic) {
  const auto [plant, K, K_e] = design();
  auto fixed = lqg(plant, K, K_e, 12.0).value();
  auto dynamic = lqg(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, plant.period},
                     Eigen::MatrixXd(K), Eigen::MatrixXd(K_e), 12.0)
                     .value();
  Random random(7);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d r(random.normal(), random.normal());
    const Scalar y(random.normal());
    ASSERT_NEAR(fixed.step(r, r, y)(0), dynamic.step(r, r, y)(0), 1e-10);
  }
}

TEST(Lqg, Errors) {
  const auto [plant, K, K_e] = design();
  const auto create = [&](double low, double high) {
    return Lqg<2, 1, 1>::create(plant, K, K_e, Scalar(low), Scalar(high));
  };
  EXPECT_TRUE(create(1.0, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create(1.0, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(create(std::nan(""), 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      lqg(plant, Eigen::RowVector2d(std::nan(""), 0.0), K_e).error().is(ArgumentError::not_finite));
  const DiscreteSystem<> dynamic{plant.A, plant.B, plant.C, plant.D, plant.period};
  EXPECT_TRUE(lqg(dynamic, Eigen::MatrixXd(K_e), Eigen::MatrixXd(K_e))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      lqg(dynamic, Eigen::MatrixXd(K), Eigen::MatrixXd(K)).error().is(ArgumentError::wrong_shape));
  auto stopped = plant;
  stopped.period = Time(0.0);
  EXPECT_TRUE(lqg(stopped, K, K_e).error().is(ArgumentError::not_positive));
}

TEST(Lqg, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const auto [plant, K, K_e] = design();
  auto regulator = lqg(plant, K, K_e, 12.0).value();
  const Eigen::Vector2d r(1.0, 0.0);
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (int k = 0; k < 1000; ++k) {
    sum += regulator.step(r, r, Scalar(0.001 * k), Scalar(0.6), 11.0)(0);
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::lqg_test
