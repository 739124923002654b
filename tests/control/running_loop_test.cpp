#include <flyball/control/running_loop.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/control/latency.hpp>
#include <flyball/control/margins.hpp>
#include <flyball/systems/input_delay.hpp>

#include "control/regulated_plant.hpp"
#include "support/oracle.hpp"

namespace flyball::running_loop_test {
namespace {

using namespace test;

const Eigen::Vector2d step_reference(1.0, 0.0);

/// The position at each sample of a reference that steps to one, written out in fine steps: the
/// plant is exact, the measurement `delay` old, a multiple of `fine`.
std::vector<double> stepped(const Regulated& d, const Eigen::RowVector2d& K, double delay,
                            int samples) {
  constexpr int parts = 20;
  const double T = d.model.period.si();
  const auto fine = discretize(d.truth, Time(T / parts)).value();
  const auto late = static_cast<std::size_t>(std::lround(delay / T * parts));
  std::vector<double> positions(late, 0.0);
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Vector2d x_hat = Eigen::Vector2d::Zero();
  double u = 0.0;
  std::vector<double> at_samples;
  for (int k = 0; k < samples; ++k) {
    positions.push_back(x(0));
    at_samples.push_back(x(0));
    const double y = positions[static_cast<std::size_t>(k * parts)];
    x_hat = d.model.A * x_hat + d.model.B * u;
    x_hat += d.K_e * (y - x_hat(0));
    u = K.dot(step_reference - x_hat);
    for (int i = 0; i < parts; ++i) {
      if (i > 0) {
        positions.push_back(x(0));
      }
      x = fine.A * x + fine.B * u;
    }
  }
  return at_samples;
}

// Rise, settling and overshoot of whole and broken delays, against the loop written out.
TEST(RunningLoop, StepsAsTheLoopWrittenOut) {
  const Regulated d = regulated_elevator();
  for (const double delay : {0.0, 0.02, 0.05, 0.013, 0.061}) {
    const auto loop = running_loop(d.truth, d.model, d.K, d.K_e, Time(delay)).value();
    const auto written = stepped(d, d.K, delay, 400);
    if (!std::isfinite(loop.time_constant)) {
      EXPECT_FALSE(step_of(loop, d.K * step_reference));
      EXPECT_GT(std::abs(written.back()), 2.0);
      continue;
    }
    const auto step = step_of(loop, d.K * step_reference).value();
    EXPECT_NEAR(step.final_value, 1.0, 1e-9);
    std::vector<double> times;
    for (std::size_t k = 0; k < written.size(); ++k) {
      times.push_back(static_cast<double>(k) * 0.02);
    }
    const auto metrics = response_metrics(times, written, 1.0).value();
    EXPECT_NEAR(step.metrics.overshoot, metrics.overshoot, 1e-9) << delay;
    EXPECT_NEAR(*step.metrics.settling_time, *metrics.settling_time, 1e-6) << delay;
    EXPECT_NEAR(*step.metrics.rise_time_10_90, *metrics.rise_time_10_90, 1e-6) << delay;
  }
}

// Without delay the loop has the regulator's and the observer's poles (separation); with one, its
// slowest pole is what the response decays with.
TEST(RunningLoop, HasThePolesOfTheLoopThatRuns) {
  const Regulated d = regulated_elevator();
  const auto plain = running_loop(d.truth, d.model, d.K, d.K_e, Time(0.0)).value();
  Eigen::VectorXcd separate(4);
  separate << test::eigenvalues(d.model.A - d.model.B * d.K),
      test::eigenvalues((Eigen::Matrix2d::Identity() - d.K_e * d.model.C) * d.model.A);
  ASSERT_EQ(plain.poles.size(), 4);
  for (const std::complex<double>& pole : plain.poles) {
    EXPECT_LT((separate.array() - pole).abs().minCoeff(), 1e-9);
  }
  // The README's elevator 200 ms late: 0.9931 and 2.9 s in place of 51 ms.
  const Regulated late =
      regulated(elevator(7.81208, 0.0468923), Time(0.02), bryson({0.02, 0.4}), bryson({12.0}),
                standard_deviations({1e-3, 0.05}), standard_deviations({1e-3}));
  const auto K =
      compensate_latency(late.K, late.model.A, late.model.B, late.model.period, Time(0.2)).value();
  const auto loop = running_loop(late.truth, late.model, K, late.K_e, Time(0.2)).value();
  EXPECT_EQ(loop.poles.size(), 14);
  EXPECT_NEAR(std::abs(loop.poles(0)), 0.9931, 1e-4);
  const auto opened = observer_regulator_loop(late.truth.A, late.truth.B, late.truth.C, late.model,
                                              K, late.K_e, Time(0.2))
                          .value();
  EXPECT_NEAR(closed_loop_radius(opened).value(), std::abs(loop.poles(0)), 1e-12);
  const auto written = stepped(late, K, 0.2, 701);
  EXPECT_NEAR((1.0 - written[700]) / (1.0 - written[600]), std::exp(-2.0 / loop.time_constant),
              1e-6);
}

// Two inputs, the states fed back: A - B K, and with one period of delay [A B; -K 0].
TEST(RunningLoop, TakesSeveralInputsAndNoObserver) {
  Eigen::Matrix2d A;
  A << -1.0, 0.5, 0.2, 0.3;
  const ContinuousSystem<> plant{A, Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Identity(),
                                 Eigen::Matrix2d::Zero()};
  const auto model = discretize(plant, Time(0.1)).value();
  const Eigen::MatrixXd K = lqr(model, bryson({0.1, 0.2}), bryson({1.0, 2.0})).value().K;
  const auto loop = running_loop(plant, model, K, Eigen::MatrixXd(), Time(0.1)).value();
  Eigen::Matrix4d closed;
  closed << model.A, model.B, -K, Eigen::Matrix2d::Zero();
  const Eigen::VectorXcd expected = test::eigenvalues(closed);
  ASSERT_EQ(loop.poles.size(), 4);
  for (const std::complex<double>& pole : loop.poles) {
    EXPECT_LT((expected.array() - pole).abs().minCoeff(), 1e-9);
  }
}

// With the delay's inputs in the regulator the loop has the poles that it has without delay, and 0.
TEST(PredictingRegulator, KeepsThePolesOfNoDelay) {
  const Regulated d = regulated_elevator();
  const auto plain = running_loop(d.truth, d.model, d.K, d.K_e, Time(0.0)).value();
  for (const double delay : {0.02, 0.033, 0.06, 0.2, 0.3}) {
    const auto made =
        predicting_regulator(d.truth, d.model.period, d.K, d.K_e, Time(delay)).value();
    const auto loop = running_loop(d.truth, made.model, made.K, made.K_e, Time(delay)).value();
    for (Eigen::Index i = 0; i < plain.poles.size(); ++i) {
      EXPECT_LT((loop.poles.array() - plain.poles(i)).abs().minCoeff(), 1e-9) << delay;
    }
    EXPECT_NEAR(std::abs(loop.poles(0)), std::abs(plain.poles(0)), 1e-9) << delay;
    // The delay's own are a Jordan block of up to 32 states, which rounding makes a ring of 0.3.
    EXPECT_EQ(loop.poles.tail(loop.poles.size() - plain.poles.size()).cwiseAbs().maxCoeff(), 0.0)
        << delay;
  }
}

TEST(RunningLoop, Errors) {
  const Regulated d = regulated_elevator();
  const auto error = [&](const Eigen::MatrixXd& K, const Eigen::MatrixXd& K_e, double delay) {
    return running_loop(d.truth, d.model, K, K_e, Time(delay)).error();
  };
  EXPECT_TRUE(error(Eigen::MatrixXd::Zero(2, 2), d.K_e, 0.0).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(error(d.K, Eigen::MatrixXd::Zero(1, 1), 0.0).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(error(d.K, d.K_e, 5.1).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error(d.K, d.K_e, -1.0).is(ArgumentError::out_of_range));
  auto fed_through = d.truth;
  fed_through.D(0, 0) = 1.0;
  EXPECT_TRUE(running_loop(fed_through, d.model, d.K, d.K_e, Time(0.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  const auto loop = running_loop(d.truth, d.model, d.K, d.K_e, Time(0.0)).value();
  EXPECT_TRUE(step_of(loop, Eigen::Vector2d::Zero()).error().is(ArgumentError::wrong_shape));
}

// Without feedback the loop falls apart: the plant's poles, the observer's and a chain of fifty
// zeros, which rounding would make a ring of radius 0.5.
TEST(RunningLoop, WithoutFeedbackPolesAreExact) {
  const Regulated d = regulated_elevator();
  const Eigen::RowVector2d none = Eigen::RowVector2d::Zero();
  const RunningLoop loop = running_loop(d.truth, d.model, none, d.K_e, Time(1.0)).value();
  const Eigen::VectorXcd plant = d.model.A.eigenvalues();
  const Eigen::VectorXcd observer =
      ((Eigen::MatrixXd::Identity(2, 2) - d.K_e * d.model.C) * d.model.A).eigenvalues();
  int zeros = 0;
  for (const auto& pole : loop.poles) {
    double nearest = std::abs(pole);
    zeros += nearest == 0.0 ? 1 : 0;
    for (const Eigen::VectorXcd* known : {&plant, &observer}) {
      nearest = std::min(nearest, (known->array() - pole).abs().minCoeff());
    }
    EXPECT_LT(nearest, 1e-12) << pole;
  }
  EXPECT_GE(zeros, 48);
  EXPECT_EQ(loop.poles(0), 1.0);
  EXPECT_TRUE(std::isinf(loop.time_constant));
}

}  // namespace
}  // namespace flyball::running_loop_test
