#include <flyball/control/pid_tuning.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball {
namespace {

using namespace flyball::literals;

/// 1/(s + 1)³ sampled: K_u = 8 and T_u = 2π/√3 in continuous time.
DiscreteSystem<> three_lags(Time period) {
  ContinuousSystem<> system;
  system.A = Eigen::Matrix3d{{-1.0, 1.0, 0.0}, {0.0, -1.0, 1.0}, {0.0, 0.0, -1.0}};
  system.B = Eigen::Vector3d(0.0, 0.0, 1.0);
  system.C = Eigen::RowVector3d(1.0, 0.0, 0.0);
  system.D = Eigen::MatrixXd::Zero(1, 1);
  return discretize(system, period).value();
}

DiscreteSystem<> first_order_with_delay(double gain, double tau, int delay, double T) {
  const double a = std::exp(-T / tau);
  const Eigen::Index n = 1 + delay;
  DiscreteSystem<> system;
  system.A = Eigen::MatrixXd::Zero(n, n);
  system.A(0, 0) = a;
  system.A(0, 1) = gain * (1.0 - a);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    system.A(i, i + 1) = 1.0;
  }
  system.B = Eigen::MatrixXd::Zero(n, 1);
  system.B(n - 1, 0) = 1.0;
  system.C = Eigen::MatrixXd::Zero(1, n);
  system.C(0, 0) = 1.0;
  system.D = Eigen::MatrixXd::Zero(1, 1);
  system.period = Time(T);
  return system;
}

DiscreteSystem<> elevator() {
  const auto plant =
      discretize(mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value(), 20_ms);
  return {plant->A, plant->B, plant->C, plant->D, plant->period};
}

// The describing function's error for this plant is some per cent.
TEST(RelayExperiment, FindsTheUltimatePoint) {
  const auto point = relay_experiment(three_lags(1_ms), 1.0, 0.0, 0.0, 60.0).value();
  EXPECT_NEAR(point.period, 2.0 * std::numbers::pi / std::sqrt(3.0), 0.02 * 3.63);
  EXPECT_NEAR(point.gain, 8.0, 0.08 * 8.0);
  EXPECT_GT(point.amplitude, 0.1);
  // The relay's height does not matter to a linear plant.
  const auto higher = relay_experiment(three_lags(1_ms), 5.0, 0.0, 0.0, 60.0).value();
  EXPECT_NEAR(higher.gain, point.gain, 1e-6 * point.gain);
  EXPECT_NEAR(higher.period, point.period, 1e-6);
}

