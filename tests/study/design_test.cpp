#include <flyball/study/design.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/study/design_exports.hpp>
#include <flyball/study/simulate_design.hpp>

#include "support/oracle.hpp"

namespace flyball::study::design_test {
namespace {

using mechanisms::MechanismKind;

DesignJob arm_job() {
  DesignJob job;
  job.plant.kind = MechanismKind::arm;
  job.plant.unit = "rad";
  job.plant.gains = {.kS = 0.1, .kV = 1.2, .kA = 0.15, .kG = 0.65, .angle_offset = 0.2};
  job.controller.delay = 0.020;
  return job;
}

DesignJob elevator_job() {
  DesignJob job;
  job.plant.kind = MechanismKind::elevator;
  job.plant.unit = "m";
  job.plant.gains = {.kS = 0.15, .kV = 4.0, .kA = 0.3, .kG = 0.6};
  job.controller.delay = 0.015;
  return job;
}

DesignJob flywheel_job() {
  DesignJob job;
  job.plant.kind = MechanismKind::flywheel;
  job.plant.unit = "rad";
  job.plant.gains = {.kS = 0.2, .kV = 0.02, .kA = 0.004};
  job.controller.delay = 0.030;
  return job;
}

double spectral_radius(const Eigen::MatrixXd& M) {
  return flyball::test::eigenvalues(M).cwiseAbs().maxCoeff();
}

TEST(Design, ChoosesTolerancesThatKeepTheMargins) {
  for (const DesignJob& job : {arm_job(), elevator_job(), flywheel_job()}) {
    const auto result = design(job);
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_GE(result->margins.gain_margin, 2.0);
    EXPECT_GE(result->margins.phase_margin, std::numbers::pi / 4.0);
    EXPECT_GE(result->margins.disk_margin, 0.5);
    EXPECT_TRUE(result->robust);
    EXPECT_LT(spectral_radius(result->A - result->B * result->K), 1.0);
    EXPECT_FALSE(result->job.controller.state_tolerance.empty());
    EXPECT_EQ(result->robustness.size(), 25u);
    EXPECT_GT(result->response.rows(), 20u);
  }
}

TEST(Design, IsTheLqrOfItsWeights) {
  DesignJob job = elevator_job();
  job.controller.state_tolerance = {0.05, 1.0};
  job.controller.delay = 0.0;
  const auto result = design(job);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_DOUBLE_EQ(result->Q(0, 0), 1.0 / (0.05 * 0.05));
  EXPECT_DOUBLE_EQ(result->R(0, 0), 1.0 / 144.0);
  // K satisfies (BᵀSB + R) K = BᵀSA for the S of its own cost: S = Q + KᵀRK + (A-BK)ᵀS(A-BK).
  const Eigen::MatrixXd closed = result->A - result->B * result->K;
  const Eigen::MatrixXd stage = result->Q + result->K.transpose() * result->R * result->K;
  Eigen::MatrixXd S = stage;
  Eigen::MatrixXd power = closed;
  for (int i = 0; i < 60; ++i) {
    S += power.transpose() * S * power;
    power = power * power;
  }
  const Eigen::MatrixXd left = (result->B.transpose() * S * result->B + result->R) * result->K;
  const Eigen::MatrixXd right = result->B.transpose() * S * result->A;
  EXPECT_LT((left - right).norm(), 1e-9 * right.norm());
  EXPECT_TRUE(result->K_delayed.isApprox(result->K, 1e-14));
}

TEST(Design, TheTrapezoidUsesTheVoltageThereIs) {
  const auto result = design(elevator_job());
  ASSERT_TRUE(result) << to_string(result.error());
  const mechanisms::FeedforwardGains& g = result->job.plant.gains;
  // At the end of the acceleration upwards: kS + kG + kV v + kA a = 12 V less a tenth.
  const double peak =
      g.kS + g.kG + g.kV * result->motion.max_velocity + g.kA * result->motion.max_acceleration;
  EXPECT_NEAR(peak, 12.0 - 1.2, 1e-6);
  // No other cruise velocity with its own acceleration is faster.
  const auto time = [&](double v) {
    const double a = (12.0 - 1.2 - g.kS - g.kG - g.kV * v) / g.kA;
    return 1.0 >= v * v / a ? 1.0 / v + v / a : 2.0 * std::sqrt(1.0 / a);
  };
  for (double v = 0.05; v < 2.5; v += 0.01) {
    EXPECT_GE(time(v), result->motion.duration - 1e-9);
  }
}

TEST(Design, TracksItsTrapezoidDespiteDelayNoiseAndFriction) {
  const auto elevator = design(elevator_job());
  ASSERT_TRUE(elevator) << to_string(elevator.error());
  EXPECT_LT(elevator->tracking_error_max, 0.03);
  const auto arm = design(arm_job());
  ASSERT_TRUE(arm) << to_string(arm.error());
  EXPECT_LT(arm->tracking_error_max, 0.08);
}

TEST(Design, GoesOnWithoutKA) {
  for (DesignJob job : {arm_job(), elevator_job(), flywheel_job()}) {
    job.plant.kA_determined = false;
    job.plant.gains.kA = 0.0;
    job.plant.kA_upper_bound = 0.02 * job.plant.gains.kV;
    const auto result = design(job);
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_TRUE(result->velocity_servo);
    EXPECT_EQ(result->K.cols(), 1);
    EXPECT_TRUE(result->robust);
    if (job.plant.kind == MechanismKind::flywheel) {
      EXPECT_DOUBLE_EQ(result->K(0, 0), 0.0);
      EXPECT_NEAR(result->inversion(0, 0), job.plant.gains.kV, 1e-15);
    } else {
      EXPECT_GT(result->K(0, 0), 0.0);
    }
    EXPECT_TRUE(std::isfinite(result->tracking_error_max));
  }
}

TEST(Design, RefusesWhatCannotBe) {
  DesignJob job = elevator_job();
  job.plant.gains.kG = 13.0;
  auto result = design(job);
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(DesignError::gravity_too_strong)) << to_string(result.error());

