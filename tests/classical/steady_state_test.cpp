#include <flyball/classical/steady_state.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/classical/delay_response.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/transfer_cases.hpp"

namespace flyball::classical::steady_state_test {
namespace {

using Eigen::VectorXd;
using flyball::test::transfer;

// (E.9): a flywheel (E.7) under P control keeps 1/(1 + K_p K/(bR + K²)), under PI control nothing.
TEST(SteadyState, FlywheelOfE35) {
  const double J = 3.2284e-6;
  const double b = 3.5077e-6;
  const double L = 2.75e-6;
  const double R = 4.0;
  const double K = 0.0274;
  const double Kp = 0.5;
  const auto P = transfer({Kp * K}, {J * L, J * R + b * L, b * R + K * K});
  const auto error = steady_state_error(P).value();
  EXPECT_EQ(error.type, 0);
  EXPECT_TRUE(error.stable);
  EXPECT_NEAR(*error.step, 1.0 / (1.0 + Kp * K / (b * R + K * K)), 1e-15);
  EXPECT_EQ(*error.ramp, INFINITY);
  EXPECT_EQ(*error.parabola, INFINITY);
  const auto PI = series(P, transfer({1.0, 4.0}, {1.0, 0.0})).value();
  const auto none = steady_state_error(PI).value();
  EXPECT_EQ(none.type, 1);
  EXPECT_EQ(*none.step, 0.0);
  EXPECT_NEAR(*none.ramp * 4.0 * Kp * K / (b * R + K * K), 1.0, 1e-14);
}

// The error of the response to a ramp and a parabola, at its end.
TEST(SteadyState, AgreesWithTheResponse) {
  for (const double delay : {0.0, 0.1}) {
    const auto L = transfer({2.0, 3.0, 1.0}, {1.0, 4.0, 0.0, 0.0}, delay);
    const auto error = steady_state_error(L).value();
    EXPECT_EQ(error.type, 2);
    EXPECT_EQ(*error.ramp, 0.0);
    EXPECT_DOUBLE_EQ(*error.parabola, 4.0);
    const auto loop = feedback(DelaySystem::create(L).value()).value();
    const auto double_integrator = DelaySystem::create(transfer({1.0}, {1.0, 0.0, 0.0})).value();
    const auto made =
        step_response(series(double_integrator, loop).value(), 0, ResponseTimes{Time(1.0), 81})
            .value();
    EXPECT_NEAR(0.5 * 80.0 * 80.0 - made.y(80, 0), 4.0, 1e-6) << delay;
  }
  // An unstable loop has no steady state.
  const auto unstable = steady_state_error(transfer({100.0}, {1.0, 1.0, 0.0}, 1.0)).value();
  EXPECT_EQ(unstable.type, 1);
  EXPECT_FALSE(unstable.stable);
  EXPECT_FALSE(unstable.ramp.has_value());
}

// Discrete: K_v = lim (z - 1)L/T.
TEST(SteadyState, DiscreteLoops) {
  const auto L = TransferFunction::create(VectorXd{{0.1}}, VectorXd{{1.0, -1.5, 0.5}}, Time(0.2));
  const auto error = steady_state_error(*L).value();
  EXPECT_EQ(error.type, 1);
  EXPECT_NEAR(error.velocity_constant, 0.1 / 0.5 / 0.2, 1e-15);
  EXPECT_EQ(*error.step, 0.0);
  EXPECT_NEAR(*error.ramp, 1.0, 1e-15);
}

TEST(SteadyState, ValueTheorems) {
  // Y = (2s + 3)/(s (s + 1)(s + 2)): y(0+) = 0, y(∞) = 3/2.
  const auto Y = transfer({2.0, 3.0}, {1.0, 3.0, 2.0, 0.0});
  EXPECT_EQ(initial_value(Y).value(), 0.0);
  EXPECT_EQ(final_value(Y).value(), 1.5);
  EXPECT_EQ(initial_value(transfer({2.0, 3.0}, {1.0, 3.0, 2.0})).value(), 2.0);
  EXPECT_EQ(final_value(transfer({2.0, 3.0}, {1.0, 3.0, 2.0})).value(), 0.0);
  EXPECT_EQ(initial_value(transfer({2.0, 3.0}, {1.0, 3.0, 2.0}, 1.0)).value(), 0.0);
  // What the theorem would tell of signals without a limit: of 1/(s - 1) it says 0.
  const auto grows = final_value(transfer({1.0}, {1.0, -1.0}));
  EXPECT_TRUE(grows.error().is(SystemError::not_stable));
  EXPECT_EQ(grows.error().evidence()[0].values[0], 1.0);
  EXPECT_TRUE(final_value(transfer({1.0}, {1.0, 0.0, 4.0})).error().is(SystemError::not_stable));
  EXPECT_TRUE(final_value(transfer({1.0}, {1.0, 0.0, 0.0})).error().is(SystemError::not_stable));
  // A zero at rest takes one of the two integrators away.
  EXPECT_EQ(final_value(transfer({3.0, 0.0}, {1.0, 2.0, 0.0, 0.0})).value(), 1.5);
  EXPECT_TRUE(initial_value(transfer({1.0, 0.0}, {1.0, 1.0})).error().is(TransferError::improper));
  const auto step =
      TransferFunction::create(VectorXd{{0.5, 0.0}}, VectorXd{{1.0, -1.5, 0.5}}, Time(1.0));
  EXPECT_NEAR(final_value(*step).value(), 1.0, 1e-15);
  EXPECT_EQ(initial_value(*step).value(), 0.0);
  EXPECT_TRUE(
      final_value(*TransferFunction::create(VectorXd{{1.0}}, VectorXd{{1.0, 1.0}}, Time(1.0)))
          .error()
          .is(SystemError::not_stable));
}

}  // namespace
}  // namespace flyball::classical::steady_state_test
