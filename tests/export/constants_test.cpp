#include <flyball/export/constants.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <regex>

#include <gtest/gtest.h>

namespace flyball::exports {
namespace {

using mechanisms::MechanismKind;

/// A mechanism's gains, per its unit, rotation and RPM.
/// @param turn  Units a rotation; 0 if they cannot be turned into rotations.
MechanismConstants constants(MechanismKind kind, double turn = 2.0 * std::numbers::pi) {
  MechanismConstants of;
  of.kind = kind;
  of.unit = position_unit(kind);
  of.gearing = 10.0;
  of.angle_offset = kind == MechanismKind::arm ? 0.2 : 0.0;
  const UnitGains own{
      .per = of.unit, .kP = 61.2345678, .kD = 3.21, .kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.65};
  of.gains = {own};
  for (const auto& [per, size] : {std::pair("rotation", turn), std::pair("RPM", turn / 60.0)}) {
    if (turn > 0.0) {
      of.gains.push_back({.per = per,
                          .kP = own.kP * turn,
                          .kD = own.kD * size,
                          .kS = own.kS,
                          .kV = own.kV * size,
                          .kA = own.kA * size,
                          .kG = own.kG});
    }
  }
  return of;
}

/// The number that a line assigns to `name`: "kV = 4.0" or ".withKV(4.0)".
double value_of(const std::string& text, const std::string& name) {
  std::smatch match;
  const std::regex assignment("\\b" + name + " = ([-0-9.e+]+);");
  if (std::regex_search(text, match, assignment)) {
    return std::stod(match[1]);
  }
  const std::regex call("[wW]ithK" + name.substr(1) + "\\(([-0-9.e+]+)\\)");
  if (std::regex_search(text, match, call)) {
    return std::stod(match[1]);
  }
  ADD_FAILURE() << name << " is not in:\n" << text;
  return std::nan("");
}

const UnitGains& gains_per(const MechanismConstants& of, const std::string& per) {
  return *std::find_if(of.gains.begin(), of.gains.end(),
                       [&](const auto& gains) { return gains.per == per; });
}

void expect_gains(const std::string& text, const UnitGains& gains, bool gravity) {
  const auto expect = [&](const char* name, double value) {
    EXPECT_NEAR(value_of(text, name), value, 1e-5 * std::abs(value)) << text;
  };
  expect("kS", gains.kS);
  expect("kV", gains.kV);
  expect("kA", gains.kA);
  expect("kP", gains.kP);
  expect("kD", gains.kD);
  if (gravity) {
    expect("kG", gains.kG);
  } else {
    EXPECT_EQ(text.find("kG ="), std::string::npos);
    EXPECT_EQ(text.find("ithKG("), std::string::npos);
  }
}

TEST(Constants, CarryTheDesignsGainsInEveryUnitAndLanguage) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm, MechanismKind::turret,
        MechanismKind::swerve_steer, MechanismKind::swerve_drive}) {
    const MechanismConstants of = constants(kind);
    const bool gravity = kind == MechanismKind::elevator || kind == MechanismKind::arm;
    for (const Language language : {Language::cpp, Language::java}) {
      expect_gains(wpilib_constants(of, language), gains_per(of, of.unit), gravity);
      expect_gains(phoenix_constants(of, language), gains_per(of, "rotation"), gravity);
      expect_gains(rev_constants(of, language), gains_per(of, "RPM"), gravity);
    }
  }
}

TEST(Constants, EachNumberHasItsUnitBesideIt) {
  const MechanismConstants of = constants(MechanismKind::elevator);
  const std::string wpilib = wpilib_constants(of, Language::java);
  for (const char* unit :
       {"// V, static friction", "// V, gravity", "// V·s/m\n", "// V·s²/m", "// V/m\n"}) {
    EXPECT_NE(wpilib.find(unit), std::string::npos) << unit << "\n" << wpilib;
  }
  EXPECT_NE(phoenix_constants(of, Language::cpp).find("// V·s/rotation"), std::string::npos);
  EXPECT_NE(rev_constants(of, Language::cpp).find("// V/RPM"), std::string::npos);
}

TEST(Constants, NameTheClassesThatTakeThem) {
  const auto has = [](const std::string& text, const char* name) {
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
  };
  const MechanismConstants arm = constants(MechanismKind::arm);
  has(wpilib_constants(arm, Language::cpp), "frc::ArmFeedforward");
  has(wpilib_constants(arm, Language::java), "new ArmFeedforward(kS, kG, kV, kA");
  has(wpilib_constants(arm, Language::java), "new PIDController(kP, 0.0, kD");
  has(phoenix_constants(arm, Language::java), "GravityTypeValue.Arm_Cosine");
  has(rev_constants(arm, Language::java), ".kCos(kG)");
  has(wpilib_constants(arm, Language::java), "0.2 rad");
  const MechanismConstants elevator = constants(MechanismKind::elevator);
  has(wpilib_constants(elevator, Language::cpp), "frc::ElevatorFeedforward");
  has(phoenix_constants(elevator, Language::cpp), "GravityTypeValue::Elevator_Static");
  const MechanismConstants flywheel = constants(MechanismKind::flywheel);
  has(wpilib_constants(flywheel, Language::java), "new SimpleMotorFeedforward(kS, kV, kA");
  has(rev_constants(flywheel, Language::java), "velocityFF(kV / 12.0)");
}

