#include <flyball/recording/load_recording.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/io/log.hpp>

namespace flyball::recording {
namespace {

using identification::TestKind;
using mechanisms::MechanismKind;

constexpr double two_pi = 2.0 * std::numbers::pi;

Signal signal(std::string name, std::string unit, double (*value)(double), double period = 0.02,
              double phase = 0.0) {
  Signal s{std::move(name), std::move(unit), {}, {}};
  for (double t = phase; t < 8.0; t += period) {
    s.time.push_back(t);
    s.value.push_back(value(t));
  }
  return s;
}

// quasistatic-forward from 1 s to 3 s, dynamic-reverse from 4 s to 5 s.
TextSignal state(std::string name) {
  return {std::move(name),
          {0.0, 1.0, 3.0, 4.0, 5.0},
          {"none", "quasistatic-forward", "none", "dynamic-reverse", "none"}};
}

double volts(double t) {
  return t >= 1.0 && t < 3.0 ? 0.5 * (t - 1.0) : t >= 4.0 && t < 5.0 ? -6.0 : 0.0;
}
double linear(double t) {
  return t;
}
double one(double) {
  return 1.0;
}

Log wpilog(std::string unit) {
  Log log;
  log.source = "robot.wpilog";
  log.format = "WPILOG";
  log.texts.push_back(state("sysid-test-state-Wrist"));
  log.signals.push_back(signal("voltage-motor-Wrist", "Volt", volts));
  log.signals.push_back(signal("position-motor-Wrist", unit, linear, 0.02, 0.004));
  log.signals.push_back(signal("velocity-motor-Wrist", unit + " per Second", one, 0.02, 0.004));
  // What else a robot logs.
  log.signals.push_back(signal("NT:/battery voltage", "", one));
  log.signals.push_back(signal("NT:/Arm/position target", "", one));
  log.signals.push_back(signal("NT:/intake/Position", "", one));
  return log;
}

std::string code_of(const Log& log, const LogSelection& selection) {
  const auto recording = recording_from_log(log, selection);
  return recording ? "accepted" : std::string(recording.error().code());
}

TEST(Recording, FindsTheSysIdChannelsOfAWpilog) {
  const auto loaded = recording_from_log(wpilog("Rotation"), {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->subject, "Wrist");
  EXPECT_EQ(loaded->recording.unit, "rad");
  ASSERT_EQ(loaded->recording.runs.size(), 2u);
  const identification::TestRun& ramp = loaded->recording.runs[0];
  EXPECT_EQ(ramp.kind, TestKind::quasistatic_forward);
  EXPECT_EQ(loaded->recording.runs[1].kind, TestKind::dynamic_reverse);
  EXPECT_GE(ramp.time.front(), 1.0);
  EXPECT_LT(ramp.time.back(), 3.0);
  for (std::size_t i = 0; i < ramp.time.size(); ++i) {
    // Position t rotations, interpolated to the voltage's clock; velocity 1 rotation/s.
    EXPECT_NEAR(ramp.position[i], two_pi * ramp.time[i], 1e-9);
    EXPECT_NEAR(ramp.velocity[i], two_pi, 1e-12);
  }
}

TEST(Recording, MetresAreAnElevatorAndRotationsAreAsked) {
  const auto elevator = recording_from_log(wpilog("Meter"), {});
  ASSERT_TRUE(elevator) << to_string(elevator.error());
  EXPECT_EQ(elevator->recording.mechanism, MechanismKind::elevator);
  EXPECT_EQ(elevator->recording.unit, "m");

  const auto open = recording_from_log(wpilog("Rotation"), {});
  ASSERT_FALSE(open);
  EXPECT_TRUE(open.error().is(RecordingError::mechanism_unknown));
  EXPECT_NE(to_string(open.error()).find("--mechanism"), std::string::npos);
}

TEST(Recording, ScaleTurnsRotationsIntoMetres) {
  EXPECT_EQ(code_of(wpilog("Rotation"), {.mechanism = MechanismKind::elevator}), "unit_mismatch");
  EXPECT_EQ(code_of(wpilog("Meter"), {.mechanism = MechanismKind::arm}), "unit_mismatch");
  LogSelection selection;
  selection.mechanism = MechanismKind::elevator;
  selection.scale = 0.1596;  // circumference of a one-inch drum
  const auto loaded = recording_from_log(wpilog("Rotation"), selection);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->recording.unit, "m");
  EXPECT_NEAR(loaded->recording.runs[0].velocity[3], 0.1596, 1e-12);
}

TEST(Recording, AVelocityMayHaveAnotherUnitThanItsPosition) {
  Log log = wpilog("Rotation");
  log.signals[2] = signal("velocity-motor-Wrist", "RPM", [](double) { return 60.0; }, 0.02, 0.004);
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::flywheel});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_NEAR(loaded->recording.runs[0].velocity[0], two_pi, 1e-12);
  EXPECT_NEAR(loaded->recording.runs[0].position[0], two_pi * loaded->recording.runs[0].time[0],
              1e-9);
}