TEST(RelayExperiment, SaysWhereNothingOscillates) {
  // A bias that the relay cannot turn around.
  const auto stuck = relay_experiment(three_lags(10_ms), 1.0, 0.0, 5.0, 60.0);
  EXPECT_TRUE(stuck.error().is(TuningError::no_oscillation));
  // One lag has no phase crossover but the sample rate's.
  const auto chatter =
      relay_experiment(first_order_with_delay(1.0, 1.0, 1, 0.01), 1.0, 0.0, 0.0, 60.0);
  ASSERT_TRUE(chatter.has_value() || chatter.error().is(TuningError::no_oscillation));
  EXPECT_TRUE(relay_experiment(three_lags(10_ms), 0.0, 0.0, 0.0, 60.0)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(relay_experiment(three_lags(10_ms), 1.0, -1.0, 0.0, 60.0)
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(relay_experiment(three_lags(10_ms), 1.0, 0.0, 0.0, 0.01)
                  .error()
                  .is(ArgumentError::out_of_range));
}

// A first-order plant with a delay of 0.5 s is what the curve says it is.
TEST(ReactionCurve, FindsTheModel) {
  const auto curve =
      reaction_curve(first_order_with_delay(2.0, 1.5, 500, 0.001), 3.0, 15.0).value();
  EXPECT_NEAR(curve.gain, 2.0, 1e-3);
  EXPECT_NEAR(curve.time_constant, 1.5, 2e-3);
  EXPECT_NEAR(curve.delay, 0.5, 3e-3);
}

TEST(ReactionCurve, RefusesWhatDoesNotSettle) {
  // An elevator integrates.
  EXPECT_TRUE(reaction_curve(elevator(), 1.0, 5.0).error().is(TuningError::no_reaction));
  const std::vector<double> times{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_TRUE(reaction_curve(times, std::vector<double>(10, 1.0), 1.0)
                  .error()
                  .is(TuningError::no_reaction));
  EXPECT_TRUE(reaction_curve(times, std::vector<double>(9, 1.0), 1.0)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(reaction_curve(times, std::vector<double>(10, 1.0), 0.0)
                  .error()
                  .is(ArgumentError::not_positive));
}

// The published tables, at numbers that are easy to check by hand.
TEST(TuningRules, AreTheTables) {
  const UltimatePoint point{.gain = 10.0, .period = 4.0};
  EXPECT_EQ(ziegler_nichols(point, PidForm::p).value(), (PidGains{5.0, 0.0, 0.0}));
  const auto zn = ziegler_nichols(point, PidForm::pid).value();
  EXPECT_DOUBLE_EQ(zn.kp, 6.0);
  EXPECT_DOUBLE_EQ(zn.ki, 3.0);
  EXPECT_DOUBLE_EQ(zn.kd, 3.0);
  const auto pi = ziegler_nichols(point, PidForm::pi).value();
  EXPECT_NEAR(pi.ki, 4.5 * 1.2 / 4.0, 1e-15);
  const auto tl = tyreus_luyben(point, PidForm::pi).value();
  EXPECT_DOUBLE_EQ(tl.kp, 3.125);
  EXPECT_NEAR(tl.ki, 3.125 / 8.8, 1e-15);

  const ReactionCurve curve{.gain = 2.0, .time_constant = 4.0, .delay = 1.0};
  EXPECT_DOUBLE_EQ(ziegler_nichols(curve, PidForm::p).value().kp, 2.0);
  const auto reaction = ziegler_nichols(curve, PidForm::pid).value();
  EXPECT_DOUBLE_EQ(reaction.kp, 2.4);
  EXPECT_DOUBLE_EQ(reaction.ki, 1.2);
  EXPECT_DOUBLE_EQ(reaction.kd, 1.2);
  // θ/τ = 1/4: K_c = 2 (4/3 + 1/16), T_i = 33.5/15, T_d = 4/11.5.
  const auto cc = cohen_coon(curve, PidForm::pid).value();
  EXPECT_NEAR(cc.kp, 2.0 * (4.0 / 3.0 + 0.0625), 1e-14);
  EXPECT_NEAR(cc.kp / cc.ki, 33.5 / 15.0, 1e-14);
  EXPECT_NEAR(cc.kd / cc.kp, 4.0 / 11.5, 1e-14);
  // τ_c = θ: K_c = 4/(2·2) = 1, T_i = min(4, 8).
  const auto tight = simc(curve, 1.0, PidForm::pi).value();
  EXPECT_DOUBLE_EQ(tight.kp, 1.0);
  EXPECT_DOUBLE_EQ(tight.ki, 0.25);
  const auto series = simc(curve, 1.0, PidForm::pid).value();
  EXPECT_DOUBLE_EQ(series.kp, 1.125);
  EXPECT_DOUBLE_EQ(series.ki, 0.25);
  EXPECT_DOUBLE_EQ(series.kd, 0.5);
}

// Each rule's loop settles on the plant that it was made for.
TEST(TuningRules, Settle) {
  const auto plant = first_order_with_delay(2.0, 1.5, 50, 0.01);
  const auto curve = reaction_curve(plant, 1.0, 15.0).value();
  const auto point = relay_experiment(plant, 1.0, 0.01, 0.0, 60.0).value();
  TuningScenario scenario;
  scenario.duration = 30.0;
  scenario.settings.derivative_on_measurement = true;
  scenario.settings.derivative_time_constant = 0.05;
  for (const PidForm form : {PidForm::pi, PidForm::pid}) {
    for (const PidGains& gains :
         {ziegler_nichols(point, form).value(), tyreus_luyben(point, form).value(),
          ziegler_nichols(curve, form).value(), cohen_coon(curve, form).value(),
          simc(curve, 0.5, form).value()}) {
      const auto response = simulate_pid(plant, gains, scenario).value();
      EXPECT_LT(std::abs(response.metrics.steady_state_error), 0.02)
          << gains.kp << " " << gains.ki << " " << gains.kd;
      EXPECT_LT(response.metrics.overshoot, 0.9);
    }
  }
  const auto calm = simulate_pid(plant, simc(curve, 0.5, PidForm::pi).value(), scenario).value();
  EXPECT_LT(calm.metrics.overshoot, 0.1);
}

// s² + 2ζω s + ω² for the elevator and the flywheel, from the closed loops' eigenvalues.
TEST(GainsByPoles, AreThePoles) {
  const auto lift = mechanisms::elevator({.kS = 0.0, .kV = 4.0, .kA = 0.3, .kG = 0.0}).value();
  const auto pd = pd_by_poles(lift, 8.0, 0.7).value();
  const Eigen::Matrix2d closed = lift.A - lift.B * Eigen::RowVector2d(pd.kp, pd.kd);
  EXPECT_NEAR(closed.determinant(), 64.0, 1e-11);
  EXPECT_NEAR(-closed.trace(), 2.0 * 0.7 * 8.0, 1e-12);
  EXPECT_EQ(pd.ki, 0.0);
  const auto wheel = mechanisms::flywheel({.kS = 0.0, .kV = 0.02, .kA = 0.01, .kG = 0.0}).value();
  const auto pi = pi_by_poles(wheel, 5.0, 1.0).value();
  // s (s - a + b kp) + b ki.
  EXPECT_NEAR(-wheel.A(0) + wheel.B(0) * pi.kp, 10.0, 1e-12);
  EXPECT_NEAR(wheel.B(0) * pi.ki, 25.0, 1e-11);
  const auto plant = discretize(lift, 20_ms).value();
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  const auto by_lqr = pd_by_lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  EXPECT_EQ(by_lqr.kp, design.K(0));
  EXPECT_EQ(by_lqr.kd, design.K(1));
  EXPECT_TRUE(pd_by_poles(lift, 0.0, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(pi_by_poles(wheel, 1.0, -1.0).error().is(ArgumentError::not_positive));
  ContinuousSystem<2, 1, 1> other = lift;
  other.A(0, 1) = 2.0;
  EXPECT_TRUE(pd_by_poles(other, 1.0, 1.0).error().is(ArgumentError::malformed));
}

// Section 2.6 on an elevator: Kp until it oscillates, Kd until it does not, no Ki.
TEST(ManualTuning, Elevator) {
  TuningScenario scenario;
  scenario.settings.output_min = -12.0;
  scenario.settings.output_max = 12.0;
  scenario.reference = 0.5;
  scenario.duration = 4.0;
  const auto tuning = tune_manually(elevator(), scenario, false);
  ASSERT_TRUE(tuning.has_value()) << to_string(tuning.error());
  EXPECT_GT(tuning->gains.kp, 0.0);
  EXPECT_GT(tuning->gains.kd, 0.0);
  EXPECT_EQ(tuning->gains.ki, 0.0);
  EXPECT_LT(tuning->response.metrics.overshoot, 0.05);
  ASSERT_TRUE(tuning->response.metrics.settling_time.has_value());
  EXPECT_LT(*tuning->response.metrics.settling_time, 2.5);
  ASSERT_GE(tuning->steps.size(), 4u);
  EXPECT_EQ(tuning->steps.front().gains, PidGains{});
  for (const TuningStep& step : tuning->steps) {
    EXPECT_FALSE(step.seen.empty());
    EXPECT_FALSE(step.decided.empty());
  }
}

// Gravity leaves an error that only Ki removes.
TEST(ManualTuning, IntegralWhereAnErrorRemains) {
  TuningScenario scenario;
  scenario.settings.output_min = -12.0;
  scenario.settings.output_max = 12.0;
  scenario.reference = 0.5;
  scenario.duration = 4.0;
  scenario.disturbance = -2.0;
  const auto tuning = tune_manually(elevator(), scenario, false);
  ASSERT_TRUE(tuning.has_value()) << to_string(tuning.error());
  EXPECT_LT(std::abs(tuning->response.metrics.steady_state_error), 0.02 * 0.5);
}

// A flywheel: Kp taken back to where nothing oscillates, no Kd, Ki for the rest.
TEST(ManualTuning, Flywheel) {
  const auto sampled =
      discretize(mechanisms::flywheel({.kS = 0.0, .kV = 0.02, .kA = 0.01, .kG = 0.0}).value(),
                 20_ms)
          .value();
  const DiscreteSystem<> plant{sampled.A, sampled.B, sampled.C, sampled.D, sampled.period};
  TuningScenario scenario;
  scenario.settings.output_min = -12.0;
  scenario.settings.output_max = 12.0;
  scenario.reference = 400.0;
  scenario.duration = 5.0;
  const auto tuning = tune_manually(plant, scenario, true);
  ASSERT_TRUE(tuning.has_value()) << to_string(tuning.error());
  EXPECT_EQ(tuning->gains.kd, 0.0);
  EXPECT_LT(std::abs(tuning->response.metrics.steady_state_error), 0.02 * 400.0);
  EXPECT_LT(tuning->response.metrics.overshoot, 0.06);
}

TEST(Tuning, Errors) {
  DiscreteSystem<> two = elevator();
  two.B = Eigen::MatrixXd::Ones(2, 2);
  two.D = Eigen::MatrixXd::Zero(two.C.rows(), 2);
  EXPECT_TRUE(tune_manually(two, {}, false).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(simulate_pid(two, {}, {}).error().is(ArgumentError::wrong_shape));
  TuningScenario scenario;
  scenario.reference = 0.0;
  EXPECT_TRUE(simulate_pid(elevator(), {}, scenario).error().is(ArgumentError::not_positive));
  scenario.reference = 1.0;
  scenario.duration = 1e9;
  EXPECT_TRUE(simulate_pid(elevator(), {}, scenario).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(ziegler_nichols(UltimatePoint{}, PidForm::p).error().is(ArgumentError::not_positive));
  const ReactionCurve immediate{.gain = 1.0, .time_constant = 1.0, .delay = 0.0};
  EXPECT_TRUE(ziegler_nichols(immediate, PidForm::p).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(cohen_coon(immediate, PidForm::p).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(simc(immediate, 0.0, PidForm::pi).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(simc(immediate, 0.5, PidForm::pi).has_value());
  // An input that moves nothing.
  DiscreteSystem<> dead = elevator();
  dead.B.setZero();
  EXPECT_TRUE(tune_manually(dead, {}, false).error().is(TuningError::nothing_improves));
}

}  // namespace
// Times that stand still or go back would give a time constant of zero or below.
TEST(ReactionCurve, RefusesTimesThatDoNotIncrease) {
  std::vector<double> times;
  std::vector<double> values;
  for (int k = 0; k <= 50; ++k) {
    times.push_back(0.2 * k);
    values.push_back(1.0 - std::exp(-0.2 * k));
  }
  ASSERT_TRUE(reaction_curve(times, values, 1.0));
  std::swap(times[3], times[4]);
  const auto refused = reaction_curve(times, values, 1.0);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ArgumentError::out_of_range));
  EXPECT_NE(to_string(refused.error()).find("times[4]"), std::string::npos);
}

}  // namespace flyball