// What turns endlessly takes the shorter way; a wheel on the floor has metres and a velocity.
TEST(Constants, OfTurretsAndSwerveModules) {
  const auto has = [](const std::string& text, const char* name) {
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
  };
  const MechanismConstants steer = constants(MechanismKind::swerve_steer);
  has(wpilib_constants(steer, Language::java), "public final class SwerveSteerConstants");
  has(wpilib_constants(steer, Language::java), "enableContinuousInput(-Math.PI, Math.PI)");
  has(wpilib_constants(steer, Language::cpp), "frc::SimpleMotorFeedforward<units::radians> ");
  has(phoenix_constants(steer, Language::cpp), "ClosedLoopGeneral.ContinuousWrap = true");
  has(phoenix_constants(steer, Language::cpp), "PositionVoltage");
  has(rev_constants(steer, Language::java), "positionWrappingInputRange(0, 1)");
  has(rev_constants(steer, Language::java), "closedLoop.d(kD");
  EXPECT_EQ(wpilib_constants(steer, Language::cpp).find("cable"), std::string::npos);
  has(wpilib_constants(constants(MechanismKind::turret), Language::cpp), "unless a cable");
  const MechanismConstants drive = constants(MechanismKind::swerve_drive, 0.3);
  has(wpilib_constants(drive, Language::cpp), "frc::SimpleMotorFeedforward<units::meters> ");
  has(phoenix_constants(drive, Language::java), "VelocityVoltage");
  has(phoenix_constants(drive, Language::java), "one rotation is one of the wheel");
  EXPECT_EQ(wpilib_constants(drive, Language::java).find("ontinuousInput"), std::string::npos);
  EXPECT_EQ(rev_constants(drive, Language::java).find("closedLoop.d("), std::string::npos);
}

// A motor controller's own loop has its own gains; the robot's loop keeps those of its period.
TEST(Constants, OfLoopsOnMotorControllers) {
  MechanismConstants of = constants(MechanismKind::arm);
  of.delay = 0.0425;
  of.on_board = of.gains;
  for (UnitGains& gains : of.on_board) {
    gains.kP *= 2.0;
    gains.kD *= 3.0;
  }
  for (const Language language : {Language::cpp, Language::java}) {
    expect_gains(wpilib_constants(of, language), gains_per(of, "rad"), true);
    const auto own = [&](std::string_view per) {
      return *std::find_if(of.on_board.begin(), of.on_board.end(),
                           [&](const auto& gains) { return gains.per == per; });
    };
    expect_gains(phoenix_constants(of, language), own("rotation"), true);
    expect_gains(rev_constants(of, language), own("RPM"), true);
  }
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  };
  has(rev_constants(of, Language::java),
      "Loop period 1 ms, on the controller, and a measurement that is 42.5 ms old");
  has(wpilib_constants(of, Language::java),
      "Loop period 20 ms and a measurement that is 42.5 ms old");
  // 2 · 61.2345678 · 2π V a rotation of 12 V; 60 · 3 · 3.21 · 2π/60 V s a rotation over 1 ms and 12
  // V.
  has(rev_constants(of, Language::java), "closedLoop.p(kP / 12.0);  // 64.1247 of the voltage per");
  has(rev_constants(of, Language::java), "// 5042.26 per change of rotations");
}

// kD e' with e' = (e_k - e_(k-1))/1 ms: WPILib's SysId divides a position loop's kD by 12 V and by
// the 1 ms of a controller that is not time-normalised; 60 makes V/RPM a V s/rotation.
TEST(Constants, ASparkDifferentiatesOverItsMillisecond) {
  const MechanismConstants of = constants(MechanismKind::arm);
  EXPECT_NE(rev_constants(of, Language::cpp).find("closedLoop.D(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  EXPECT_NE(rev_constants(of, Language::java).find("closedLoop.d(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  const UnitGains& rotation = gains_per(of, "rotation");
  EXPECT_NEAR(60.0 * gains_per(of, "RPM").kD, rotation.kD, 1e-9 * rotation.kD);
}

TEST(Constants, AnUndeterminedKAIsZeroWithItsReason) {
  MechanismConstants of = constants(MechanismKind::elevator, 0.1596);  // of a 2 r π = 0.1596 m drum
  for (UnitGains& gains : of.gains) {
    gains.kA = 0.0;
  }
  of.kA_determined = false;
  of.kA_upper_bound = 0.6;
  of.kA_reason = "the speed-up\nis\x1B over \\";
  const std::string text = wpilib_constants(of, Language::java);
  EXPECT_EQ(value_of(text, "kA"), 0.0);
  EXPECT_NE(text.find("not determined, below 0.6: the speed-up is? over /\n"), std::string::npos)
      << text;
  EXPECT_NE(phoenix_constants(of, Language::java).find("not determined, below 0.0958"),
            std::string::npos);
}

TEST(Constants, LeaveOutWhatThereAreNoGainsFor) {
  const MechanismConstants of = constants(MechanismKind::elevator, 0.0);
  EXPECT_EQ(phoenix_constants(of, Language::cpp), "");
  EXPECT_EQ(rev_constants(of, Language::java), "");
  EXPECT_EQ(paste_constants(of).size(), 2u);
  EXPECT_EQ(paste_constants(constants(MechanismKind::arm)).size(), 6u);
}

}  // namespace
}  // namespace flyball::exports
