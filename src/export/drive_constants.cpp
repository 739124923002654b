#include <flyball/export/drive_constants.hpp>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

std::vector<Constant> constants_of(const DriveConstants& of) {
  std::vector<Constant> all;
  const auto mode = [&](const std::string& name, const DriveModeGains& gains, double scale,
                        const std::string& unit, const char* what) {
    all.push_back({"kS" + name, gains.kS, fmt::format("V, static friction, {}", what)});
    all.push_back({"kV" + name, scale * gains.kV, "V·s/" + unit});
    all.push_back({"kA" + name, scale * gains.kA,
                   "V·s²/" + unit + (gains.kA == 0.0 ? ", not determined" : "")});
  };
  if (of.linear) {
    mode("Linear", *of.linear, 1.0, of.unit, "straight on");
  }
  if (of.angular && of.trackwidth) {
    mode("Angular", *of.angular, 0.5 * *of.trackwidth, "rad", "turning");
  } else if (of.angular) {
    mode("Angular", *of.angular, 1.0, of.unit + " of a wheel", "turning");
  }
  if (of.trackwidth) {
    all.push_back({"trackwidth", *of.trackwidth, "m, as the robot turns"});
  }
  all.push_back({"kP", of.kP, "V·s/" + of.unit + ", of each side's velocity"});
  if (!of.follower) {
    return all;
  }
  using Kind = WpilibFollower::Kind;
  const WpilibFollower& follower = *of.follower;
  if (follower.kind == Kind::ramsete) {
    all.push_back({"b", follower.b, "rad²/m²"});
    all.push_back({"zeta", follower.zeta, "1/rad"});
    return all;
  }
  all.push_back({"xTolerance", follower.x_tolerance, "m"});
  all.push_back({"yTolerance", follower.y_tolerance, "m"});
  all.push_back({"headingTolerance", follower.heading_tolerance, "rad"});
  if (follower.kind == Kind::ltv_unicycle) {
    all.push_back({"velocityTolerance", follower.velocity_tolerance, "m/s"});
    all.push_back({"angularVelocityTolerance", follower.angular_velocity_tolerance, "rad/s"});
    all.push_back({"maxVelocity", follower.max_velocity, "m/s, of the gains' table"});
  } else {
    all.push_back({"velocityTolerance", follower.velocity_tolerance, "m/s, of a side"});
    all.push_back({"voltageTolerance", follower.voltage_tolerance, "V"});
  }
  return all;
}

/// What follows poses. @param whole  Whether there is a plant.
std::string follower_object(const DriveConstants& of, Language language, bool whole) {
  if (!of.follower) {
    return "";
  }
  using Kind = WpilibFollower::Kind;
  const bool cpp = language == Language::cpp;
  const bool python = language == Language::python;
  const std::string own = python ? "c." : "";
  const std::string period = literal(of.period, constant_digits);
  // A list of numbers, each with what stands before it.
  const auto list = [&](std::initializer_list<const char*> names) {
    std::string text;
    for (const char* name : names) {
      text += (text.empty() ? "" : ", ") + own + name;
    }
    return cpp ? "{" + text + "}" : python ? "(" + text + ")" : "VecBuilder.fill(" + text + ")";
  };
  const auto made = [&](const std::string& type, const std::string& arguments) {
    return cpp      ? fmt::format("// frc::{} follower{{{}}};\n", type, arguments)
           : python ? fmt::format("# follower = {}({})\n", type, arguments)
                    : fmt::format("// {0} follower = new {0}({1});\n", type, arguments);
  };
  const std::string next = python ? "\n#     " : "\n//     ";
  const auto with = [&](const char* name, const char* unit) {
    return cpp ? fmt::format("{} * {}", name, unit) : own + name;
  };
  const std::string each = cpp ? period + " * 1_s" : period;
  switch (of.follower->kind) {
    case Kind::ramsete:
      return made("RamseteController",
                  with("b", "1_rad * 1_rad / (1_m * 1_m)") + ", " + with("zeta", "1 / 1_rad"));
    case Kind::ltv_unicycle:
      return made("LTVUnicycleController",
                  next + list({"xTolerance", "yTolerance", "headingTolerance"}) + "," + next +
                      list({"velocityTolerance", "angularVelocityTolerance"}) + ", " + each + ", " +
                      with("maxVelocity", "1_mps"));
    case Kind::ltv_drive:
      break;
  }
  return whole ? made("LTVDifferentialDriveController",
                      next + "plant, " + with("trackwidth", "1_m") + "," + next +
                          list({"xTolerance", "yTolerance", "headingTolerance", "velocityTolerance",
                                "velocityTolerance"}) +
                          "," + next + list({"voltageTolerance", "voltageTolerance"}) + ", " + each)
               : "";
}

