#include <flyball/control/delay_compensation.hpp>

#include <cmath>
#include <deque>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::delay_compensation_test {
namespace {

using namespace flyball::literals;
using Scalar = Eigen::Matrix<double, 1, 1>;

mechanisms::Elevator book_elevator() {
  return mechanisms::elevator({.motor = mechanisms::cim(2),
                               .gearing = 10.0,
                               .mass = Mass(6.803886),
                               .drum_radius = Length(0.02762679089)})
      .value();
}

// dx/dt = u sampled with T = 1 (A = B = 1), K = 0.5, L = 2 T: K, then K 0.5, then K 0.25.
TEST(LatencyGains, ByHand) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  const auto gains = latency_gains(0.5 * one, one, one, 1_s, 2_s).value();
  ASSERT_EQ(gains.size(), 3u);
  EXPECT_NEAR(gains[0](0, 0), 0.5, 1e-15);
  EXPECT_NEAR(gains[1](0, 0), 0.25, 1e-15);
  EXPECT_NEAR(gains[2](0, 0), 0.125, 1e-15);
}

// Figure B.2: the compensated gains of the book's elevator at 5 ms and 50 ms print as 49.75, 0.13.
TEST(LatencyGains, IsTheBooksElevator) {
  const auto plant = discretize(book_elevator(), 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const auto gains = latency_gains(K, plant.A, plant.B, 5_ms, 50_ms).value();
  ASSERT_EQ(gains.size(), 11u);
  EXPECT_NEAR(gains.back()(0, 0), 49.75, 5e-3);
  EXPECT_NEAR(gains.back()(0, 1), 0.13, 5e-3);
  const auto steady = compensate_latency(K, plant, 50_ms).value();
  EXPECT_LT((gains.back() - Eigen::MatrixXd(steady)).norm(), 1e-12 * steady.norm());
  // At the start nothing is on its way: the state goes on freely for ten periods.
  Eigen::Matrix2d free = Eigen::Matrix2d::Identity();
  for (int k = 0; k < 10; ++k) {
    free = (free * plant.A).eval();
  }
  EXPECT_LT((gains[0] - Eigen::MatrixXd(K * free)).norm(), 1e-11 * K.norm());
}

// (B.11) at every step for fractions of a period.
TEST(LatencyGains, Fractions) {
  const auto plant = discretize(book_elevator(), 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const double periods = 3.4;
  const auto gains = latency_gains(K, plant.A, plant.B, 5_ms, Time(0.005 * periods)).value();
  ASSERT_EQ(gains.size(), 5u);
  Eigen::MatrixXd closed = Eigen::MatrixXd::Identity(2, 2);
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::MatrixXd expected =
        K * closed * powm(plant.A, periods - static_cast<double>(k)).value();
    EXPECT_LT((gains[k] - expected).norm(), 1e-11 * expected.norm());
    closed = (closed * (plant.A - plant.B * K)).eval();
  }
}

// The two cases of (B.9) meet at t = L, and the discrete ones approach them.
TEST(ContinuousLatencyGain, BothCases) {
  const auto elevator = book_elevator();
  const Eigen::RowVector2d K(30.0, 4.0);
  const auto at = [&](double t) {
    return continuous_latency_gain(K, elevator.A, elevator.B, 50_ms, Time(t)).value();
  };
  EXPECT_LT((at(0.05) - at(7.0)).norm(), 1e-14 * K.norm());
  EXPECT_LT((at(0.05 - 1e-9) - at(0.05)).norm(), 1e-6 * K.norm());
  const auto steady = compensate_latency(Eigen::Matrix<double, 1, 2>(K), elevator, 50_ms).value();
  EXPECT_LT((at(1.0) - Eigen::MatrixXd(steady)).norm(), 1e-12 * K.norm());
  const auto plant = discretize(elevator, Time(1e-5)).value();
  const auto gains = latency_gains(K, plant.A, plant.B, Time(1e-5), 50_ms).value();
  EXPECT_LT((gains[1000] - at(0.01)).norm(), 1e-2 * K.norm());
}

// The plant with ten inputs on their way is at rest where the plain loop is unstable (Figure B.1).
TEST(DelayCompensatedFeedback, SettlesWhereTheOtherDoesNot) {
  const auto plant = discretize(book_elevator(), 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const auto run = [&](bool compensated) {
    auto controller =
        DelayCompensatedFeedback<2, 1>::create(plant, K, 50_ms, Scalar(-12.0), Scalar(12.0))
            .value();
    std::deque<double> on_the_way(10, 0.0);
    Eigen::Vector2d x = Eigen::Vector2d::Zero();
    const Eigen::Vector2d r(1.524, 0.0);
    double worst = 0.0;
    for (int k = 0; k < 2000; ++k) {
      const double u = compensated ? controller.calculate(x, r, Scalar(0.0))(0)
                                   : std::clamp((K * (r - x)).value(), -12.0, 12.0);
      on_the_way.push_back(u);
      x = (plant.A * x + plant.B * on_the_way.front()).eval();
      on_the_way.pop_front();
      worst = k > 1500 ? std::max(worst, std::abs(x(0) - r(0))) : 0.0;
    }
    return worst;
  };
  EXPECT_LT(run(true), 1e-6);
  EXPECT_GT(run(false), 0.03);
}

// With the inputs remembered the loop with delay is the loop without, d periods later: exactly, and
// with limits in between; whole periods and fractions.
TEST(DelayPredictor, TakesTheDelayOutOfTheLoop) {
  const auto elevator = book_elevator();
  const auto plant = discretize(elevator, 5_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const Eigen::Vector2d r(1.524, 0.0);
  const Eigen::Vector2d start(0.1, -0.3);
  for (const double periods : {0.0, 1.0, 10.0, 0.3, 7.6}) {
    SCOPED_TRACE(periods);
    const Time latency(0.005 * periods);
    auto predictor = DelayPredictor<2, 1>::create(elevator, 5_ms, latency).value();
    const auto delayed = discretize_delayed_input(elevator.A, elevator.B, 5_ms, latency).value();
    std::deque<double> sent(static_cast<std::size_t>(delayed.whole_periods) + 1, 0.0);
    // Where the plant is when the first input begins to act: nothing has pushed it until then.
    const Eigen::Vector2d at_first = predictor.predict(start);
    Eigen::Vector2d undelayed = at_first;
    Eigen::Vector2d x = start;
    for (int k = 0; k < 400; ++k) {
      const Eigen::Vector2d ahead = predictor.predict(x);
      ASSERT_LT((ahead - undelayed).norm(), 1e-9) << k;
      const double u = std::clamp((K * (r - ahead)).value(), -12.0, 12.0);
      predictor.sent(Scalar(u));
      sent.push_back(u);
      x = (delayed.A * x + delayed.B_0 * sent[1] + delayed.B_1 * sent[0]).eval();
      sent.pop_front();
      undelayed = (plant.A * undelayed + plant.B * u).eval();
    }
    EXPECT_NEAR(x(0), r(0), 1e-6);
    predictor.reset();
    EXPECT_LT((predictor.predict(start) - at_first).norm(), 1e-15);
  }
}

TEST(DelayCompensation, AllocatesNothing) {
  const auto plant = discretize(book_elevator(), 5_ms).value();
  auto controller = DelayCompensatedFeedback<2, 1>::create(plant, Eigen::RowVector2d(30.0, 4.0),
                                                           20_ms, Scalar(-12.0), Scalar(12.0))
                        .value();
  auto predictor = DelayPredictor<2, 1>::create(book_elevator(), 5_ms, 22_ms).value();
  const Eigen::Vector2d state = Eigen::Vector2d::Zero();
  const Scalar input(0.0);
  static_assert(noexcept(controller.calculate(state, state, input)));
  static_assert(noexcept(predictor.predict(state)));
  static_assert(noexcept(predictor.sent(input)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector2d zero = Eigen::Vector2d::Zero();
  EXPECT_EQ(controller.calculate(zero * nan, zero, Scalar(0.0))(0), 0.0);
  controller.reset();
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    double sum = 0.0;
    for (int k = 0; k < 20; ++k) {
      sum += controller.calculate(zero, Eigen::Vector2d(0.1, 0.0), Scalar(0.0))(0);
      predictor.sent(Scalar(sum));
      sum += predictor.predict(zero)(0);
    }
    EXPECT_TRUE(std::isfinite(sum));
    EXPECT_EQ(counter.count(), 0u);
  }
}

TEST(DelayCompensation, FixedIsDynamic) {
  const auto fixed_plant = discretize(book_elevator(), 5_ms).value();
  const DiscreteSystem<> plant{fixed_plant.A, fixed_plant.B, fixed_plant.C, fixed_plant.D,
                               fixed_plant.period};
  const Eigen::RowVector2d K(30.0, 4.0);
  auto fixed =
      DelayCompensatedFeedback<2, 1>::create(fixed_plant, K, 12_ms, Scalar(-12.0), Scalar(12.0))
          .value();
  auto dynamic = DelayCompensatedFeedback<>::create(plant, K, 12_ms, Eigen::VectorXd(Scalar(-12.0)),
                                                    Eigen::VectorXd(Scalar(12.0)))
                     .value();
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector2d x(0.1 * random.normal(), random.normal());
    ASSERT_DOUBLE_EQ(fixed.calculate(x, Eigen::Vector2d::Zero(), Scalar(0.0))(0),
                     dynamic.calculate(x, Eigen::VectorXd::Zero(2), Eigen::VectorXd::Zero(1))(0));
  }
}

TEST(DelayCompensation, Errors) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  EXPECT_TRUE(latency_gains(one, one, one, 0_s, 1_s).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(
      latency_gains(one, one, one, 1_s, Time(-1.0)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(latency_gains(one, one, one, 1_s, Time(1e6)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(latency_gains(Eigen::MatrixXd::Ones(1, 2), one, one, 1_s, 1_s)
                  .error()
                  .is(ArgumentError::wrong_shape));
  // A - BK = -0.5 has no real half power.
  const auto fraction = latency_gains(1.5 * one, one, one, 1_s, Time(0.5));
  EXPECT_TRUE(fraction.error().is(MatrixFunctionError::no_real_power));
  EXPECT_TRUE(continuous_latency_gain(one, one, one, Time(-1.0), 1_s)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE((DelayPredictor<2, 1>::create(book_elevator(), 5_ms, Time(-1.0)))
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::delay_compensation_test
