#include <flyball/export/drive_constants.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

constexpr int digits = 6;

struct Constant {
  std::string name;
  double value;
  std::string comment;
};

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
  return all;
}

std::string assignments(const std::vector<Constant>& constants, std::string_view prefix) {
  std::size_t width = 0;
  for (const Constant& constant : constants) {
    width = std::max(width, constant.name.size() + literal(constant.value, digits).size());
  }
  std::string text;
  for (const Constant& constant : constants) {
    const std::string value = literal(constant.value, digits);
    text += fmt::format("{}{} = {};{:{}}  // {}\n", prefix, constant.name, value, "",
                        width - constant.name.size() - value.size(), constant.comment);
  }
  return text;
}

/// What takes both modes' gains in metres and radians.
std::string objects(const DriveConstants& of, bool cpp) {
  const std::string period = literal(of.period, digits);
  std::string text;
  const bool whole = of.unit == "m" && of.linear && of.angular && of.linear->kA > 0.0 &&
                     of.angular->kA > 0.0 && of.trackwidth;
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
  return text;
}

}  // namespace

std::string wpilib_drive_constants(const DriveConstants& of, Language language) {
  const bool cpp = language == Language::cpp;
  std::string text = fmt::format(
      "// Drivetrain, for WPILib 2025.\n// Loop period {} ms; volts are at "
      "the motor.\n",
      format_number(1e3 * of.period, 4));
  const std::vector<Constant> constants = constants_of(of);
  if (cpp) {
    text += "namespace DrivetrainConstants {\n" +
            assignments(constants, "inline constexpr double ") +
            "}  // namespace DrivetrainConstants\n\n// using namespace DrivetrainConstants;\n";
  } else {
    text += "public final class DrivetrainConstants {\n" +
            assignments(constants, "  public static final double ") +
            "\n  private DrivetrainConstants() {}\n}\n\n";
  }
  return text + objects(of, cpp);
}

std::vector<PasteText> paste_drive_constants(const DriveConstants& of) {
  return {
      {"WPILib, C++", "constants/wpilib_cpp.txt", wpilib_drive_constants(of, Language::cpp)},
      {"WPILib, Java", "constants/wpilib_java.txt", wpilib_drive_constants(of, Language::java)}};
}

}  // namespace flyball::exports