/// What takes both modes' gains in metres and radians.
std::string objects(const DriveConstants& of, Language language) {
  const bool cpp = language == Language::cpp;
  const std::string period = literal(of.period, constant_digits);
  const bool whole = of.unit == "m" && of.linear && of.angular && of.linear->kA > 0.0 &&
                     of.angular->kA > 0.0 && of.trackwidth;
  std::string text;
  if (whole && cpp) {
    text +=
        "// frc::LinearSystem<2, 2, 2> plant = frc::LinearSystemId::IdentifyDrivetrainSystem(\n"
        "//     kVLinear * 1_V / 1_mps, kALinear * 1_V / 1_mps_sq, kVAngular * 1_V / 1_rad_per_s,\n"
        "//     kAAngular * 1_V / 1_rad_per_s_sq, trackwidth * 1_m);\n"
        "// frc::DifferentialDriveFeedforward feedforward{\n"
        "//     kVLinear * 1_V / 1_mps, kALinear * 1_V / 1_mps_sq, kVAngular * 1_V / 1_rad_per_s,\n"
        "//     kAAngular * 1_V / 1_rad_per_s_sq, trackwidth * 1_m};\n";
  } else if (whole) {
    text +=
        "// LinearSystem<N2, N2, N2> plant = LinearSystemId.identifyDrivetrainSystem(\n"
        "//     kVLinear, kALinear, kVAngular, kAAngular, trackwidth);\n"
        "// DifferentialDriveFeedforward feedforward = new DifferentialDriveFeedforward(\n"
        "//     kVLinear, kALinear, kVAngular, kAAngular, trackwidth);\n";
  }
  if (of.trackwidth) {
    text += cpp ? "// frc::DifferentialDriveKinematics kinematics{trackwidth * 1_m};\n"
                : "// DifferentialDriveKinematics kinematics = "
                  "new DifferentialDriveKinematics(trackwidth);\n";
  }
  for (const char* side : {"left", "right"}) {
    text += cpp ? fmt::format("// frc::PIDController {}{{kP, 0.0, 0.0, {} * 1_s}};", side, period)
                : fmt::format("// PIDController {} = new PIDController(kP, 0.0, 0.0, {});", side,
                              period);
    text += "  // answers in volts\n";
  }
  return text + follower_object(of, language, whole);
}

/// The same for RobotPy.
std::string python_objects(const DriveConstants& of) {
  const bool whole = of.unit == "m" && of.linear && of.angular && of.linear->kA > 0.0 &&
                     of.angular->kA > 0.0 && of.trackwidth;
  using Kind = WpilibFollower::Kind;
  std::string text = fmt::format("# from wpimath.controller import PIDController{}\n",
                                 whole ? ", DifferentialDriveFeedforward" : "");
  if (of.follower && (whole || of.follower->kind != Kind::ltv_drive)) {
    text +=
        fmt::format("# from wpimath.controller import {}\n",
                    of.follower->kind == Kind::ramsete        ? "RamseteController"
                    : of.follower->kind == Kind::ltv_unicycle ? "LTVUnicycleController"
                                                              : "LTVDifferentialDriveController");
  }
  if (of.trackwidth) {
    text += "# from wpimath.kinematics import DifferentialDriveKinematics\n";
  }
  if (whole) {
    text += "# from wpimath.system.plant import LinearSystemId\n";
  }
  text += "# c = DrivetrainConstants\n";
  if (whole) {
    text +=
        "# plant = LinearSystemId.identifyDrivetrainSystem(\n"
        "#     c.kVLinear, c.kALinear, c.kVAngular, c.kAAngular, c.trackwidth)\n"
        "# feedforward = DifferentialDriveFeedforward(\n"
        "#     c.kVLinear, c.kALinear, c.kVAngular, c.kAAngular, c.trackwidth)\n";
  }
  if (of.trackwidth) {
    text += "# kinematics = DifferentialDriveKinematics(c.trackwidth)\n";
  }
  for (const char* side : {"left", "right"}) {
    text += fmt::format("# {} = PIDController(c.kP, 0.0, 0.0, {})  # answers in volts\n", side,
                        literal(of.period, constant_digits));
  }
  return text + follower_object(of, Language::python, whole);
}

}  // namespace

std::string wpilib_drive_constants(const DriveConstants& of, Language language) {
  const std::string name = "DrivetrainConstants";
  std::string text = comments(
      fmt::format(
          "// Drivetrain, for WPILib 2025.\n// Loop period {} ms; volts are at the motor.\n",
          format_number(1e3 * of.period, 4)),
      language);
  text += scope(name, constants_of(of), language) + "\n";
  if (language == Language::python) {
    return text + python_objects(of);
  }
  text += language == Language::cpp ? fmt::format("// using namespace {};\n", name) : "";
  return text + objects(of, language);
}

std::vector<PasteText> paste_drive_constants(const DriveConstants& of) {
  std::vector<PasteText> all;
  for (const Language language : languages) {
    all.push_back({fmt::format("WPILib, {}", name_of(language)), constants_file("wpilib", language),
                   wpilib_drive_constants(of, language)});
  }
  return all;
}

}  // namespace flyball::exports
