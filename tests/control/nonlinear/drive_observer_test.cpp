#include <flyball/control/nonlinear/drive_observer.hpp>

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/math/integration/fixed_step.hpp>

#include "control/followers/book_drive.hpp"
#include "support/allocation_count.hpp"

namespace flyball::drive_observer_test {
namespace {

using mechanisms::EncoderDrive;
using State = Eigen::Vector<double, 10>;

/// 8 s of curves with a sagging battery (-1.5 and -0.7 V) and encoders that count 4 cm/s too much
/// to the one side and too little to the other; sensors with noise.
template <class Filter>
class Drive {
 public:
  Drive() : observer_(DriveObserver<Filter>::create(model_, {}, Pose2d(1.0, 2.0, 0.3)).value()) {
    x_.head<3>() << 1.0, 2.0, 0.3;
    x_.tail<3>() << -1.5, -0.7, 0.04;
  }
  void run(int periods, bool compensates) {
    for (int k = 0; k < periods; ++k) {
      const double t = 0.02 * k_++;
      // The voltages that the model needs for these velocities.
      const Eigen::Vector2d r(1.0 + 0.4 * std::sin(t), 1.2 + 0.4 * std::sin(1.3 * t));
      const Eigen::Vector2d wanted = drive_.B.inverse() * (-drive_.A * r);
      const Eigen::Vector2d u = compensates ? observer_.compensated(wanted) : wanted;
      x_ = rk4([&](const State& at) { return State(model_.derivative(at, u)); }, x_, 0.02);
      observer_.step(u, x_(2) + 1e-3 * random_.normal(), x_(5) + 1e-3 * random_.normal(),
                     x_(6) + 1e-3 * random_.normal());
      lag_ = (r - x_.segment<2>(3)).norm();
    }
  }
  mechanisms::DifferentialDrive drive_ = test::book_drive();
  EncoderDrive model_ = mechanisms::encoder_drive(drive_, test::book_trackwidth).value();
  DriveObserver<Filter> observer_;
  State x_ = State::Zero();
  Random random_{3};
  double lag_ = 0.0;  ///< m/s, of the sides behind what was wanted.
  int k_ = 0;
};

template <class Filter>
class DriveObserverOf : public testing::Test {};
using Filters =
    testing::Types<ExtendedKalmanFilter<EncoderDrive>, UnscentedKalmanFilter<EncoderDrive>>;
TYPED_TEST_SUITE(DriveObserverOf, Filters);

// The errors are found, the pose is kept to centimetres, and taking them off the voltages makes the
// sides do what was wanted (8.22).
TYPED_TEST(DriveObserverOf, FindsTheErrorsAndMakesUpForThem) {
  Drive<TypeParam> plain;
  plain.run(400, false);
  EXPECT_NEAR(plain.observer_.voltage_error()(0), -1.5, 0.3);
  EXPECT_NEAR(plain.observer_.voltage_error()(1), -0.7, 0.3);
  EXPECT_NEAR(plain.observer_.encoder_error(), 0.04, 0.02);
  const DriveState state = plain.observer_.state();
  EXPECT_LT((state.pose.translation() - plain.x_.template head<2>()).norm(), 0.06);
  EXPECT_NEAR(std::remainder(state.pose.angle() - plain.x_(2), 6.283185307179586), 0.0, 2e-3);
  EXPECT_NEAR(state.left, plain.x_(3), 0.05);
  EXPECT_NEAR(state.right, plain.x_(4), 0.05);
  Drive<TypeParam> compensated;
  compensated.run(400, true);
  EXPECT_GT(plain.lag_, 0.2);
  EXPECT_LT(compensated.lag_, 0.4 * plain.lag_);
}

TEST(DriveObserver, RunTime) {
  Drive<ExtendedKalmanFilter<EncoderDrive>> drive;
  drive.run(10, false);
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    drive.observer_.step({1.0, 2.0}, 0.3, 0.1, 0.1);
    EXPECT_EQ(counter.count(), 0u);
  }
  const double nan = std::nan("");
  drive.observer_.step({nan, 1e300}, nan, 0.1, nan);
  EXPECT_TRUE(drive.observer_.filter().x_hat().allFinite());
  EXPECT_LE(drive.observer_.compensated({1e300, nan}).cwiseAbs().maxCoeff(), 12.0);
  DriveObserverSettings settings;
  settings.gyroscope = 0.0;
  EXPECT_FALSE(DriveObserver<>::create(drive.model_, settings, {}).has_value());
}

}  // namespace
}  // namespace flyball::drive_observer_test
