#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/export/holonomic_follower.hpp>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

constexpr std::array<const char*, 4> places{"frontLeft", "frontRight", "backLeft", "backRight"};

std::vector<Constant> constants_of(const HolonomicConstants& of) {
  std::vector<Constant> all;
  for (std::size_t i = 0; i < places.size(); ++i) {
    all.push_back({std::string(places[i]) + "X", of.modules[i](0), "m ahead of the middle"});
    all.push_back({std::string(places[i]) + "Y", of.modules[i](1), "m to its left"});
  }
  all.push_back({"kS", of.kS, "V, of a wheel"});
  all.push_back({"kV", of.kV, "V·s/m"});
  all.push_back({"kA", of.kA, "V·s²/m"});
  all.push_back({"kP", of.kP, "V·s/m, of a wheel's speed"});
  if (of.swerve) {
    all.push_back({"steerKP", of.steer_kP, "V/rad, of a module's direction"});
    all.push_back({"steerKD", of.steer_kD, "V·s/rad"});
  }
  all.push_back({"xKP", of.gains(0), "1/s, of the robot's place"});
  all.push_back({"yKP", of.gains(1), "1/s"});
  all.push_back({"headingKP", of.gains(2), "1/s"});
  all.push_back({"maxVelocity", of.max_velocity, "m/s, of the wheels without load"});
  return all;
}

std::string objects(const HolonomicConstants& of, Language language) {
  const bool cpp = language == Language::cpp;
  const bool python = language == Language::python;
  const std::string mark = std::string(comment_mark(language)) + " ";
  const std::string period = literal(of.period, constant_digits);
  const std::string own = python ? "c." : "";
  const std::string kinematics = of.swerve ? "SwerveDriveKinematics" : "MecanumDriveKinematics";
  std::string text;
  if (python) {
    text += mark + "from wpimath.controller import PIDController, SimpleMotorFeedforwardMeters\n";
    text += mark + "from wpimath.geometry import Translation2d\n";
    text += fmt::format("{}from wpimath.kinematics import {}\n", mark,
                        of.swerve ? "SwerveDrive4Kinematics" : kinematics);
    text += mark + "c = DrivetrainConstants\n";
  }
  std::string list;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::string x = own + places[i] + "X";
    const std::string y = own + places[i] + "Y";
    list += fmt::format("{}\n{}    {}", i == 0 ? "" : ",", mark,
                        cpp      ? fmt::format("frc::Translation2d{{{} * 1_m, {} * 1_m}}", x, y)
                        : python ? fmt::format("Translation2d({}, {})", x, y)
                                 : fmt::format("new Translation2d({}, {})", x, y));
  }
  const auto pid = [&](const char* name, const std::string& kP, const std::string& kD,
                       const char* comment) {
    text += cpp ? fmt::format("{}frc::PIDController {}{{{}, 0.0, {}, {} * 1_s}};  // {}\n", mark,
                              name, kP, kD, period, comment)
            : python
                ? fmt::format("{}{} = PIDController({}, 0.0, {}, {})  # {}\n", mark, name, kP, kD,
                              period, comment)
                : fmt::format("{}PIDController {} = new PIDController({}, 0.0, {}, {});  // {}\n",
                              mark, name, kP, kD, period, comment);
  };
  if (cpp) {
    text += fmt::format("{}frc::{} kinematics{{{}}};\n", mark,
                        of.swerve ? "SwerveDriveKinematics<4>" : kinematics, list);
    text += mark +
            "frc::SimpleMotorFeedforward<units::meters> wheel{kS * 1_V, kV * 1_V / 1_mps, kA * 1_V "
            "/ 1_mps_sq};\n";
  } else if (python) {
    text += fmt::format("{}kinematics = {}({})\n", mark,
                        of.swerve ? "SwerveDrive4Kinematics" : kinematics, list);
    text += mark + "wheel = SimpleMotorFeedforwardMeters(c.kS, c.kV, c.kA)\n";
  } else {
    text += fmt::format("{0}{1} kinematics = new {1}({2});\n", mark, kinematics, list);
    text += mark + "SimpleMotorFeedforward wheel = new SimpleMotorFeedforward(kS, kV, kA);\n";
  }
  pid("speed", own + "kP", "0.0", "of each wheel, answers in volts");
  if (of.swerve) {
    pid("steer", own + "steerKP", own + "steerKD", "of each module, in rad, answers in volts");
    text += mark + (cpp      ? "steer.EnableContinuousInput(-std::numbers::pi, std::numbers::pi);\n"
                    : python ? "steer.enableContinuousInput(-math.pi, math.pi)\n"
                             : "steer.enableContinuousInput(-Math.PI, Math.PI);\n");
  }
  pid("x", own + "xKP", "0.0", "of the pose in the field, adds to the reference's m/s");
  pid("y", own + "yKP", "0.0", "the same");
  pid("heading", own + "headingKP", "0.0", "adds to the reference's rad/s");
  text += mark + (cpp      ? "heading.EnableContinuousInput(-std::numbers::pi, std::numbers::pi);\n"
                  : python ? "heading.enableContinuousInput(-math.pi, math.pi)\n"
                           : "heading.enableContinuousInput(-Math.PI, Math.PI);\n");
  return text;
}

}  // namespace

std::vector<PasteText> paste_holonomic_constants(const HolonomicConstants& of) {
  std::vector<PasteText> all;
  for (const Language language : languages) {
    std::string text = comments(
        fmt::format(
            "// {} drive, for WPILib 2025.\n// Loop period {} ms; volts are at the motor.\n",
            of.swerve ? "Swerve" : "Mecanum", format_number(1e3 * of.period, 4)),
        language);
    text += scope("DrivetrainConstants", constants_of(of), language) + "\n";
    text += language == Language::cpp ? "// using namespace DrivetrainConstants;\n" : "";
    all.push_back({fmt::format("WPILib, {}", name_of(language)), constants_file("wpilib", language),
                   text + objects(of, language)});
  }
  return all;
}

}  // namespace flyball::exports