  job = elevator_job();
  job.plant.gains.kS = 11.0;
  result = design(job);
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(DesignError::no_motion_possible)) << to_string(result.error());

  // A battery whose sag takes all is called that, not friction.
  job = elevator_job();
  job.plant.motor = *mechanisms::motor("NEO", 2);
  job.battery.resistance = 1e9;
  result = design(job);
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(DesignError::no_motion_possible)) << to_string(result.error());
  EXPECT_TRUE(to_string(result.error()).starts_with("design: the battery is left with "))
      << to_string(result.error());
  EXPECT_EQ(to_string(result.error()).find("below"), std::string::npos)
      << to_string(result.error());

  job = elevator_job();
  job.controller.period = 0.0;
  result = design(job);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind(), ErrorKind::misuse);

  job = elevator_job();
  job.plant.gains.kV = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(design(job));

  job = elevator_job();
  job.controller.state_tolerance = {0.02};
  result = design(job);
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(ArgumentError::wrong_shape)) << to_string(result.error());

  job = elevator_job();
  job.controller.state_tolerance = {0.001, 10.0};
  job.controller.delay = 0.020;
  result = design(job);
  ASSERT_FALSE(result);
  EXPECT_TRUE(result.error().is(DesignError::margins_lost)) << to_string(result.error());
}

TEST(Design, PastesTheSameGainsInOtherUnits) {
  const auto result = design(arm_job());
  ASSERT_TRUE(result) << to_string(result.error());
  ASSERT_EQ(result->paste.size(), 3u);
  constexpr double two_pi = 2.0 * std::numbers::pi;
  EXPECT_NEAR(result->paste[1].kV, result->paste[0].kV * two_pi, 1e-12);
  EXPECT_NEAR(result->paste[2].kV, result->paste[0].kV * two_pi / 60.0, 1e-12);
  EXPECT_NEAR(result->paste[1].kP, result->K_delayed(0, 0) * two_pi, 1e-9);
  EXPECT_DOUBLE_EQ(result->paste[1].kG, 0.65);
}

