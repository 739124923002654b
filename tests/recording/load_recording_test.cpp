#include <flyball/recording/load_recording.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/io/log.hpp>

namespace flyball::recording::load_recording_test {
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

TEST(Recording, LeavesTheMechanismOpenThatNothingSays) {
  for (const auto& [unit, si] : {std::pair{"Meter", "m"}, {"Rotation", "rad"}}) {
    const auto open = recording_from_log(wpilog(unit), {});
    ASSERT_TRUE(open) << to_string(open.error());
    EXPECT_FALSE(open->recording.mechanism);
    EXPECT_EQ(open->recording.unit, si);
  }
}

const Diagnostic* told(const LoadedRecording& loaded, std::string_view code) {
  const auto found = std::find_if(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                                  [code](const Diagnostic& d) { return d.code == code; });
  return found != loaded.diagnostics.end() ? &*found : nullptr;
}

TEST(Recording, APersonOverrulesTheLogsOwnWordWithAWarning) {
  Log log = wpilog("Rotation");
  log.texts[0].name = "sysid-test-state-Shooter";
  const auto believed = recording_from_log(log, {});
  ASSERT_TRUE(believed);
  EXPECT_EQ(believed->recording.mechanism, MechanismKind::flywheel);
  EXPECT_EQ(told(*believed, "mechanism_overruled"), nullptr);
  const auto overruled = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(overruled);
  EXPECT_EQ(overruled->recording.mechanism, MechanismKind::arm);
  const Diagnostic* warning = told(*overruled, "mechanism_overruled");
  ASSERT_NE(warning, nullptr);
  EXPECT_EQ(warning->severity, Severity::warning);
  EXPECT_NE(warning->message.find("a flywheel"), std::string::npos);
}

TEST(Recording, MarksTheRunsThatAPersonTrimsAndLeavesOut) {
  LogSelection selection;
  selection.runs = {"1: 0.5 .. 1.5"};
  selection.without_runs = {"2"};
  auto loaded = recording_from_log(wpilog("Rotation"), selection);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->recording.runs.size(), 2U);
  EXPECT_EQ(loaded->recording.runs[0].from, 0.5);
  EXPECT_EQ(loaded->recording.runs[0].to, 1.5);
  EXPECT_FALSE(loaded->recording.runs[0].left_out);
  EXPECT_TRUE(loaded->recording.runs[1].left_out);
  EXPECT_FALSE(loaded->recording.runs[1].is_trimmed());
  selection.runs = {"2:..500 ms"};
  selection.without_runs.clear();
  loaded = recording_from_log(wpilog("Rotation"), selection);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->recording.runs[1].from, 0.0);
  EXPECT_NEAR(loaded->recording.runs[1].to, 0.5, 1e-12);
}

TEST(Recording, RefusesRunsThatAreNotThere) {
  const auto code = [](std::vector<std::string> runs, std::vector<std::string> without) {
    LogSelection selection;
    selection.runs = std::move(runs);
    selection.without_runs = std::move(without);
    return code_of(wpilog("Rotation"), selection);
  };
  EXPECT_EQ(code({"3:0..1"}, {}), "no_run");
  EXPECT_EQ(code({"0:0..1"}, {}), "no_run");
  EXPECT_EQ(code({}, {"3"}), "no_run");
  EXPECT_EQ(code({}, {"1", "2"}), "empty");
  EXPECT_EQ(code({}, {"all"}), "malformed");
  EXPECT_EQ(code({"1:0.5-1"}, {}), "malformed");
  EXPECT_EQ(code({"one:0.5..1"}, {}), "malformed");
  EXPECT_EQ(code({"1:2.5..3"}, {}), "empty");
  EXPECT_EQ(code({"1:1..0.5"}, {}), "empty");
  EXPECT_EQ(code({"1:0.5 V..1"}, {}), "wrong_unit");
  LogSelection selection;
  selection.runs = {"3:0..1"};
  EXPECT_EQ(to_string(recording_from_log(wpilog("Rotation"), selection).error()),
            "robot.wpilog: runs is run 3, which the log does not have; it must be one of 1 "
            "(quasistatic-forward), 2 (dynamic-reverse)");
}

Log with_follower(double (*volts_of)(double), double (*position_of)(double)) {
  Log log = wpilog("Rotation");
  log.signals.push_back(signal("voltage-follower-Wrist", "Volt", volts_of, 0.02, 0.001));
  log.signals.push_back(signal("position-follower-Wrist", "Rotation", position_of, 0.02, 0.004));
  return log;
}

