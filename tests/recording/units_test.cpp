// In which units positions and velocities are: metadata, names, the ratio of the two.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/io/log.hpp>
#include <flyball/recording/load_recording.hpp>

namespace flyball::recording::units_test {
namespace {

using mechanisms::MechanismKind;

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double degree = std::numbers::pi / 180.0;

/// A ramp and a step, as the channels of a log show them: a mechanism of 1 rad/s a volt whose
/// position and velocity are recorded in units of so many rad (or m) and rad/s.
Log log_of(std::string position, std::string velocity, double position_unit, double velocity_unit,
           std::string position_metadata = {}, std::string velocity_metadata = {}) {
  Log log;
  log.source = "robot.csv";
  log.format = "CSV";
  log.texts.push_back({"state",
                       {0.0, 1.0, 5.0, 6.0, 8.0},
                       {"none", "quasistatic-forward", "none", "dynamic-reverse", "none"}});
  Signal voltage{"voltage", "V", {}, {}};
  Signal p{std::move(position), std::move(position_metadata), {}, {}};
  Signal v{std::move(velocity), std::move(velocity_metadata), {}, {}};
  double angle = 0.0;
  for (int k = 0; k < 900; ++k) {
    const double t = 0.01 * k;
    const double volts = t >= 1.0 && t < 5.0 ? 1.5 * (t - 1.0) : t >= 6.0 && t < 8.0 ? -5.0 : 0.0;
    angle += 0.01 * volts;
    for (Signal* signal : {&voltage, &p, &v}) {
      signal->time.push_back(t);
    }
    voltage.value.push_back(volts);
    p.value.push_back(angle / position_unit);
    v.value.push_back(volts / velocity_unit);
  }
  log.signals = {voltage, p, v};
  return log;
}

struct Gain {
  double position = 0.0;  ///< Of the recording, over the true one.
  double velocity = 0.0;
  std::vector<std::string> codes;
};

Expected<Gain> gain_of(const Log& log, const LogSelection& selection) {
  auto loaded = recording_from_log(log, selection);
  if (!loaded) {
    return tl::unexpected(loaded.error().all().front());
  }
  Gain gain;
  const identification::TestRun& step = loaded->recording.runs.back();
  const std::size_t last = step.time.size() - 1;
  gain.position =
      (step.position[last] - step.position[0]) / (-5.0 * (step.time[last] - step.time[0]));
  gain.velocity = step.velocity.empty() ? std::nan("") : step.velocity[last] / -5.0;
  for (const Diagnostic& found : loaded->diagnostics) {
    gain.codes.push_back(found.code);
  }
  return gain;
}

bool has(const Gain& gain, std::string_view code) {
  return std::find(gain.codes.begin(), gain.codes.end(), code) != gain.codes.end();
}

struct Named {
  std::string position, velocity;
  double position_unit, velocity_unit;
};

class UnitsInNames : public testing::TestWithParam<Named> {};

TEST_P(UnitsInNames, AreRead) {
  const auto& [position, velocity, position_unit, velocity_unit] = GetParam();
  const auto gain = gain_of(log_of(position, velocity, position_unit, velocity_unit),
                            {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->position, 1.0, 1e-9);
  EXPECT_NEAR(gain->velocity, 1.0, 1e-9);
  EXPECT_FALSE(has(*gain, "unit_assumed"));
  EXPECT_FALSE(has(*gain, "unit_mistaken"));
}

INSTANTIATE_TEST_SUITE_P(
    Names, UnitsInNames,
    testing::Values(Named{"/Arm/PositionRad", "/Arm/VelocityRadPerSec", 1.0, 1.0},
                    Named{"MotorPositionRotations", "MotorVelocityRPM", two_pi, two_pi / 60.0},
                    Named{"pos in Degrees", "speed_dps", degree, degree},
                    Named{"angleDeg", "vel", degree, degree},
                    Named{"position", "velocity_rpm", two_pi, two_pi / 60.0},
                    Named{"position", "velocity (rotations per minute)", two_pi, two_pi / 60.0},
                    Named{"position", "velocityDegreesPerSecond", 1.0, degree},
                    Named{"position_turns", "velocity_rad_s", two_pi, 1.0},
                    // The vendor is not a unit.
                    Named{"REV/position_deg", "REV/velocity", degree, two_pi / 60.0}));

TEST(Units, OfLengthsInNames) {
  const auto gain = gain_of(log_of("positionInches", "velocity_m_s", 0.0254, 1.0), {});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->position, 1.0, 1e-9);
  EXPECT_NEAR(gain->velocity, 1.0, 1e-9);
}

TEST(Units, TheRatioTellsBothWhereNothingElseDoes) {
  const auto gain = gain_of(log_of("position", "velocity", two_pi, two_pi / 60.0),
                            {.mechanism = MechanismKind::flywheel});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->position, 1.0, 1e-9);
  EXPECT_NEAR(gain->velocity, 1.0, 1e-9);
  EXPECT_TRUE(has(*gain, "units_from_data"));
  EXPECT_FALSE(has(*gain, "unit_assumed"));
}

TEST(Units, WhatNothingTellsIsAssumedAloud) {
  // 12 rad/s at 12 V: rotations would be 75 rad/s, which no arm has.
  const auto gain =
      gain_of(log_of("position", "velocity", 1.0, 1.0), {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->position, 1.0, 1e-9);
  ASSERT_FALSE(gain->codes.empty());
  EXPECT_EQ(gain->codes.front(), "unit_assumed");
  const auto said = gain_of(log_of("position", "velocity", two_pi, two_pi),
                            {.mechanism = MechanismKind::arm, .unit = "rotations"});
  ASSERT_TRUE(said) << to_string(said.error());
  EXPECT_NEAR(said->velocity, 1.0, 1e-9);
  EXPECT_FALSE(has(*said, "unit_assumed"));
}

TEST(Units, MetadataThatTheDataDenyAreCorrectedAloud) {
  const auto gain = gain_of(
      log_of("position", "velocity", two_pi, two_pi / 60.0, "Rotation", "Rotation per Second"),
      {.mechanism = MechanismKind::flywheel});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->velocity, 1.0, 1e-9);
  EXPECT_TRUE(has(*gain, "unit_mistaken"));
  // A name is believed less than metadata.
  const auto name =
      gain_of(log_of("positionDegrees", "velocity", 1.0, 1.0, "", "Radian per Second"),
              {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(name) << to_string(name.error());
  EXPECT_NEAR(name->position, 1.0, 1e-9);
  EXPECT_TRUE(has(*name, "unit_mistaken"));
}

TEST(Units, ARatioThatNoUnitMakesIsRefusedWithBothNumbers) {
  const auto refused = gain_of(log_of("positionRad", "velocityRadPerSec", 1.0, 1.0 / 17.0),
                               {.mechanism = MechanismKind::arm});
  ASSERT_FALSE(refused);
  const std::string told = to_string(refused.error());
  EXPECT_TRUE(refused.error().is(RecordingError::unit_mismatch)) << told;
  EXPECT_NE(told.find("17.0"), std::string::npos) << told;
  EXPECT_NE(told.find("--no-velocity"), std::string::npos) << told;
  // The advice can be followed.
  const auto without = gain_of(log_of("positionRad", "velocityRadPerSec", 1.0, 1.0 / 17.0),
                               {.mechanism = MechanismKind::arm, .no_velocity = true});
  ASSERT_TRUE(without) << to_string(without.error());
  EXPECT_NEAR(without->position, 1.0, 1e-9);
  EXPECT_TRUE(std::isnan(without->velocity));
}

TEST(Units, TheVelocitysCanBeSaid) {
  const auto gain = gain_of(log_of("positionRad", "velocity", 1.0, degree),
                            {.mechanism = MechanismKind::arm, .velocity_unit = "deg/s"});
  ASSERT_TRUE(gain) << to_string(gain.error());
  EXPECT_NEAR(gain->velocity, 1.0, 1e-9);
  const auto wrong = gain_of(log_of("positionRad", "velocity", 1.0, degree),
                             {.mechanism = MechanismKind::arm, .velocity_unit = "kg"});
  ASSERT_FALSE(wrong);
  EXPECT_TRUE(wrong.error().is(RecordingError::unit_mismatch)) << to_string(wrong.error());
}

TEST(Units, AnElevatorsAreLengthsOrSaid) {
  const auto unknown =
      gain_of(log_of("position", "velocity", 1.0, 1.0), {.mechanism = MechanismKind::elevator});
  ASSERT_FALSE(unknown);
  EXPECT_TRUE(unknown.error().is(RecordingError::unit_unknown)) << to_string(unknown.error());
}

TEST(Units, AreAssumedWhereTheMechanismIsOpenToo) {
  const auto open = recording_from_log(log_of("position", "velocity", 1.0, 1.0), {});
  ASSERT_TRUE(open) << to_string(open.error());
  EXPECT_FALSE(open->recording.mechanism);
  ASSERT_FALSE(open->diagnostics.empty());
  EXPECT_EQ(open->diagnostics.front().code, "unit_assumed");
}

TEST(Units, TheVoltageCanBeScaled) {
  Log log = log_of("positionRad", "velocity", 1.0, 1.0);
  for (double& volts : log.signals[0].value) {
    volts /= 12.0;
  }
  const auto loaded =
      recording_from_log(log, {.mechanism = MechanismKind::arm, .voltage_scale = 12.0});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_NEAR(loaded->recording.runs.back().voltage.back(), -5.0, 1e-12);
}

TEST(Units, AVoltageMayBeInMillivolts) {
  for (const auto& [name, unit] :
       {std::pair{"voltage_mV", ""}, std::pair{"Voltage (mV)", ""},
        std::pair{"appliedVoltageMillivolts", ""}, std::pair{"voltage", "mV"}}) {
    Log log = log_of("positionRad", "velocity", 1.0, 1.0);
    log.signals[0].name = name;
    log.signals[0].unit = unit;
    for (double& volts : log.signals[0].value) {
      volts *= 1000.0;
    }
    const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
    ASSERT_TRUE(loaded) << name << to_string(loaded.error());
    EXPECT_NEAR(loaded->recording.runs.back().voltage.back(), -5.0, 1e-12) << name;
    // What is said overrules it.
    const auto said =
        recording_from_log(log, {.mechanism = MechanismKind::arm, .voltage_scale = 2e-3});
    ASSERT_TRUE(said);
    EXPECT_NEAR(said->recording.runs.back().voltage.back(), -10.0, 1e-12) << name;
  }
}

TEST(Units, AnEncodersTicksAreAskedFor) {
  const Log log = log_of("position (ticks)", "velocity", two_pi / 2048.0, two_pi / 204.8);
  const auto refused = gain_of(log, {.mechanism = MechanismKind::flywheel});
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(RecordingError::unit_unknown));
  EXPECT_NE(to_string(refused.error()).find("ticks of an encoder"), std::string::npos);
  LogSelection selection;
  selection.mechanism = MechanismKind::flywheel;
  selection.unit = "rotations";
  selection.scale = 1.0 / 2048.0;
  selection.no_velocity = true;
  const auto said = gain_of(log, selection);
  ASSERT_TRUE(said) << to_string(said.error());
  EXPECT_NEAR(said->position, 1.0, 1e-9);
}

TEST(Units, WhatIsNoVoltageIsToldOrRefused) {
  const auto scaled = [](double factor, double offset) {
    Log log = log_of("positionRad", "velocity", 1.0, 1.0);
    for (double& volts : log.signals[0].value) {
      volts = offset + factor * volts;
    }
    return gain_of(log, {.mechanism = MechanismKind::arm});
  };
  const auto percent = scaled(100.0 / 6.0, 0.0);
  ASSERT_FALSE(percent);
  EXPECT_NE(to_string(percent.error()).find("--voltage-scale"), std::string::npos)
      << to_string(percent.error());
  const auto battery = scaled(-0.1, 12.4);
  ASSERT_FALSE(battery);
  EXPECT_NE(to_string(battery.error()).find("battery"), std::string::npos)
      << to_string(battery.error());
  const auto duty = scaled(1.0 / 12.0, 0.0);
  ASSERT_TRUE(duty) << to_string(duty.error());
  EXPECT_TRUE(has(*duty, "duty_cycle"));
  const auto high = scaled(4.0, 0.0);
  ASSERT_TRUE(high) << to_string(high.error());
  EXPECT_TRUE(has(*high, "high_voltage"));
  const auto usual = scaled(2.0, 0.0);
  ASSERT_TRUE(usual) << to_string(usual.error());
  EXPECT_FALSE(has(*usual, "high_voltage") || has(*usual, "duty_cycle"));
}

// What SysId multiplied its rows with: 1 beside "Degrees" says nothing of what they are.
TEST(Units, SysIdsAnglesHaveOneNumberARotation) {
  const auto sysid = [](double row_unit, std::string units, double per_rotation) {
    Log log;
    log.source = "arm.json";
    log.format = "SysId JSON";
    SysIdJson& json = log.sysid.emplace();
    json.test = "Arm";
    json.units = std::move(units);
    json.units_per_rotation = per_rotation;
    for (const auto& [name, slope, level] :
         {std::tuple{"slow-forward", 1.5, 0.0}, {"fast-backward", 0.0, -5.0}}) {
      SysIdJson::Run run;
      run.name = name;
      double angle = 0.0;
      for (int k = 0; k < 300; ++k) {
        const double volts = slope * 0.01 * k + level;
        angle += 0.01 * volts;
        run.time.push_back(0.01 * k);
        run.voltage.push_back(volts);
        run.position.push_back(angle / row_unit);
        run.velocity.push_back(volts / row_unit);
      }
      json.runs.push_back(std::move(run));
    }
    return log;
  };
  for (const auto& [row_unit, units, per_rotation, code] :
       {std::tuple{two_pi, "Radians", two_pi, ""},
        {two_pi, "Degrees", 360.0, ""},
        {two_pi, "Degrees", 1.0, "units_per_rotation"},  // rotations: 0.2 °/s a volt is no arm
        {degree, "Degrees", 1.0, "units_per_rotation"},  // scaled already
        {two_pi / 50.0, "Degrees", 7.2, "units_per_rotation"}}) {  // the motor's rotations
    const auto gain = gain_of(sysid(row_unit, units, per_rotation), {});
    ASSERT_TRUE(gain) << to_string(gain.error());
    EXPECT_NEAR(gain->position, 1.0, 1e-9) << units << per_rotation;
    EXPECT_NEAR(gain->velocity, 1.0, 1e-9) << units << per_rotation;
    EXPECT_EQ(has(*gain, "units_per_rotation"), *code != '\0') << units << per_rotation;
  }
}

TEST(Units, SysIdsRadiansAreNoMetres) {
  Log log;
  log.source = "elevator.json";
  SysIdJson& json = log.sysid.emplace();
  json.test = "Elevator";
  json.units = "Radians";
  json.units_per_rotation = two_pi;
  json.runs.push_back(
      {"slow-forward", {0.0, 0.1}, {1.0, 1.0}, {0.0, 1.0}, {1.0, 1.0}, {}, {}, {}, {}, {}});
  const auto refused = gain_of(log, {});
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(RecordingError::unit_mismatch)) << to_string(refused.error());
  const auto loaded = recording_from_log(log, {.scale = 0.05});  // m/rad: the drum's radius
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_NEAR(loaded->recording.runs[0].position[1], two_pi * 0.05, 1e-12);
}

}  // namespace
}  // namespace flyball::recording::units_test