// A motion of more periods than anyone wants to see is refused before it is simulated.
// Whoever wrote a file does not know the library's functions.
TEST(Design, IsRefusedInTheWordsOfTheFile) {
  const auto refusal = [](void (*change)(DesignJob&)) {
    DesignJob job = elevator_job();
    change(job);
    const auto result = design(job);
    return result ? std::string("designed") : to_string(result.error());
  };
  EXPECT_EQ(refusal([](DesignJob& job) { job.controller.delay = 1e3; }),
            "design: controller.delay is 1000 s; it must be in [0, 5]");
  EXPECT_TRUE(refusal([](DesignJob& job) {
                job.sensor.resolution = 1e200;
              }).starts_with("design: sensor.resolution is 1e+200; it must be of a size"));
  EXPECT_TRUE(refusal([](DesignJob& job) {
                job.controller.state_tolerance = {1e-200, 1.0};
              }).starts_with("design: controller.state_tolerance is 1e-200; it must be of a size"));
  EXPECT_TRUE(refusal([](DesignJob& job) {
                job.estimator.model_std = {0.0, 0.0};
              }).starts_with("design: the observer"));
  EXPECT_TRUE(refusal([](DesignJob& job) {
                job.profile.max_velocity = 1e-9;
              }).starts_with("design: the motion is "));
}

TEST(Design, ARefusalTellsWhatWasNoticed) {
  DesignJob job = elevator_job();
  job.plant.gains.kG = 13.0;
  const auto result = design(job);
  ASSERT_FALSE(result);
  ASSERT_EQ(result.error().diagnostics().size(), 1U);
  EXPECT_EQ(result.error().diagnostics().front().code, "assumed");
}

TEST(Design, RefusesAMotionWithoutEnd) {
  auto job = arm_job();
  job.profile.max_velocity = 1e-9;
  const auto refused = design(job);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(ArgumentError::out_of_range)) << to_string(refused.error());
  EXPECT_NE(to_string(refused.error()).find("periods"), std::string::npos);
}

// What is exported is what was designed: the delayed gain, the inversion, the gains in every unit.
TEST(Design, ExportsItsLoopAndItsConstants) {
  auto job = arm_job();
  job.plant.kA_reason = "no reason";
  const auto result = design(job);
  ASSERT_TRUE(result) << to_string(result.error());
  const MechanismControllerDesign loop = controller_of(*result);
  EXPECT_EQ(loop.K, result->K_delayed);
  EXPECT_EQ(loop.measurement_delay.si(), 0.020);
  EXPECT_EQ(MechanismController<>::create(loop).value().B_pinv(), result->inversion);
  const exports::MechanismConstants constants = constants_of(*result);
  ASSERT_EQ(constants.gains.size(), 3u);
  EXPECT_EQ(constants.gains[1].kP, result->paste[1].kP);
  EXPECT_EQ(constants.angle_offset, 0.2);
  EXPECT_EQ(constants.kA_reason, "no reason");
  EXPECT_EQ(exports::paste_constants(constants).size(), 9u);  // of three tools in three languages
}

// The sensor of the simulation is as late as the design says, and the controller makes up for it:
// with either of the two left out the mechanism is off by the way of one delay at cruise.
TEST(SimulateDesign, TheDelayIsInTheSensorAndMadeUpFor) {
  DesignJob job = elevator_job();
  job.controller.delay = 0.030;
  job.plant.gains.kS = 0.0;
  const auto result = design(job);
  ASSERT_TRUE(result) << to_string(result.error());
  const auto response = simulate_design(*result, {});
  ASSERT_TRUE(response) << to_string(response.error());
  const auto& time = response->series.time();
  const auto& position = *response->series.find("position");
  const auto& measurement = *response->series.find("measurement");
  const auto& velocity = *response->series.find("reference_velocity");
  const double cruise = result->motion.max_velocity;
  double off = 0.0;
  int rows = 0;
  for (std::size_t k = 0; k + 1 < time.size(); ++k) {
    if (velocity[k] == cruise && velocity[k + 1] == cruise && k > 1 && velocity[k - 2] == cruise) {
      off =
          std::max(off, std::abs(position[k] - (*response->series.find("reference_position"))[k]));
      EXPECT_NEAR(position[k] - measurement[k], 0.030 * cruise, 0.003 * cruise);
      ++rows;
    }
  }
  EXPECT_GT(rows, 5);
  EXPECT_LT(off, 0.3 * 0.030 * cruise);
}

