#include <flyball/simulation/mechanism_loop.hpp>

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::mechanism_loop_test {
namespace {

using namespace flyball::literals;
using mechanisms::FeedforwardGains;
using mechanisms::MechanismKind;

constexpr FeedforwardGains elevator_gains{.kS = 0.15, .kV = 4.0, .kA = 0.3, .kG = 0.6};
constexpr FeedforwardGains flywheel_gains{.kS = 0.2, .kV = 0.02, .kA = 0.004};

MechanismControllerDesign controller(MechanismKind kind, const FeedforwardGains& gains,
                                     const ContinuousSystem<>& model,
                                     std::initializer_list<double> tolerance,
                                     std::initializer_list<double> sigmas, double measurement) {
  MechanismControllerDesign design;
  design.kind = kind;
  design.gains = gains;
  design.plant = discretize(model, 20_ms).value();
  design.K = lqr(design.plant, bryson(tolerance), bryson({12.0})).value().K;
  design.K_e =
      kalman_gain(design.plant, standard_deviations(sigmas), standard_deviations({measurement}))
          .value()
          .K;
  return design;
}

template <int States>
ContinuousSystem<> dynamic(const ContinuousSystem<States, 1, 1>& system) {
  return {system.A, system.B, system.C, system.D};
}

std::vector<MotionState> trapezoid(double goal, const MotionLimits& limits, double seconds) {
  const TrapezoidProfile profile(limits, {}, {goal, 0.0});
  std::vector<MotionState> reference;
  for (int k = 0; k * 0.02 < seconds; ++k) {
    reference.push_back(profile.sample(k * 0.02));
  }
  return reference;
}

MechanismLoop elevator_job() {
  MechanismLoop job;
  job.controller = controller(MechanismKind::elevator, elevator_gains,
                              dynamic<2>(mechanisms::elevator(elevator_gains).value()), {0.02, 0.4},
                              {1e-3, 0.05}, 1e-3);
  job.truth.gains = elevator_gains;
  job.reference = trapezoid(1.0, {1.0, 3.0}, 2.0);
  return job;
}

const std::vector<double>& column(const MechanismResponse& result, const char* name) {
  const auto* values = result.series.find(name);
  EXPECT_NE(values, nullptr) << name;
  return *values;
}

// A perfect model, without friction: gravity is held by the feedforward, and a trapezoid, which a
// voltage held for a period can only follow at the samples, is followed closely. The estimate is
// the truth, because the observer is told what the linear model saw.
TEST(SimulateMechanism, FollowsATrapezoid) {
  MechanismLoop job = elevator_job();
  job.controller.gains.kS = 0.0;
  job.truth.gains.kS = 0.0;
  const auto result = simulate_mechanism(job).value();
  EXPECT_LT(result.max_error, 2e-3);
  EXPECT_NEAR(result.final_error, 0.0, 1e-6);
  EXPECT_EQ(result.saturated_fraction, 0.0);
  const auto& truth = column(result, "position");
  const auto& estimate = column(result, "estimated_position");
  // The first estimate predicts one period of nothing, during which gravity would have pulled.
  for (std::size_t k = 0; k < truth.size(); ++k) {
    ASSERT_NEAR(estimate[k], truth[k], 1e-9) << k;
  }
}

// A wrong voltage of the model is seen: gravity that is not fed forward leaves the elevator below.
TEST(SimulateMechanism, NeedsTheGravityFeedforward) {
  MechanismLoop job = elevator_job();
  job.controller.feed_forward_gravity = false;
  EXPECT_GT(std::abs(simulate_mechanism(job).value().final_error), 5e-4);
  EXPECT_LT(std::abs(simulate_mechanism(elevator_job()).value().final_error), 5e-4);
}

TEST(SimulateMechanism, FlywheelReachesItsSpeed) {
  MechanismLoop job;
  job.controller =
      controller(MechanismKind::flywheel, flywheel_gains,
                 dynamic<1>(mechanisms::flywheel(flywheel_gains).value()), {10.0}, {3.0}, 1.0);
  job.truth.gains = flywheel_gains;
  job.reference.assign(200, {0.0, 300.0, 0.0});
  const auto result = simulate_mechanism(job).value();
  EXPECT_NEAR(result.final_error, 0.0, 1e-6);
  EXPECT_GT(result.saturated_fraction, 0.0);
  EXPECT_EQ(result.series.find("estimated_position"), nullptr);
  EXPECT_EQ(result.series.rows(), 200u);
  // Holding takes kS + kV v = 6.2 V.
  EXPECT_NEAR(column(result, "voltage").back(), 6.2, 1e-6);
}

TEST(SimulateMechanism, ArmHoldsAgainstGravity) {
  const FeedforwardGains gains{.kS = 0.0, .kV = 1.2, .kA = 0.15, .kG = 0.65, .angle_offset = 0.2};
  MechanismLoop job;
  job.controller = controller(MechanismKind::arm, gains, dynamic<2>(mechanisms::arm(gains).value()),
                              {0.02, 0.2}, {1e-3, 0.05}, 1e-3);
  job.truth.gains = gains;
  job.reference = trapezoid(0.8, {2.0, 6.0}, 2.0);
  const auto result = simulate_mechanism(job).value();
  EXPECT_LT(result.max_error, 0.01);
  EXPECT_NEAR(result.final_error, 0.0, 1e-5);
  EXPECT_NEAR(column(result, "voltage").back(), 0.65 * std::cos(1.0), 1e-3);
}

// Theorem 14.3.2: a mechanism without inertia, driven in volts as dx/dt = u/kV.
TEST(SimulateMechanism, PositionOnlyModel) {
  const FeedforwardGains gains{.kS = 0.1, .kV = 2.0};
  ContinuousSystem<> model{Eigen::MatrixXd::Zero(1, 1), Eigen::MatrixXd::Constant(1, 1, 0.5),
                           Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Zero(1, 1)};
  MechanismLoop job;
  job.controller = controller(MechanismKind::elevator, gains, model, {0.02}, {1e-3}, 1e-3);
  job.truth.gains = gains;
  job.reference = trapezoid(0.5, {1.0, 4.0}, 2.0);
  const auto result = simulate_mechanism(job).value();
  EXPECT_LT(result.max_error, 0.01);
  EXPECT_LT(std::abs(result.final_error), 2e-3);
  EXPECT_EQ(result.series.find("estimated_velocity"), nullptr);
}

// 12.6 V behind 20 mΩ and a motor of 30 mΩ: it sags, the motor never sees more than the rail, and
// with compensation the motor sees what was asked for wherever the rail allows.
TEST(SimulateMechanism, BatterySagsAndIsCompensated) {
  MechanismLoop job = elevator_job();
  job.truth.battery = {.open_circuit_voltage = 12.6, .resistance = 0.02};
  job.truth.motor_resistance = 0.03;
  job.reference = trapezoid(1.0, {1.5, 8.0}, 2.0);
  const auto result = simulate_mechanism(job).value();
  const auto& rail = column(result, "rail_voltage");
  const auto& motor = column(result, "motor_voltage");
  double lowest = rail[0];
  for (std::size_t k = 0; k < rail.size(); ++k) {
    lowest = std::min(lowest, rail[k]);
    EXPECT_LE(std::abs(motor[k]), 12.6 + 1e-9);
  }
  EXPECT_LT(lowest, 12.0);
  EXPECT_LT(std::abs(result.final_error), 2e-3);
  // Compensation makes the error smaller.
  job.controller.compensate_voltage = false;
  job.truth.battery.open_circuit_voltage = 10.0;
  const double without = simulate_mechanism(job).value().rms_error;
  job.controller.compensate_voltage = true;
  EXPECT_LT(simulate_mechanism(job).value().rms_error, 0.7 * without);
}

// The voltage changes `actuation_delay` after its sample: in the first period only from then on.
TEST(SimulateMechanism, DelaysTheVoltage) {
  MechanismLoop job = elevator_job();
  job.reference.assign(50, {0.1, 0.0, 0.0});
  job.truth.actuation_delay = Time(0.0125);
  const auto result = simulate_mechanism(job).value();
  const double u = column(result, "command")[0];
  EXPECT_NEAR(column(result, "motor_voltage")[0], u * (0.0075 / 0.02), 1e-9);
  job.truth.actuation_delay = Time(0.04);
  const auto late = simulate_mechanism(job).value();
  EXPECT_EQ(column(late, "motor_voltage")[0], 0.0);
  EXPECT_EQ(column(late, "motor_voltage")[1], 0.0);
  EXPECT_NEAR(column(late, "motor_voltage")[2], column(late, "command")[0], 1e-9);
}

/// The error of the mechanism in the middle of a steady motion, m or rad/s.
double error_on_the_way(const MechanismLoop& job, const char* state) {
  const MechanismResponse result = simulate_mechanism(job).value();
  const std::string reference = std::string("reference_") + state;
  const std::size_t row = result.series.rows() / 2;
  return column(result, state)[row] - column(result, reference.c_str())[row];
}

// A measurement that is 15 ms old shows the carriage 15 ms · 1 m/s behind where it is. Moved along
// the reference by the same 15 ms it causes no error; not moved, the loop puts the carriage ahead
// by that much, and moved although it is fresh, behind by that much.
TEST(SimulateMechanism, MovesALateMeasurementAlongTheReference) {
  MechanismLoop job = elevator_job();
  job.controller.gains.kS = job.truth.gains.kS = 0.0;
  job.reference.clear();
  for (int k = 0; k < 150; ++k) {
    job.reference.push_back({0.02 * k, 1.0, 0.0});
  }
  job.initial = {0.0, 1.0};
  const auto error = [&](Time age, Time moved) {
    job.truth.sensor.delay = age;
    job.controller.measurement_delay = moved;
    return error_on_the_way(job, "position");
  };
  EXPECT_NEAR(error(0_ms, 0_ms), 0.0, 1e-6);
  EXPECT_NEAR(error(15_ms, 15_ms), 0.0, 1e-6);
  EXPECT_NEAR(error(15_ms, 0_ms), 0.015, 1e-3);
  EXPECT_NEAR(error(0_ms, 15_ms), -0.015, 1e-3);
}

// A flywheel's measurement is moved by its acceleration: 15 ms · 100 rad/s².
TEST(SimulateMechanism, MovesALateVelocityAlongTheRamp) {
  MechanismLoop job;
  job.controller =
      controller(MechanismKind::flywheel, flywheel_gains,
                 dynamic<1>(mechanisms::flywheel(flywheel_gains).value()), {1.0}, {3.0}, 0.1);
  job.truth.gains = flywheel_gains;
  for (int k = 0; k < 150; ++k) {
    job.reference.push_back({0.0, 2.0 * k, 100.0});
  }
  const auto error = [&](Time age, Time moved) {
    job.truth.sensor.delay = age;
    job.controller.measurement_delay = moved;
    return error_on_the_way(job, "velocity");
  };
  const double late = error(15_ms, 0_ms);
  EXPECT_GT(late, 0.5);
  EXPECT_LT(std::abs(error(15_ms, 15_ms)), 0.02 * late);
  EXPECT_NEAR(error(0_ms, 15_ms), -late, 0.02 * late);
}

TEST(SimulateMechanism, IsDeterministic) {
  MechanismLoop job = elevator_job();
  job.truth.sensor = {.resolution = 1e-4, .noise = 1e-3, .delay = 10_ms, .refresh = 20_ms};
  job.truth.voltage_noise = 0.05;
  const auto first = simulate_mechanism(job).value();
  EXPECT_EQ(column(first, "voltage"), column(simulate_mechanism(job).value(), "voltage"));
  job.seed = 2;
  EXPECT_NE(column(first, "voltage"), column(simulate_mechanism(job).value(), "voltage"));
  EXPECT_LT(first.max_error, 0.05);
}

// Too late a voltage is unstable, and the numbers say so without becoming infinite.
TEST(SimulateMechanism, UnstableLoopStaysFinite) {
  MechanismLoop job = elevator_job();
  job.truth.actuation_delay = Time(0.2);
  job.reference.assign(2000, {0.1, 0.0, 0.0});
  const auto result = simulate_mechanism(job).value();
  EXPECT_GT(result.max_error, 0.1);
  for (const auto& values : result.series.columns()) {
    for (const double value : values.values) {
      ASSERT_TRUE(std::isfinite(value)) << values.name;
    }
  }
}

TEST(SimulateMechanism, Errors) {
  const auto with = [](auto change) {
    MechanismLoop job = elevator_job();
    change(job);
    return simulate_mechanism(job).error();
  };
  EXPECT_TRUE(with([](auto& j) { j.reference.clear(); }).is(ArgumentError::empty));
  EXPECT_TRUE(
      with([](auto& j) { j.reference[3].position = std::nan(""); }).is(ArgumentError::not_finite));
  EXPECT_TRUE(with([](auto& j) {
                j.controller.kind = MechanismKind::flywheel;
              }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(with([](auto& j) {
                j.controller.K = Eigen::MatrixXd::Zero(1, 1);
              }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      with([](auto& j) { j.controller.max_voltage = 0.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      with([](auto& j) { j.controller.nominal_voltage = 0.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(with([](auto& j) { j.truth.gains.kV = 0.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(with([](auto& j) { j.truth.breakaway = 0.5; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      with([](auto& j) { j.truth.battery.resistance = -1.0; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      with([](auto& j) { j.truth.motor_resistance = 0.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      with([](auto& j) { j.truth.actuation_delay = Time(-1.0); }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(with([](auto& j) { j.truth.sensor.noise = -1.0; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(with([](auto& j) { j.truth.voltage_noise = -1.0; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      with([](auto& j) { j.initial.velocity = std::nan(""); }).is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::mechanism_loop_test