TEST(Recording, LeftAndRightAreADrivetrain) {
  Log log = wpilog("Meter");
  log.signals.clear();
  for (const char* side : {"left", "right"}) {
    for (const char* field : {"voltage", "position", "velocity"}) {
      log.signals.push_back(
          signal(std::string(field) + "-" + side + "-Wrist", "", field[0] == 'v' ? volts : linear));
    }
  }
  const auto loaded = recording_from_log(log, {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_TRUE(loaded->refusal);
  EXPECT_TRUE(loaded->refusal->is(RecordingError::drivetrain));
  EXPECT_EQ(loaded->refusal->kind(), ErrorKind::no_answer);
  EXPECT_NE(to_string(*loaded->refusal).find("a left and a right side"), std::string::npos);
  // What one side did can still be looked at.
  EXPECT_EQ(loaded->recording.runs.size(), 2u);
}

// The channels of a robot that logs each motor controller: none says its side, only the distances
// do.
Log four_controllers(std::string state_name) {
  Log log = wpilog("Meter");
  log.texts[0].name = std::move(state_name);
  log.signals.clear();
  for (const char* id : {"11", "12"}) {
    const std::string spark = std::string("NT:/URCL/SparkMax-") + id;
    log.signals.push_back(signal(spark + "/AppliedOutputVoltage", "", volts));
    log.signals.push_back(signal(spark + "/MotorPositionRotations", "", linear));
    log.signals.push_back(signal(spark + "/MotorVelocityRPM", "", one));
  }
  return log;
}

std::string refusal_of(const Log& log, const LogSelection& selection) {
  const auto recording = recording_from_log(log, selection);
  return !recording           ? std::string(recording.error().code())
         : recording->refusal ? std::string(recording->refusal->code())
                              : "accepted";
}

TEST(Recording, ADrivetrainIsToldByItsName) {
  for (const char* name : {"sysid-test-state-DriveSubsystem", "sysid-test-state-drivetrain",
                           "/RealOutputs/Swerve/SysIdState", "sysid-test-state-swerve_drive",
                           "sysid-test-state-CommandSwerveDrivetrain"}) {
    EXPECT_EQ(refusal_of(four_controllers(name), {}), "drivetrain") << name;
  }
  EXPECT_EQ(refusal_of(four_controllers("sysid-test-state-Wrist"), {}), "ambiguous_channel");
  // Not every word that begins so is one.
  EXPECT_EQ(refusal_of(four_controllers("sysid-test-state-Screwdriver"), {}), "ambiguous_channel");
  // What the person says has the last word.
  const Log drive = four_controllers("sysid-test-state-DriveSubsystem");
  EXPECT_EQ(refusal_of(drive, {.mechanism = MechanismKind::flywheel}), "ambiguous_channel");
  LogSelection one_motor;
  one_motor.mechanism = MechanismKind::flywheel;
  one_motor.voltage_channel = drive.signals[0].name;
  one_motor.position_channel = drive.signals[1].name;
  one_motor.velocity_channel = drive.signals[2].name;
  EXPECT_EQ(refusal_of(drive, one_motor), "accepted");
}

TEST(Recording, ADrivetrainIsToldWithoutVoltages) {
  Log log = four_controllers("sysid-test-state-DriveSubsystem");
  std::erase_if(log.signals, [](const Signal& s) { return s.name.ends_with("Voltage"); });
  const auto loaded = recording_from_log(log, {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_TRUE(loaded->refusal);
  EXPECT_TRUE(loaded->refusal->is(RecordingError::drivetrain));
  EXPECT_TRUE(loaded->recording.runs.empty());
}

TEST(Recording, SidesMayBeOneLetterOrOneWord) {
  const std::vector<std::pair<const char*, const char*>> pairs{
      {"Distance L", "Distance R"},
      {"LeftPosition", "RightPosition"},
      {"frontleft/position", "frontright/position"}};
  for (const auto& [left, right] : pairs) {
    Log log = four_controllers("sysid-test-state-Base");
    log.signals.push_back(signal(left, "", linear));
    log.signals.push_back(signal(right, "", linear));
    EXPECT_EQ(refusal_of(log, {}), "drivetrain") << left;
  }
  Log log = four_controllers("sysid-test-state-Base");
  log.signals.push_back(signal("Level position", "", linear));
  log.signals.push_back(signal("Roller position", "", linear));
  EXPECT_EQ(refusal_of(log, {}), "ambiguous_channel");
}

// Two motors lift it: which one was recorded is asked, and a side once said is kept.
TEST(Recording, AnElevatorMayHaveALeftAndARightMotor) {
  Log log = wpilog("Meter");
  log.texts[0].name = "sysid-test-state-Elevator";
  log.signals.clear();
  for (const char* side : {"left", "right"}) {
    log.signals.push_back(signal(std::string(side) + " applied volts", "Volt", volts));
    log.signals.push_back(signal(std::string(side) + " carriage position", "Meter", linear));
    log.signals.push_back(
        signal(std::string(side) + " carriage velocity", "Meter per Second", one));
  }
  EXPECT_EQ(refusal_of(log, {}), "ambiguous_channel");
  LogSelection selection;
  selection.voltage_channel = "right applied volts";
  const auto loaded = recording_from_log(log, selection);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_FALSE(loaded->refusal);
  ASSERT_FALSE(loaded->diagnostics.empty());
  EXPECT_NE(loaded->diagnostics.front().message.find("right carriage position"), std::string::npos);
}

TEST(Recording, AsksWhichChannelWhenSeveralFit) {
  Log log = wpilog("Rotation");
  log.texts[0].name = "/RealOutputs/SysIdTestState";
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());  // the voltage's namesakes
  log.signals[0].name = "/Arm/AppliedVolts";
  EXPECT_EQ(code_of(log, {.mechanism = MechanismKind::arm}), "ambiguous_channel");
  LogSelection selection;
  selection.mechanism = MechanismKind::arm;
  selection.position_channel = "position-motor-Wrist";
  EXPECT_EQ(code_of(log, selection), "accepted");
  selection.position_channel = "position-motor-Wirst";
  const auto misspelt = recording_from_log(log, selection);
  ASSERT_FALSE(misspelt);
  EXPECT_NE(to_string(misspelt.error()).find("did you mean \"position-motor-Wrist\""),
            std::string::npos);
}

TEST(Recording, SaysWhichChannelIsMissing) {
  Log log = wpilog("Rotation");
  log.signals.erase(log.signals.begin());
  EXPECT_EQ(code_of(log, {.mechanism = MechanismKind::arm}), "no_channel");
  const auto listed = recording_from_log(log, {.mechanism = MechanismKind::arm});
  for (const char* channel :
       {"such as \"", "\"position-motor-Wrist\"", "\"NT:/intake/Position\""}) {
    EXPECT_NE(to_string(listed.error()).find(channel), std::string::npos) << channel;
  }
  log = wpilog("Rotation");
  log.texts[0].value.assign(5, "none");
  EXPECT_EQ(code_of(log, {.mechanism = MechanismKind::arm}), "no_tests");
  LogSelection selection;
  selection.state_channel = "sysid-test-state-Elbow";
  EXPECT_EQ(code_of(wpilog("Rotation"), selection), "no_test_state");
  selection = {};
  selection.scale = 0.0;
  EXPECT_EQ(code_of(wpilog("Rotation"), selection), "out_of_range");
}

TEST(Recording, TellsTestsApartByTheVoltageAlone) {
  Log log = wpilog("Rotation");
  log.texts.clear();
  log.signals.resize(3);
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->recording.runs.size(), 2u);
  EXPECT_EQ(loaded->recording.runs[0].kind, TestKind::quasistatic_forward);
  EXPECT_EQ(loaded->recording.runs[1].kind, TestKind::dynamic_reverse);
}

TEST(Recording, ScalesASysIdJsonByItsUnits) {
  Log log;
  log.source = "arm.json";
  log.format = "SysId JSON";
  SysIdJson sysid;
  sysid.test = "Arm";
  sysid.units = "Degrees";
  sysid.units_per_rotation = 360.0;
  SysIdJson::Run run;
  run.name = "slow-forward";
  run.time = {0.0, 0.005};
  run.voltage = {0.0, 1.0};
  run.position = {0.25, 0.5};
  run.velocity = {0.0, 1.0};
  sysid.runs = {run};
  log.sysid = sysid;
  const auto loaded = recording_from_log(log, {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->recording.mechanism, MechanismKind::arm);
  EXPECT_EQ(loaded->recording.unit, "rad");
  // A quarter of a rotation is 90 degrees, π/2 rad.
  EXPECT_NEAR(loaded->recording.runs[0].position[0], two_pi / 4.0, 1e-12);
  EXPECT_NEAR(loaded->recording.runs[0].velocity[1], two_pi, 1e-12);

  log.sysid->test.clear();
  EXPECT_EQ(code_of(log, {}), "mechanism_unknown");
}

// Two tests of one kind whose clocks begin anew are two runs, although no state lies between them.
TEST(Recording, SilenceEndsARun) {
  Log log = wpilog("Radian");
  for (Signal& s : log.signals) {
    for (std::size_t i = 0; i < s.time.size(); ++i) {
      s.time[i] += s.time[i] >= 2.0 ? 2.0 : 0.0;
    }
  }
  log.texts[0].time = {0.0, 1.0, 5.0, 6.0, 7.0};
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->recording.runs.size(), 3U);
  EXPECT_EQ(loaded->recording.runs[0].kind, TestKind::quasistatic_forward);
  EXPECT_EQ(loaded->recording.runs[1].kind, TestKind::quasistatic_forward);
  EXPECT_LT(loaded->recording.runs[0].time.back(), 2.0);
  EXPECT_GE(loaded->recording.runs[1].time.front(), 4.0);
}

}  // namespace
}  // namespace flyball::recording
