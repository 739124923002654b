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
  of.unit = kind == MechanismKind::elevator ? "m" : "rad";
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
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    const MechanismConstants of = constants(kind);
    const bool gravity = kind != MechanismKind::flywheel;
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