TEST(SimulateDesign, IsDeterministicAndSeeded) {
  const auto result = design(arm_job());
  ASSERT_TRUE(result) << to_string(result.error());
  const DesignTrial job{.measurement_noise = 0.01, .seed = 7};
  const auto a = simulate_design(*result, job);
  const auto b = simulate_design(*result, job);
  ASSERT_TRUE(a);
  ASSERT_TRUE(b);
  EXPECT_EQ(*a->series.find("position"), *b->series.find("position"));
  const auto c = simulate_design(*result, {.measurement_noise = 0.01, .seed = 8});
  ASSERT_TRUE(c);
  EXPECT_NE(*a->series.find("position"), *c->series.find("position"));
  EXPECT_FALSE(simulate_design(*result, {.inertia_factor = 0.0}));
}

/// Growth of a loop of 1 ms: a PID on values that are `late` periods old, its kD on their
/// difference, a plant that the exact discretisation of kA dv/dt = u - kV v moves.
bool settles(const DesignJob& job, double gain, const PasteGains& gains, int late) {
  constexpr double T = 1e-3;
  const bool velocity = controls_velocity(job.plant.kind);
  const double decay = std::exp(-job.plant.gains.kV / job.plant.gains.kA * T);
  const double tau = job.plant.gains.kA / job.plant.gains.kV;
  std::vector<double> seen(static_cast<std::size_t>(late) + 1, 1.0);
  double x = 1.0;
  double v = velocity ? 1.0 : 0.0;
  double last = 1.0;
  double early = 0.0;
  double end = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const double y = seen.back();
    const double u = -gain * (gains.kP * y + (velocity ? 0.0 : gains.kD * (y - last) / T));
    last = y;
    const double steady = u / job.plant.gains.kV;
    x += steady * T + (v - steady) * tau * (1.0 - decay);
    v = steady + (v - steady) * decay;
    seen.insert(seen.begin(), velocity ? v : x);
    seen.pop_back();
    (k < 500 ? early : end) =
        std::max(k < 500 || k >= 7500 ? std::abs(velocity ? v : x) : 0.0, k < 500 ? early : end);
  }
  return std::isfinite(end) && end < 0.05 * early;
}

// Gains for motor controllers hold with the delay that the log told: stable at 1.9 times the gain,
// as a gain margin of 2 promises, and not at 30 times, so that they are not merely small.
TEST(Design, GainsForMotorControllersKeepTheirMarginWithTheDelay) {
  for (const DesignJob& job : {arm_job(), elevator_job(), flywheel_job()}) {
    const auto result = design(job);
    ASSERT_TRUE(result) << to_string(result.error());
    ASSERT_FALSE(result->paste_on_board.empty()) << to_string(job.plant.kind);
    const PasteGains& gains = result->paste_on_board.front();
    EXPECT_EQ(gains.per, job.plant.unit);
    EXPECT_EQ(gains.kV, job.plant.gains.kV);
    const int late = static_cast<int>(std::lround(*job.controller.delay / 1e-3));
    EXPECT_TRUE(settles(job, 1.0, gains, late)) << to_string(job.plant.kind);
    EXPECT_TRUE(settles(job, 1.9, gains, late)) << to_string(job.plant.kind);
    EXPECT_FALSE(settles(job, 30.0, gains, late)) << to_string(job.plant.kind);
    // Faster than the robot's loop, which holds its voltage for 20 ms.
    EXPECT_GT(gains.kP, result->paste.front().kP) << to_string(job.plant.kind);
  }
  DesignJob unknown = arm_job();
  unknown.plant.kA_determined = false;
  unknown.plant.kA_upper_bound = 0.1;
  const auto result = design(unknown);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->paste_on_board.empty());
}

}  // namespace
}  // namespace flyball::study::design_test
