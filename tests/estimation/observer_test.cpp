#include <flyball/estimation/observer.hpp>

#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.hpp>

#include "support/allocation_count.hpp"

namespace flyball::observer_test {
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

// (9.1) to (9.4): Table 9.1 has the shapes; the system does what the run-time object does.
TEST(LuenbergerObserver, IsItsOwnSystem) {
  const auto plant = cart();
  const Eigen::Vector2d L(0.4, 1.5);
  const DiscreteSystem<> dynamic{plant.A, plant.B, plant.C, plant.D, plant.period};
  const auto system = observer_system(dynamic, L).value();
  EXPECT_EQ(system.A, Eigen::MatrixXd(plant.A - L * plant.C));
  ASSERT_EQ(system.B.cols(), 2);
  LuenbergerObserver<2, 1, 1> observer(plant, L);
  EXPECT_TRUE(observer.reset(Eigen::Vector2d(1.0, -2.0)));
  Eigen::VectorXd x = observer.x_hat();
  Random random(5);
  for (int k = 0; k < 100; ++k) {
    const Eigen::Matrix<double, 1, 1> u(random.normal());
    const Eigen::Matrix<double, 1, 1> y(random.normal());
    EXPECT_TRUE(observer.step(u, y));
    x = system.A * x + system.B * Eigen::Vector2d(u(0), y(0));
    ASSERT_LT((x - observer.x_hat()).norm(), 1e-12 * (1.0 + x.norm()));
  }
  EXPECT_EQ(observer.L(), L);
  EXPECT_EQ(observer.plant().A, plant.A);
  const ContinuousSystem<> continuous{plant.A, plant.B, plant.C, plant.D};
  EXPECT_EQ(observer_system(continuous, L)->B, system.B);
  // Table 9.1: L is states x outputs.
  EXPECT_TRUE(observer_system(dynamic, L.transpose()).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      observer_system(dynamic, Eigen::MatrixXd::Zero(2, 2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(observer_system(dynamic, std::numeric_limits<double>::quiet_NaN() * L)
                  .error()
                  .is(ArgumentError::not_finite));
}

// Tables 9.1 and 9.2: A states x states, B states x inputs, C outputs x states, D outputs x inputs,
// L and K states x outputs, P and Q states x states, R outputs x outputs. Each of another shape is
// refused by its name.
TEST(Tables, MatricesHaveTheirSizes) {
  const DiscreteSystem<> plant{Eigen::MatrixXd::Identity(3, 3), Eigen::MatrixXd::Zero(3, 2),
                               Eigen::MatrixXd::Ones(1, 3), Eigen::MatrixXd::Zero(1, 2), Time(0.1)};
  const Eigen::MatrixXd L = Eigen::MatrixXd::Ones(3, 1);
  EXPECT_EQ(observer_system(plant, L)->B.cols(), 3);
  EXPECT_EQ(observer_system(plant, L)->C.rows(), 3);
  const auto with = [&](auto matrix) {
    auto changed = plant;
    changed.*matrix = Eigen::MatrixXd::Zero(4, 5);
    return observer_system(changed, L).error();
  };
  using Plant = DiscreteSystem<>;
  for (const auto matrix : {&Plant::A, &Plant::B, &Plant::C, &Plant::D}) {
    EXPECT_TRUE(with(matrix).is(ArgumentError::wrong_shape));
  }
  EXPECT_TRUE(observer_system(plant, L.transpose()).error().is(ArgumentError::wrong_shape));
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::MatrixXd R = Eigen::MatrixXd::Identity(1, 1);
  const auto filter = kalman_filter(plant, I, R, I);
  ASSERT_TRUE(filter);
  EXPECT_EQ(filter->x_hat().size(), 3);
  EXPECT_EQ(filter->P().rows(), 3);
  EXPECT_EQ(kalman_filter(plant, R, R, I).error().subject(), "Q");
  EXPECT_EQ(kalman_filter(plant, I, I, I).error().subject(), "R");
  EXPECT_EQ(kalman_filter(plant, I, R, R).error().subject(), "P0");
  for (const auto matrix : {&Plant::A, &Plant::B, &Plant::C, &Plant::D}) {
    auto changed = plant;
    changed.*matrix = Eigen::MatrixXd::Zero(4, 5);
    EXPECT_TRUE(kalman_filter(changed, I, R, I).error().is(ArgumentError::wrong_shape));
  }
}

TEST(LuenbergerObserver, IsFiniteWhateverComesAndAllocatesNothing) {
  const auto plant = cart();
  LuenbergerObserver<2, 1, 1> observer(plant, Eigen::Vector2d(0.4, 1.5));
  using Scalar = Eigen::Matrix<double, 1, 1>;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  observer.reset(Eigen::Vector2d(1.0, 2.0));
  EXPECT_FALSE(observer.step(Scalar(3.0), Scalar(nan)));  // a prediction
  EXPECT_EQ(observer.x_hat(), Eigen::Vector2d(plant.A * Eigen::Vector2d(1.0, 2.0) + plant.B * 3.0));
  EXPECT_FALSE(observer.step(Scalar(nan), Scalar(0.0)));
  EXPECT_FALSE(observer.reset(Eigen::Vector2d(nan, 0.0)));
  const test::AllocationCounter allocations;
  for (int k = 0; k < 1000; ++k) {
    observer.step(Scalar(k % 3 == 0 ? 1e300 : 1.0), Scalar(k % 5 == 0 ? -1e99 : 1e99));
    ASSERT_TRUE((observer.x_hat().array().abs() <= 1e100).all());
  }
  EXPECT_EQ(allocations.count(), 0u);
}

// Theorem 9.2.2: K = A⁻¹ L, and KalmanGain's L is A K (D.2).
TEST(FilterGain, IsTheOtherFormOfL) {
  const auto plant = cart();
  const auto gain =
      kalman_gain(plant, standard_deviations({1e-3, 0.05}), standard_deviations({1e-2})).value();
  const auto K = filter_gain(plant.A, gain.L).value();
  EXPECT_LT((K - gain.K).norm(), 1e-14);
  EXPECT_LT((gain.L - plant.A * gain.K).norm(), 1e-15);
  const auto refused = filter_gain(Eigen::Matrix2d{{1.0, 1.0}, {0.0, 0.0}}, gain.L);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ArgumentError::out_of_range));
  // Units of 1e±9 do not make A singular.
  const Eigen::Vector2d d(1e-9, 1e9);
  const Eigen::Matrix2d A = d.asDiagonal() * plant.A * d.cwiseInverse().asDiagonal();
  EXPECT_LT((filter_gain(A, d.asDiagonal() * gain.L).value() - d.asDiagonal() * gain.K)
                .cwiseQuotient(d)
                .norm(),
            1e-13);
  EXPECT_TRUE(filter_gain(plant.A, Eigen::Vector3d::Ones()).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::observer_test
