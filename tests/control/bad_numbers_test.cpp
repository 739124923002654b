#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/delay_compensation.hpp>
#include <flyball/control/mechanism_controller.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

#include "elevator_loop.hpp"
#include "mechanism_designs.hpp"

// Single bad numbers that once broke a run-time object, and what each says of them.
// `run_time_objects_test.cpp` tries all of them on all objects.
namespace flyball::bad_numbers_test {
namespace {

using namespace flyball::literals;
using test::elevator;
using test::estimator_gain;
using test::gain;
using test::limit;
using Scalar = Eigen::Matrix<double, 1, 1>;

constexpr double infinity = std::numeric_limits<double>::infinity();

// A rail that was measured wrong never widens the limits: with limits that were taken from it, the
// clamp's ends would change places.
TEST(BadNumbers, NoRailWidensTheLimits) {
  const auto plant = elevator();
  for (const double rail : {-1e300, -12.0, -0.0, 0.0, std::nan(""), -infinity, infinity, 1.7e308}) {
    auto regulator = lqg(plant, gain(), estimator_gain(), limit).value();
    for (const double r : {100.0, -100.0}) {
      const Eigen::Vector2d far(r, 0.0);
      EXPECT_EQ(regulator.step(far, far, Scalar(0.0), Scalar(0.6), rail)(0),
                std::copysign(limit, r))
          << rail;
    }
  }
}

// ki T is beyond what a double holds: one error takes the integral as far as it goes, and an error
// of zero leaves it there (infinity times zero would be NaN).
TEST(BadNumbers, PidIntegratesWithEnormousGains) {
  auto pid = Pid::create({.gains = {.ki = 1e300}, .period = 1e300}).value();
  EXPECT_EQ(pid.calculate(-1.0, 0.0), largest_signal);
  EXPECT_EQ(pid.calculate(0.0, 0.0), largest_signal);
  EXPECT_EQ(pid.calculate(2.0, 0.0), 0.0);
}

TEST(BadNumbers, PidOfEnormousGains) {
  PidSettings settings{.gains = {.kp = -1.7e308, .ki = 1e300, .kd = 1.7e308}, .period = 1e300};
  auto pid = Pid::create(settings).value();
  for (const double y : {0.0, 1.0, -1.0, 1e-300, 1e99, 0.0}) {
    EXPECT_TRUE(std::isfinite(pid.calculate(y, 0.0)));
    EXPECT_TRUE(std::isfinite(pid.integral()));
    EXPECT_TRUE(pid.set_gains({.kp = 1.7e308, .ki = -1e300, .kd = -1.7e308}));
    EXPECT_TRUE(std::isfinite(pid.integral()));
    EXPECT_TRUE(pid.set_gains(settings.gains));
  }
}

// Braking takes it 1.25e307 beyond 1.7e308, although the whole way is a number.
TEST(BadNumbers, ProfileOfEnormousStates) {
  const TrapezoidProfile profile({1.7e308, 1.0}, {1.7e308, 5e153}, {1.7e308, 0.0});
  for (const double t : {0.0, 1e153, 5e153, 1e154}) {
    EXPECT_TRUE(std::isfinite(profile.sample(t).position)) << t;
  }
}

// The status says what was used.
TEST(BadNumbers, SayWhatTheyUsed) {
  const auto plant = elevator();
  auto regulator = lqg(plant, gain(), estimator_gain(), limit).value();
  auto controller =
      MechanismController<>::create(test::design_of(mechanisms::MechanismKind::elevator)).value();
  const Eigen::Vector2d r(0.5, 0.0);
  EXPECT_FALSE(regulator.measured());
  for (const double y : {0.1, std::nan(""), -1.7e308, 0.2}) {
    (void)regulator.step(r, r, Scalar(y));
    EXPECT_EQ(regulator.measured(), std::abs(y) < 1.0);
    controller.update(y, {0.5, 0.0}, {0.5, 0.0}, 12.0);
    EXPECT_EQ(controller.measured(), std::abs(y) < 1.0);
  }
  const Eigen::Vector2d before = regulator.x_hat();
  EXPECT_FALSE(regulator.reset(Eigen::Vector2d(1.7e308, 0.0)));
  EXPECT_EQ(regulator.x_hat(), before);
  auto filter =
      kalman_filter(plant, standard_deviations({1e-3, 0.05}), standard_deviations({1e-2})).value();
  EXPECT_FALSE(filter.reset(Eigen::Vector2d(0.0, std::nan(""))));
  EXPECT_FALSE(filter.reset(r, Eigen::Matrix2d::Constant(infinity)));
  EXPECT_TRUE(filter.x_hat().isZero(0.0));
  EXPECT_TRUE(filter.reset(r, Eigen::Matrix2d(Eigen::Matrix2d::Identity())));
  EXPECT_EQ(filter.x_hat(), r);
  EXPECT_EQ(filter.P(), Eigen::Matrix2d(Eigen::Matrix2d::Identity()));
  // An input that is not known counts as zero: the state goes on by itself.
  Observer<2, 1, 1> observer(plant, estimator_gain());
  EXPECT_TRUE(observer.reset(r + Eigen::Vector2d(0.0, 1.0)));
  EXPECT_TRUE(filter.reset(observer.x_hat()));
  const Eigen::Vector2d alone = plant.A * observer.x_hat();
  EXPECT_FALSE(observer.predict(Scalar(std::nan(""))));
  EXPECT_FALSE(filter.predict(Scalar(-1.7e308)));
  EXPECT_EQ(observer.x_hat(), alone);
  EXPECT_EQ(filter.x_hat(), alone);
}

// What was sent and is not a number is on its way as zero, and spoils no entry of the state.
TEST(BadNumbers, AnUnknownInputIsOnItsWayAsZero) {
  const auto model = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  const ContinuousSystem<2, 1, 1>& plant = model;
  auto predictor = DelayPredictor<2, 1>::create(plant, 20_ms, 50_ms).value();
  auto twin = predictor;
  const Eigen::Vector2d x(0.5, 1.0);
  for (const double u : {std::nan(""), 1.7e308, -infinity}) {
    EXPECT_FALSE(predictor.sent(Scalar(u)));
    EXPECT_TRUE(twin.sent(Scalar(0.0)));
    EXPECT_EQ(predictor.predict(x), twin.predict(x));
  }
}

// An unstable plant without measurements: the estimate and its covariance stop growing, and the
// first measurements bring them back.
TEST(BadNumbers, ComeBackFromALongDropOut) {
  DiscreteSystem<1, 1, 1> unstable{Scalar(1.5), Scalar(1.0), Scalar(1.0), Scalar(0.0), 20_ms};
  auto filter = kalman_filter(unstable, Scalar(1.0), Scalar(1.0), Scalar(1.0)).value();
  const Scalar lost(std::nan(""));
  bool moved = true;
  for (int k = 0; k < 2000; ++k) {
    moved = filter.predict(Scalar(1.0));
    EXPECT_EQ(filter.update(lost, Scalar(1.0)), UpdateStatus::not_finite);
  }
  EXPECT_FALSE(moved);
  EXPECT_TRUE(is_signal(filter.x_hat()));
  EXPECT_LE(filter.P()(0), 1e200);
  for (int k = 0; k < 1000; ++k) {
    filter.predict(Scalar(0.0));
    EXPECT_EQ(filter.update(Scalar(0.0), Scalar(0.0)), UpdateStatus::updated);
  }
  EXPECT_NEAR(filter.x_hat()(0), 0.0, 1e-9);
}

}  // namespace
}  // namespace flyball::bad_numbers_test
