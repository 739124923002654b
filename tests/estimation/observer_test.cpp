#include <flyball/estimation/observer.hpp>

#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.hpp>

#include "support/allocation_count.hpp"

namespace flyball {
namespace {

DiscreteSystem<2, 1, 1> cart() {
  DiscreteSystem<2, 1, 1> plant;
  plant.A << 1.0, 0.02, 0.0, 0.95;
  plant.B << 2e-4, 0.02;
  plant.C << 1.0, 0.0;
  plant.D << 0.1;
  plant.period = Time(0.02);
  return plant;
}

// With the steady gain it is the Kalman filter that starts at its steady state.
TEST(Observer, IsTheSettledKalmanFilter) {
  const auto plant = cart();
  const auto Q = standard_deviations({1e-3, 0.05});
  const auto R = standard_deviations({1e-2});
  Observer<2, 1, 1> observer(plant, kalman_gain(plant, Q, R).value().K);
  auto filter = kalman_filter(plant, Q, R).value();
  Random random(4);
  for (int k = 0; k < 500; ++k) {
    const Eigen::Matrix<double, 1, 1> u(random.normal());
    const Eigen::Matrix<double, 1, 1> y(random.normal());
    observer.predict(u);
    filter.predict(u);
    EXPECT_TRUE(observer.update(y, u));
    filter.update(y, u);
    ASSERT_LT((observer.x_hat() - filter.x_hat()).norm(), 1e-10);
  }
}

// The estimation error follows (I - K C) A, whatever the input: the separation principle.
TEST(Observer, ErrorObeysItsOwnDynamics) {
  const auto plant = cart();
  const Eigen::Vector2d K(0.4, 1.5);
  Observer<2, 1, 1> observer(plant, K);
  Eigen::Vector2d x(1.0, -2.0);
  Eigen::Vector2d error = x;
  const Eigen::Matrix2d I_KC = Eigen::Matrix2d::Identity() - K * plant.C;
  for (int k = 0; k < 50; ++k) {
    const Eigen::Matrix<double, 1, 1> u(0.3 * k - 4.0);
    x = plant.A * x + plant.B * u;
    observer.predict(u);
    observer.update(plant.C * x + plant.D * u, u);
    error = I_KC * plant.A * error;
    ASSERT_LT((x - observer.x_hat() - error).norm(), 1e-12 * (1.0 + x.norm()));
  }
}

TEST(Observer, LeavesOutWhatIsNotFinite) {
  Observer<2, 1, 1> observer(cart(), Eigen::Vector2d(0.4, 1.5));
  observer.reset(Eigen::Vector2d(1.0, 2.0));
  const Eigen::Matrix<double, 1, 1> zero(0.0);
  EXPECT_FALSE(
      observer.update(Eigen::Matrix<double, 1, 1>(std::numeric_limits<double>::quiet_NaN()), zero));
  EXPECT_EQ(observer.x_hat(), Eigen::Vector2d(1.0, 2.0));
}

TEST(Observer, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  Observer<2, 1, 1> observer(cart(), Eigen::Vector2d(0.4, 1.5));
  const test::AllocationCounter counter;
  const Eigen::Matrix<double, 1, 1> u(0.5);
  for (int k = 0; k < 100; ++k) {
    observer.predict(u);
    observer.update(u, u);
  }
  EXPECT_EQ(counter.count(), 0u);
}

}  // namespace
}  // namespace flyball
