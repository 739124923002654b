#include <flyball/report/constants.hpp>

#include <algorithm>
#include <regex>

#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace flyball::report {
namespace {

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

const study::PasteGains& gains_per(const study::DesignResult& design, const std::string& per) {
  return *std::find_if(design.paste.begin(), design.paste.end(),
                       [&](const auto& gains) { return gains.per == per; });
}

void expect_gains(const std::string& text, const study::PasteGains& gains, bool gravity) {
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
    const study::DesignResult design = design_result(kind);
    const bool gravity = kind != MechanismKind::flywheel;
    for (const Language language : {Language::cpp, Language::java}) {
      expect_gains(wpilib_constants(design, language), gains_per(design, design.job.plant.unit),
                   gravity);
      expect_gains(phoenix_constants(design, language), gains_per(design, "rotation"), gravity);
      expect_gains(rev_constants(design, language), gains_per(design, "RPM"), gravity);
    }
  }
}

TEST(Constants, EachNumberHasItsUnitBesideIt) {
  const study::DesignResult design = design_result(MechanismKind::elevator);
  const std::string wpilib = wpilib_constants(design, Language::java);
  for (const char* unit :
       {"// V, static friction", "// V, gravity", "// V·s/m\n", "// V·s²/m", "// V/m\n"}) {
    EXPECT_NE(wpilib.find(unit), std::string::npos) << unit << "\n" << wpilib;
  }
  EXPECT_NE(phoenix_constants(design, Language::cpp).find("// V·s/rotation"), std::string::npos);
  EXPECT_NE(rev_constants(design, Language::cpp).find("// V/RPM"), std::string::npos);
}

TEST(Constants, NameTheClassesThatTakeThem) {
  const auto has = [](const std::string& text, const char* name) {
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
  };
  const study::DesignResult arm = design_result(MechanismKind::arm);
  has(wpilib_constants(arm, Language::cpp), "frc::ArmFeedforward");
  has(wpilib_constants(arm, Language::java), "new ArmFeedforward(kS, kG, kV, kA");
  has(wpilib_constants(arm, Language::java), "new PIDController(kP, 0.0, kD");
  has(phoenix_constants(arm, Language::java), "GravityTypeValue.Arm_Cosine");
  has(rev_constants(arm, Language::java), ".kCos(kG)");
  has(wpilib_constants(arm, Language::java), "0.2 rad");
  const study::DesignResult elevator = design_result(MechanismKind::elevator);
  has(wpilib_constants(elevator, Language::cpp), "frc::ElevatorFeedforward");
  has(phoenix_constants(elevator, Language::cpp), "GravityTypeValue::Elevator_Static");
  const study::DesignResult flywheel = design_result(MechanismKind::flywheel);
  has(wpilib_constants(flywheel, Language::java), "new SimpleMotorFeedforward(kS, kV, kA");
  has(rev_constants(flywheel, Language::java), "velocityFF(kV / 12.0)");
}

// kD e' with e' = (e_k - e_(k-1))/1 ms: WPILib's SysId divides a position loop's kD by 12 V and by
// the 1 ms of a controller that is not time-normalised; 60 makes V/RPM a V s/rotation.
TEST(Constants, ASparkDifferentiatesOverItsMillisecond) {
  const study::DesignResult design = design_result(MechanismKind::arm);
  EXPECT_NE(rev_constants(design, Language::cpp).find("closedLoop.D(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  EXPECT_NE(rev_constants(design, Language::java).find("closedLoop.d(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  const study::PasteGains& rotation = gains_per(design, "rotation");
  EXPECT_NEAR(60.0 * gains_per(design, "RPM").kD, rotation.kD, 1e-9 * rotation.kD);
}

TEST(Constants, AnUndeterminedKAIsZeroWithItsReason) {
  const study::DesignResult design = design_result(MechanismKind::elevator, false);
  const std::string reason = "the speed-up\nis over \\";
  const std::string text = wpilib_constants(design, Language::java, reason);
  EXPECT_EQ(value_of(text, "kA"), 0.0);
  EXPECT_NE(text.find("not determined, below 0.6: the speed-up is over /\n"), std::string::npos)
      << text;
  // Per rotation of a 2 r π = 0.1596 m drum.
  EXPECT_NE(phoenix_constants(design, Language::java).find("not determined, below 0.0958"),
            std::string::npos);
}

TEST(Constants, LeaveOutWhatTheDesignDoesNotHave) {
  study::DesignJob job = design_job(MechanismKind::elevator);
  job.plant.drum_radius = 0.0;  // metres cannot be turned into rotations
  const study::DesignResult design = study::design(job).value();
  EXPECT_EQ(phoenix_constants(design, Language::cpp), "");
  EXPECT_EQ(rev_constants(design, Language::java), "");
  EXPECT_EQ(paste_constants(design).size(), 2u);
  EXPECT_EQ(paste_constants(design_result(MechanismKind::arm)).size(), 6u);
}

}  // namespace
}  // namespace flyball::report
