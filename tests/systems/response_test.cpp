#include <flyball/systems/response.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

#include "support/laws.hpp"
#include "systems/random_systems.hpp"

namespace flyball::response_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

// dx/dt = -2x + 3u, y = x + 0.5u: step 1.5 (1 - e^{-2t}) + 0.5, impulse 3e^{-2t}, and x0 decays as
// e^{-2t}. Six time constants are 3 s.
TEST(Response, FirstOrderLag) {
  const ContinuousSystem<> lag{scalar(-2.0), scalar(3.0), scalar(1.0), scalar(0.5)};
  const auto step = step_response(lag).value();
  ASSERT_EQ(step.time.size(), 601);
  EXPECT_NEAR(step.time(600), 3.0, 1e-14);
  const auto impulse = impulse_response(lag).value();
  const auto initial = initial_response(lag, scalar(4.0)).value();
  for (Index k = 0; k < step.time.size(); ++k) {
    const double decay = std::exp(-2.0 * step.time(k));
    EXPECT_NEAR(step.y(k, 0), 1.5 * (1.0 - decay) + 0.5, 2e-14);
    EXPECT_NEAR(impulse.y(k, 0), 3.0 * decay, 2e-14);
    EXPECT_NEAR(initial.y(k, 0), 4.0 * decay, 2e-14);
  }
}

// A double integrator has the step response t²/2, at any step: the hold is exact.
TEST(Response, IsExactHoweverLongTheStep) {
  const ContinuousSystem<> cart{(MatrixXd(2, 2) << 0, 1, 0, 0).finished(),
                                (MatrixXd(2, 1) << 0, 1).finished(),
                                (MatrixXd(1, 2) << 1, 0).finished(), scalar(0.0)};
  const auto step = step_response(cart, 0, ResponseTimes{Time(100.0), 4}).value();
  for (Index k = 0; k < 4; ++k) {
    EXPECT_NEAR(step.y(k, 0), 0.5 * step.time(k) * step.time(k), 1e-9);
  }
}

// x⁺ = 0.5x + u, y = 3x + 2u: step 2 + 6 (1 - 0.5ᵏ); pulse 2, 3, 1.5, 0.75, …
TEST(Response, DiscreteLag) {
  const DiscreteSystem<> lag{scalar(0.5), scalar(1.0), scalar(3.0), scalar(2.0), Time(0.02)};
  const auto step = step_response(lag).value();
  const auto pulse = impulse_response(lag).value();
  const auto initial = initial_response(lag, scalar(8.0)).value();
  EXPECT_EQ(step.time(1), 0.02);
  for (Index k = 0; k < step.time.size(); ++k) {
    const double power = std::pow(0.5, static_cast<double>(k));
    EXPECT_NEAR(step.y(k, 0), 2.0 + 6.0 * (1.0 - power), 1e-14);
    EXPECT_NEAR(pulse.y(k, 0), k == 0 ? 2.0 : 6.0 * power, 1e-14);
    EXPECT_NEAR(initial.y(k, 0), 24.0 * power, 1e-14);
  }
}

// Superposition: what an input and an initial state do is the sum of what each sample of each input
// and the state do alone; a step is the sum of the impulses before it.
TEST(Response, IsLinear) {
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const ContinuousSystem<> plant = test::random_stable_system(random, 4, 2, 3);
    const Time period(0.1);
    const DiscreteSystem<> held = discretize(plant, period).value();
    const MatrixXd u = test::random_matrix(random, 30, 2);
    const VectorXd x0 = test::random_matrix(random, 4, 1);
    const auto forced = forced_response(plant, u, x0, period).value();
    const ResponseTimes times{period, 30};
    MatrixXd sum = initial_response(plant, x0, times).value().y;
    for (Index input = 0; input < 2; ++input) {
      const MatrixXd pulse = impulse_response(held, input, times).value().y;
      MatrixXd steps = MatrixXd::Zero(30, 3);
      for (Index k = 0; k < 30; ++k) {
        sum.bottomRows(30 - k) += u(k, input) * pulse.topRows(30 - k);
        steps.bottomRows(30 - k) += pulse.topRows(30 - k);
      }
      EXPECT_LT((step_response(plant, input, times).value().y - steps).norm(), 1e-12);
    }
    EXPECT_LT((forced.y - sum).norm(), 1e-12 * (1.0 + sum.norm()));
    EXPECT_EQ(forced_response(held, u, x0).value().y, forced.y);
    EXPECT_LT((forced.x.row(30).transpose() - held.A * forced.x.row(29).transpose() -
               held.B * u.row(29).transpose())
                  .norm(),
              1e-13);
  }
}