// A follower on the other side turns the other way, from another zero.
TEST(Recording, MotorsThatShowTheSameAreOneMechanisms) {
  const Log log =
      with_follower([](double t) { return -volts(t); }, [](double t) { return 3.0 - t; });
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_NE(told(*loaded, "several_motors"), nullptr);
  EXPECT_NE(told(*loaded, "several_motors")->message.find("voltage-motor-Wrist"),
            std::string::npos);
  EXPECT_GT(loaded->recording.runs[0].voltage.back(), 0.0);
}

// Two encoders that turn opposite ways from zeros of their own, neither named as the voltage is.
TEST(Recording, EncodersOfOneMechanismMayHaveTheirOwnZeros) {
  const auto log_with = [](double (*other)(double)) {
    Log log = wpilog("Rotation");
    log.signals[1].name = "left encoder angle";
    log.signals[2].name = "left encoder speed";
    log.signals.push_back(signal("right encoder angle", "Rotation", other, 0.02, 0.004));
    std::erase_if(log.signals, [](const Signal& s) { return s.name.starts_with("NT:"); });
    return log;
  };
  const auto alike = recording_from_log(log_with([](double t) { return 7.0 - linear(t); }),
                                        {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(alike) << to_string(alike.error());
  EXPECT_NE(told(*alike, "several_motors"), nullptr);
  EXPECT_EQ(code_of(log_with([](double t) { return 7.0 - 1.2 * linear(t); }),
                    {.mechanism = MechanismKind::arm}),
            "ambiguous_channel");
}

TEST(Recording, MotorsThatDifferHaveToBeChosenFrom) {
  const Log log =
      with_follower([](double t) { return 0.7 * volts(t); }, [](double t) { return 3.0 - t; });
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_FALSE(loaded);
  EXPECT_TRUE(loaded.error().is(RecordingError::ambiguous_channel));
  EXPECT_NE(to_string(loaded.error()).find("30 %"), std::string::npos) << to_string(loaded.error());
}

TEST(Recording, AnotherMechanismsRoutineIsLeftOut) {
  Log log = wpilog("Rotation");
  log.texts[0].time.insert(log.texts[0].time.end(), {6.0, 7.0});
  log.texts[0].value.insert(log.texts[0].value.end(), {"dynamic-forward", "none"});
  const auto loaded = recording_from_log(log, {.mechanism = MechanismKind::arm});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->recording.runs.size(), 2U);
  ASSERT_NE(told(*loaded, "other_routine"), nullptr);
  EXPECT_NE(told(*loaded, "other_routine")->message.find("1 of 3 tests"), std::string::npos);
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

// A drivetrain's channels in metres; the left side's velocity is 0.9 m/s, the right one's 1 m/s.
Log drivetrain(std::string state_name) {
  Log log = wpilog("Meter");
  log.texts[0].name = std::move(state_name);
  log.signals.clear();
  for (const std::string side : {"left", "right"}) {
    log.signals.push_back(signal("voltage-" + side + "-Base", "Volt", volts));
    log.signals.push_back(signal("position-" + side + "-Base", "Meter",
                                 side == "left" ? +[](double t) { return 0.9 * t; } : linear, 0.02,
                                 0.004));
    log.signals.push_back(signal("velocity-" + side + "-Base", "Meter per Second",
                                 side == "left" ? +[](double) { return 0.9; } : one, 0.02, 0.004));
  }
  log.signals.push_back(signal("NT:/SmartDashboard/Gyro Pitch", "", one));
  log.signals.push_back(
      signal("NT:/SmartDashboard/Gyro Yaw", "deg", [](double t) { return 10.0 * t; }));
  return log;
}

TEST(Recording, LeftAndRightAreADrivetrain) {
  const auto loaded = recording_from_log(drivetrain("sysid-test-state-Base"), {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_TRUE(loaded->drive);
  EXPECT_TRUE(loaded->recording.runs.empty());
  EXPECT_EQ(loaded->drive->unit, "m");
  ASSERT_EQ(loaded->drive->runs.size(), 2u);
  const identification::DriveRun& run = loaded->drive->runs[0];
  EXPECT_EQ(run.kind, TestKind::quasistatic_forward);
  const std::size_t i = run.time.size() / 2;
  EXPECT_NEAR(run.left.position[i], 0.9 * run.time[i], 1e-9);
  EXPECT_NEAR(run.right.position[i], run.time[i], 1e-9);
  EXPECT_NEAR(run.left.velocity[i], 0.9, 1e-12);
  EXPECT_NEAR(run.right.voltage[i], volts(run.time[i]), 0.02);
  EXPECT_NEAR(run.heading[i], 10.0 * run.time[i] * two_pi / 360.0, 1e-9);

  LogSelection channels;
  channels.voltage_channel = "voltage-right-Base,voltage-left-Base";
  channels.position_channel = "position-right-Base,position-left-Base";
  channels.velocity_channel = "velocity-right-Base,velocity-left-Base";
  channels.heading_channel = "NT:/SmartDashboard/Gyro Pitch";
  channels.drivetrain = true;
  const auto said = recording_from_log(drivetrain("sysid-test-state-Base"), channels);
  ASSERT_TRUE(said) << to_string(said.error());
  EXPECT_NEAR(said->drive->runs[0].left.velocity[i], 1.0, 1e-12);
  EXPECT_EQ(said->drive->runs[0].heading[i], 1.0);
  channels.voltage_channel = "voltage-right-Base";
  EXPECT_EQ(code_of(drivetrain("sysid-test-state-Base"), channels), "no_channel");
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
  return !recording         ? std::string(recording.error().code())
         : recording->drive ? "drivetrain"
                            : "accepted";
}

TEST(Recording, ADrivetrainIsToldByItsName) {
  for (const char* name : {"sysid-test-state-DriveSubsystem", "sysid-test-state-drivetrain"}) {
    // Its sides are asked for, all at once.
    const auto asked = recording_from_log(four_controllers(name), {});
    ASSERT_FALSE(asked) << name;
    EXPECT_TRUE(asked.error().is(RecordingError::no_channel)) << name;
    for (const char* words : {"--voltage LEFT,RIGHT", "--position LEFT,RIGHT", "--heading", name}) {
      EXPECT_NE(to_string(asked.error()).find(words), std::string::npos)
          << to_string(asked.error());
    }
  }
  for (const char* name : {"/RealOutputs/Swerve/SysIdState", "sysid-test-state-swerve_drive",
                           "sysid-test-state-CommandSwerveDrivetrain"}) {
    const auto swerve = recording_from_log(four_controllers(name), {});
    ASSERT_FALSE(swerve) << name;
    EXPECT_TRUE(swerve.error().is(RecordingError::drivetrain)) << name;
    EXPECT_NE(to_string(swerve.error()).find("--mechanism \"swerve steer\""), std::string::npos);
  }
  // Four motors that show the same are one mechanism's.
  EXPECT_EQ(refusal_of(four_controllers("sysid-test-state-Wrist"), {}), "accepted");
  // Not every word that begins so is one.
  EXPECT_EQ(refusal_of(four_controllers("sysid-test-state-Screwdriver"), {}), "accepted");
  // What the person says has the last word.
  const Log drive = four_controllers("sysid-test-state-DriveSubsystem");
  EXPECT_EQ(refusal_of(drive, {.mechanism = MechanismKind::flywheel}), "accepted");
  LogSelection one_motor;
  one_motor.mechanism = MechanismKind::flywheel;
  one_motor.voltage_channel = drive.signals[0].name;
  one_motor.position_channel = drive.signals[1].name;
  one_motor.velocity_channel = drive.signals[2].name;
  EXPECT_EQ(refusal_of(drive, one_motor), "accepted");
}

TEST(Recording, SidesMayBeOneLetterOrOneWord) {
  const std::vector<std::pair<const char*, const char*>> pairs{
      {"Distance L", "Distance R"},
      {"LeftPosition", "RightPosition"},
      {"frontleft/position", "frontright/position"}};
  for (const auto& [left, right] : pairs) {
    Log log = four_controllers("sysid-test-state-Base");
    log.signals.push_back(signal(left, "Meter", linear));
    log.signals.push_back(signal(right, "Meter", linear));
    // Only the voltages are asked for.
    const auto asked = recording_from_log(log, {});
    ASSERT_FALSE(asked) << left;
    EXPECT_NE(to_string(asked.error()).find("--voltage LEFT,RIGHT"), std::string::npos) << left;
    EXPECT_EQ(to_string(asked.error()).find("--position LEFT,RIGHT"), std::string::npos) << left;
  }
  Log log = four_controllers("sysid-test-state-Base");
  log.signals.push_back(signal("Level position", "", linear));
  log.signals.push_back(signal("Roller position", "", linear));
  EXPECT_EQ(refusal_of(log, {}), "accepted");  // As of motors that show the same.
}

// Two motors lift it: where they differ it is asked which is meant, and a side once said is kept.
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
  EXPECT_EQ(refusal_of(log, {}), "accepted");
  log.signals[1] = signal("left carriage position", "Meter", [](double t) { return 0.5 * t; });
  EXPECT_EQ(refusal_of(log, {}), "accepted");  // The voltage's own side.
  log.signals[0] = signal("left applied volts", "Volt", [](double t) { return 0.5 * volts(t); });
  EXPECT_EQ(refusal_of(log, {}), "ambiguous_channel");
  LogSelection selection;
  selection.voltage_channel = "right applied volts";
  const auto loaded = recording_from_log(log, selection);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_FALSE(loaded->drive);
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
  const auto open = recording_from_log(log, {});
  ASSERT_TRUE(open) << to_string(open.error());
  EXPECT_FALSE(open->recording.mechanism);
}

// A drivetrain's SysId JSON in each of its layouts; a wheel's circumference is 0.5 m.
TEST(Recording, SysIdDrivetrains) {
  using Layout = SysIdJson::Layout;
  for (const Layout layout :
       {Layout::drive, Layout::characterization_2019, Layout::characterization_2020}) {
    Log log;
    log.source = "drive.json";
    log.format = "SysId JSON";
    SysIdJson sysid;
    sysid.layout = layout;
    const bool legacy = layout != Layout::drive;
    if (!legacy) {
      sysid.test = "Drivetrain (Angular)";
      sysid.units = "Meters";
      sysid.units_per_rotation = 0.5;
    }
    SysIdJson::Run run;
    run.name = "fast-backward";
    for (int i = 0; i < 400; ++i) {
      const double t = 0.005 * i;
      run.time.push_back(t);
      run.voltage.push_back(-6.0);
      run.right_voltage.push_back(6.0);
      run.position.push_back(-2.0 * t);
      run.right_position.push_back(1.5 * t);
      run.velocity.push_back(-2.0);
      run.right_velocity.push_back(1.5);
      if (layout != Layout::characterization_2019) {
        run.angle.push_back(0.25 * t);
      }
      if (!legacy) {
        run.angle_rate.push_back(0.25);
      }
    }
    sysid.runs = {run};
    log.sysid = sysid;
    const auto loaded = recording_from_log(log, {});
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    ASSERT_TRUE(loaded->drive);
    const identification::DriveRun& read = loaded->drive->runs.at(0);
    const double metres = legacy ? 1.0 : 0.5;
    EXPECT_NEAR(read.left.position[200], -2.0 * metres, 1e-12);
    EXPECT_NEAR(read.right.velocity[200], 1.5 * metres, 1e-12);
    EXPECT_EQ(read.left.voltage[200], -6.0);
    EXPECT_EQ(read.heading.empty(), layout == Layout::characterization_2019);
    EXPECT_EQ(read.heading_rate.empty(), legacy);
    // Nothing in the older files says the unit: it is assumed, first of all.
    EXPECT_EQ(loaded->diagnostics.empty() ? "" : loaded->diagnostics.front().code,
              legacy ? "unit_assumed" : "");
    // A person's word has the last word.
    const auto overruled = recording_from_log(log, {.mechanism = MechanismKind::flywheel});
    ASSERT_TRUE(overruled) << to_string(overruled.error());
    EXPECT_FALSE(overruled->drive);
    EXPECT_EQ(overruled->recording.runs.size(), 1u);
  }
  Log log;
  log.sysid = SysIdJson{};
  LogSelection drive;
  drive.drivetrain = true;
  EXPECT_EQ(code_of(log, drive), "no_channel");
}

// Rotations of wheels become metres once the person says how many one is.
TEST(Recording, WheelsOfUnknownSize) {
  Log log = drivetrain("sysid-test-state-Base");
  for (Signal& s : log.signals) {
    s.unit = s.unit == "Meter"              ? "Rotation"
             : s.unit == "Meter per Second" ? "Rotation per Second"
                                            : s.unit;
  }
  const auto turns = recording_from_log(log, {});
  ASSERT_TRUE(turns) << to_string(turns.error());
  EXPECT_EQ(turns->drive->unit, "rad");
  EXPECT_NEAR(turns->drive->runs[0].right.velocity[9], two_pi, 1e-12);
  LogSelection selection;
  selection.scale = 0.479;
  const auto metres = recording_from_log(log, selection);
  ASSERT_TRUE(metres) << to_string(metres.error());
  EXPECT_EQ(metres->drive->unit, "m");
  EXPECT_NEAR(metres->drive->runs[0].right.velocity[9], 0.479, 1e-12);
}

TEST(Recording, WordsForADrivetrain) {
  for (const char* text : {"drivetrain", "Drivetrain", "differential drive", "tank-drive"}) {
    EXPECT_TRUE(means_drivetrain(text)) << text;
  }
  for (const char* text : {"", "arm", "driver", "drivetrain (angular)"}) {
    EXPECT_FALSE(means_drivetrain(text)) << text;
  }
}

// Names tell a turret, a roller and the motions of a swerve module apart.
TEST(Recording, KindsByName) {
  const std::vector<std::pair<std::string, MechanismKind>> names{
      {"sysid-test-state-Turret", MechanismKind::turret},
      {"sysid-test-state-IntakeRollers", MechanismKind::roller},
      {"sysid-test-state-SwerveSteer", MechanismKind::swerve_steer},
      {"SysIdSteer_State", MechanismKind::swerve_steer},
      {"SysIdTranslation_State", MechanismKind::swerve_drive},
      {"/RealOutputs/Elevator/SysIdState", MechanismKind::elevator}};
  for (const auto& [name, kind] : names) {
    Log log = wpilog(kind == MechanismKind::elevator ? "Meter" : "Rotation");
    log.texts.front().name = name;
    log.signals.resize(3);
    const auto loaded = recording_from_log(log, {});
    ASSERT_TRUE(loaded) << name << ": " << to_string(loaded.error());
    EXPECT_EQ(loaded->recording.mechanism, kind) << name;
  }
}

// A wheel's rotations become metres once the person says how many one is; a turret has angles.
TEST(Recording, UnitsOfSwerveModulesAndTurrets) {
  LogSelection selection{.mechanism = MechanismKind::swerve_drive};
  EXPECT_EQ(recording_from_log(wpilog("Rotation"), selection)->recording.unit, "rad");
  selection.scale = 0.3;
  const auto metres = recording_from_log(wpilog("Rotation"), selection);
  ASSERT_TRUE(metres) << to_string(metres.error());
  EXPECT_EQ(metres->recording.unit, "m");
  EXPECT_NEAR(metres->recording.runs[0].velocity[9], 0.3, 1e-12);
  EXPECT_EQ(code_of(wpilog("Meter"), {.mechanism = MechanismKind::turret}), "unit_mismatch");
}

// An absolute encoder of 0 to 1 rotations under a motion of 1 rotation/s, rows 4 ms off the
// voltage's: the leaps are undone before rows fall into them. A step that is no leap stays.
TEST(Recording, AnglesThatWrapGoOn) {
  Log log = wpilog("Rotation");
  log.texts.front().name = "sysid-test-state-SwerveSteer";
  log.signals.resize(3);
  for (double& value : log.signals[1].value) {
    value -= std::floor(value);
  }
  const auto loaded = recording_from_log(log, {});
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const identification::TestRun& run = loaded->recording.runs[0];
  for (std::size_t i = 1; i < run.time.size(); ++i) {
    EXPECT_NEAR(run.position[i] - run.position[i - 1], two_pi * (run.time[i] - run.time[i - 1]),
                1e-9);
  }
  const auto told =
      std::find_if(loaded->diagnostics.begin(), loaded->diagnostics.end(),
                   [](const Diagnostic& found) { return found.code == "angle_unwrapped"; });
  ASSERT_NE(told, loaded->diagnostics.end());
  EXPECT_NE(told->message.find(" 7 times"), std::string::npos) << told->message;

  Log stale = wpilog("Rotation");  // begins with the last value of another test
  stale.signals.resize(3);
  std::vector<double>& values = stale.signals[1].value;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = i == 0 ? 0.95 : 0.95 * static_cast<double>(i) / static_cast<double>(values.size());
  }
  const auto kept = recording_from_log(stale, {});
  ASSERT_TRUE(kept) << to_string(kept.error());
  EXPECT_LT(kept->recording.runs.back().position.back(), two_pi);
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
}  // namespace flyball::recording::load_recording_test
