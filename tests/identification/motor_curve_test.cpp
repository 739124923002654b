#include <flyball/identification/motor_curve.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>

namespace flyball::identification::motor_curve_test {
namespace {

using Eigen::VectorXd;

/// Rows of a motor of the table, from stall to no load.
MotorCurve curve_of(const mechanisms::DcMotor& motor, Eigen::Index rows) {
  MotorCurve curve;
  curve.voltage = motor.nominal_voltage;
  curve.speed = VectorXd::LinSpaced(rows, 0.0, motor.free_speed);
  const Eigen::ArrayXd share = curve.speed.array() / motor.free_speed;
  curve.torque = motor.stall_torque * (1.0 - share);
  curve.current = motor.stall_current + (motor.free_current - motor.stall_current) * share;
  return curve;
}

// Equations 12.4 to 12.6 by the row of stall and the one without load.
TEST(MotorCurve, GivesTheConstantsOfEachMotorOfTheTable) {
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    const mechanisms::DcMotor truth = mechanisms::motor(entry.name).value();
    const auto found = fit_motor_curve(entry.name, curve_of(truth, 101));
    ASSERT_TRUE(found) << entry.name << ": " << to_string(found.error());
    EXPECT_NEAR(found->motor.free_speed / truth.free_speed, 1.0, 1e-12) << entry.name;
    EXPECT_NEAR(found->motor.free_current / truth.free_current, 1.0, 1e-11) << entry.name;
    EXPECT_NEAR(found->R.value / truth.R, 1.0, 1e-12) << entry.name;
    EXPECT_NEAR(found->Kt.value / truth.Kt, 1.0, 1e-12) << entry.name;
    EXPECT_NEAR(found->Kv.value / truth.Kv, 1.0, 1e-12) << entry.name;
    EXPECT_LT(found->torque_deviation + found->current_deviation, 1e-13) << entry.name;
    EXPECT_EQ(found->motor.R, found->R.value);
  }
}

TEST(MotorCurve, IntervalsHoldTheTruth) {
  const mechanisms::DcMotor truth = mechanisms::motor("CIM").value();
  Random random(3);
  int held[3] = {0, 0, 0};
  constexpr int draws = 1000;
  for (int draw = 0; draw < draws; ++draw) {
    MotorCurve curve = curve_of(truth, 25);
    for (Eigen::Index i = 0; i < curve.speed.size(); ++i) {
      curve.torque(i) += 0.02 * random.normal();
      curve.current(i) += 1.5 * random.normal();
    }
    const auto found = fit_motor_curve("CIM", curve).value();
    const double values[3] = {truth.R, truth.Kt, truth.Kv};
    const GainEstimate* gains[3] = {&found.R, &found.Kt, &found.Kv};
    for (int k = 0; k < 3; ++k) {
      held[k] += gains[k]->interval[0] <= values[k] && values[k] <= gains[k]->interval[1] ? 1 : 0;
    }
  }
  for (const int count : held) {
    EXPECT_GT(count, 0.92 * draws);
    EXPECT_LT(count, 0.98 * draws);
  }
}

TEST(MotorCurve, ALockedRotorHeats) {
  constexpr Eigen::Index rows = 80;
  LockedRotor run;
  run.time = VectorXd::LinSpaced(rows, 0.0, 30.0);
  run.voltage = VectorXd::Constant(rows, 6.0);
  run.current = 6.0 / (0.09 * (1.0 + 0.01 * run.time.array()));
  run.torque = 0.0184 * run.current;
  const auto exact = fit_locked_rotor(run).value();
  EXPECT_NEAR(exact.R.value, 0.09, 1e-12);
  EXPECT_NEAR(exact.Kt.value, 0.0184, 1e-14);
  // 1.25 times the third row's R is reached after 25.9 s; rows are 30/79 s apart.
  EXPECT_EQ(exact.rows, 69);
  EXPECT_NEAR(exact.R_rise, 0.01 * run.time(68), 1e-10);
  // What burns after that changes nothing.
  LockedRotor burnt = run;
  burnt.current.tail(11).setConstant(1.0);
  EXPECT_EQ(fit_locked_rotor(burnt)->R.value, exact.R.value);
  Random random(4);
  for (Eigen::Index i = 0; i < rows; ++i) {
    run.torque(i) += 0.01 * random.normal();
    run.current(i) *= 1.0 + 0.005 * random.normal();
  }
  const auto noisy = fit_locked_rotor(run).value();
  EXPECT_NEAR(noisy.R.value, 0.09, 4.0 * noisy.R.standard_error);
  EXPECT_NEAR(noisy.Kt.value, 0.0184, 4.0 * noisy.Kt.standard_error);
  EXPECT_LT(noisy.R.standard_error, 0.001);
}

// R = R_0 (1 + α E/C) with E the trapezoidal energy of the rows themselves.
TEST(MotorCurve, ALockedRotorTellsTheHeatOfItsWindings) {
  constexpr double C = 45.0;
  constexpr Eigen::Index rows = 60;
  LockedRotor run;
  run.time = VectorXd::LinSpaced(rows, 0.0, 5.0);
  run.voltage = VectorXd::Constant(rows, 4.0);
  run.current = VectorXd::Constant(rows, 4.0 / 0.09);
  double energy = 0.0;
  for (Eigen::Index k = 1; k < rows; ++k) {
    double more = 0.0;
    for (int i = 0; i < 60; ++i) {
      run.current(k) = 4.0 / (0.09 * (1.0 + 0.00393 * (energy + more) / C));
      more = 2.0 * (run.current(k) + run.current(k - 1)) * (run.time(k) - run.time(k - 1));
    }
    energy += more;
  }
  run.torque = 0.0184 * run.current;
  const auto found = fit_locked_rotor(run).value();
  ASSERT_TRUE(found.heat_capacity.determined);
  EXPECT_NEAR(found.heat_capacity.value, C, 1e-9 * C);
  // A first sample that is torn between before and after: R_0 is then the next row's, 0.13 % up.
  const double whole = run.current(0);
  run.current(0) *= 0.6;
  const auto torn = fit_locked_rotor(run).value();
  ASSERT_TRUE(torn.heat_capacity.determined);
  EXPECT_NEAR(torn.heat_capacity.value, C, 3e-3 * C);
  run.current(0) = whole;
  // What does not warm tells nothing.
  run.current.setConstant(40.0);
  EXPECT_FALSE(fit_locked_rotor(run)->heat_capacity.determined);
}

TEST(MotorCurve, Refusals) {
  const MotorCurve good = curve_of(mechanisms::motor("NEO").value(), 5);
  const auto code_of = [](const MotorCurve& curve) {
    const auto found = fit_motor_curve("motor", curve);
    return found ? std::string("answered") : std::string(found.error().code());
  };
  EXPECT_EQ(code_of(good), "answered");
  MotorCurve bad = good;
  bad.voltage = 0.0;
  EXPECT_EQ(code_of(bad), "not_positive");
  bad = good;
  bad.torque = -bad.torque;
  EXPECT_EQ(code_of(bad), "unphysical_gains");
  bad = good;
  bad.torque.setConstant(1.0);
  bad.torque(4) = 1.5;
  EXPECT_EQ(code_of(bad), "unphysical_gains");
  bad = good;
  bad.current = -bad.current;
  EXPECT_EQ(code_of(bad), "unphysical_gains");
  bad = good;
  bad.speed.setConstant(3.0);
  EXPECT_EQ(code_of(bad), "singular");
  bad = good;
  bad.current.conservativeResize(3);
  EXPECT_EQ(code_of(bad), "wrong_shape");
  bad = good;
  bad.speed(1) = std::nan("");
  EXPECT_EQ(code_of(bad), "not_finite");
  EXPECT_EQ(code_of(curve_of(mechanisms::motor("NEO").value(), 2)), "too_short");

  LockedRotor run{VectorXd::LinSpaced(6, 0.0, 1.0), VectorXd::Ones(6), VectorXd::Ones(6),
                  VectorXd::Ones(6)};
  EXPECT_TRUE(fit_locked_rotor(run));
  run.current(2) = 0.0;
  EXPECT_TRUE(fit_locked_rotor(run).error().is(IdentificationError::unphysical_gains));
  run.current(2) = 1.0;
  run.time.setConstant(1.0);
  EXPECT_TRUE(fit_locked_rotor(run).error().is(IdentificationError::singular));
}

}  // namespace
}  // namespace flyball::identification::motor_curve_test