// A mode that grows, e^t, is shown for 5 s though another settles in 600 s; an oscillation of
// 8 rad/s for 40/8 s; a pole of 1e200 for the two samples that a double holds.
// One input and one output of up to six states have a way of their own: the same as of two.
TEST(Response, OfOneInputAndOneOutput) {
  Random random(4);
  for (Index n = 1; n <= 8; ++n) {
    MatrixXd A(n, n);
    MatrixXd B(n, 1);
    MatrixXd C(1, n);
    MatrixXd u(200, 1);
    for (MatrixXd* M : {&A, &B, &C, &u}) {
      for (double& entry : M->reshaped()) {
        entry = random.normal();
      }
    }
    A *= 0.9 / A.norm();
    const MatrixXd x0 = B;
    MatrixXd two(2, n);
    two << C, -C;
    const DiscreteSystem<> one{A, B, C, scalar(0.7), Time(0.1)};
    const DiscreteSystem<> both{A, B, two, MatrixXd::Constant(2, 1, 0.7), Time(0.1)};
    const auto single = forced_response(one, u, x0).value();
    const auto general = forced_response(both, u, x0).value();
    EXPECT_LE((single.x - general.x).norm(), 1e-14 * general.x.norm());
    EXPECT_LE((single.y - general.y.col(0)).norm(), 1e-14 * general.y.norm());
  }
}

TEST(Response, ChoosesItsTimes) {
  const auto end_of = [](const MatrixXd& A) {
    const ResponseTimes times = response_times(analyze_modes(A, TimeDomain::continuous).value());
    return times.step.si() * static_cast<double>(times.samples - 1);
  };
  EXPECT_NEAR(end_of((MatrixXd(2, 2) << 1, 0, 0, -0.01).finished()), 5.0, 1e-12);
  EXPECT_NEAR(end_of((MatrixXd(2, 2) << 0, 8, -8, 0).finished()), 5.0, 1e-12);
  EXPECT_NEAR(end_of(scalar(0.0)), 1.0, 1e-12);
  const auto samples_of = [](double pole) {
    return response_times(analyze_modes(scalar(pole), TimeDomain::discrete, Time(0.02)).value(),
                          Time(0.02))
        .samples;
  };
  EXPECT_EQ(samples_of(0.5), 11);
  EXPECT_EQ(samples_of(0.999999), 2001);
  EXPECT_EQ(samples_of(1e200), 2);
  EXPECT_TRUE(step_response(DiscreteSystem<>{scalar(1e200), scalar(1.0), scalar(1.0), scalar(0.0),
                                             Time(0.02)})
                  .has_value());
}

TEST(Response, Refusals) {
  const ContinuousSystem<> lag{scalar(-2.0), scalar(3.0), scalar(1.0), scalar(0.0)};
  const DiscreteSystem<> held = discretize(lag, Time(0.1)).value();
  const auto refused = [](const Expected<LinearResponse>& response, ArgumentError code) {
    return !response && response.error().is(code);
  };
  using enum ArgumentError;
  EXPECT_TRUE(refused(forced_response(held, MatrixXd::Ones(5, 2), scalar(0.0)), wrong_shape));
  EXPECT_TRUE(
      refused(forced_response(lag, scalar(1.0), MatrixXd::Ones(2, 1), Time(0.1)), wrong_shape));
  EXPECT_TRUE(refused(forced_response(lag, scalar(NAN), scalar(0.0), Time(0.1)), not_finite));
  EXPECT_TRUE(refused(forced_response(lag, scalar(1.0), scalar(0.0), Time(0.0)), not_positive));
  EXPECT_TRUE(refused(impulse_response(lag, -1), out_of_range));
  EXPECT_TRUE(refused(step_response(lag, 0, ResponseTimes{Time(0.1), 0}), out_of_range));
  EXPECT_TRUE(refused(initial_response(lag, scalar(INFINITY)), not_finite));
  const DiscreteSystem<> fast{scalar(1e100), scalar(1.0), scalar(1.0), scalar(0.0), Time(0.1)};
  EXPECT_TRUE(refused(step_response(fast, 0, ResponseTimes{Time(0.1), 10}), not_finite));
  EXPECT_EQ(to_string(step_response(lag, 1).error()),
            "step_response: input is 1; it must be from 0 to 0: B has 1 column");
  EXPECT_EQ(to_string(step_response(held, 0, ResponseTimes{Time(0.2), 3}).error()),
            "step_response: step is 0.2 s; it must be the system's period, 0.1 s");
}

}  // namespace
}  // namespace flyball::response_test
