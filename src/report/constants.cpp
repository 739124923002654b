#include <flyball/report/constants.hpp>

#include <algorithm>
#include <array>
#include <numbers>

#include <fmt/format.h>

#include "report/format.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

using mechanisms::MechanismKind;
using study::DesignResult;
using study::PasteGains;

const PasteGains* gains_per(const DesignResult& design, std::string_view per) {
  const auto found = std::find_if(design.paste.begin(), design.paste.end(),
                                  [&](const PasteGains& gains) { return gains.per == per; });
  return found == design.paste.end() ? nullptr : &*found;
}

/// Six significant digits: finer than any gain is known, with a decimal point for both languages.
std::string literal(double value) {
  std::string text = fmt::format("{:.6g}", value);
  if (text.find_first_of(".en") == std::string::npos) {
    text += ".0";
  }
  return text;
}

struct Constant {
  std::string name;
  double value = 0.0;
  std::string comment;  ///< Unit first.
};

/// One line for a comment: a log's reason must not end it.
std::string comment_text(std::string_view text) {
  std::string line = printable(text);
  std::replace(line.begin(), line.end(), '\n', ' ');
  for (std::size_t at = 0; (at = line.find('\\', at)) != std::string::npos;) {
    line[at] = '/';  // a backslash at the end of a comment would continue it
  }
  return line;
}

std::string kA_comment(const DesignResult& design, const PasteGains& gains, std::string_view unit,
                       std::string_view reason) {
  const study::PlantDescription& plant = design.job.plant;
  if (plant.kA_determined) {
    return std::string(unit);
  }
  // The bound per another unit scales as kV does.
  const double scale = plant.gains.kV > 0.0 ? gains.kV / plant.gains.kV : 1.0;
  std::string text =
      fmt::format("{}; not determined, below {}", unit, number(plant.kA_upper_bound * scale, 3));
  if (!reason.empty()) {
    text += fmt::format(": {}", comment_text(reason));
  }
  return text;
}

/// The gains of one unit as constants, each with its unit.
std::vector<Constant> constants_of(const DesignResult& design, const PasteGains& gains,
                                   const std::string& position, const std::string& per_velocity,
                                   const std::string& per_acceleration, std::string_view reason) {
  const MechanismKind kind = design.job.plant.kind;
  const bool flywheel = kind == MechanismKind::flywheel;
  std::vector<Constant> all{{"kS", gains.kS, "V, static friction"}};
  if (!flywheel) {
    all.push_back(
        {"kG", gains.kG,
         kind == MechanismKind::arm ? "V, gravity with the arm horizontal" : "V, gravity"});
  }
  all.push_back({"kV", gains.kV, per_velocity});
  all.push_back({"kA", gains.kA, kA_comment(design, gains, per_acceleration, reason)});
  all.push_back({"kP", gains.kP, flywheel ? per_velocity : "V/" + position});
  all.push_back({"kD", gains.kD, flywheel ? per_acceleration : per_velocity});
  return all;
}

/// "prefix NAME = VALUE;  // comment" in aligned columns.
std::string assignments(const std::vector<Constant>& constants, std::string_view prefix,
                        std::string_view assign = " = ", std::string_view end = ";") {
  std::size_t width = 0;
  for (const Constant& constant : constants) {
    width = std::max(width, constant.name.size() + literal(constant.value).size());
  }
  std::string text;
  for (const Constant& constant : constants) {
    const std::string value = literal(constant.value);
    text += fmt::format("{}{}{}{}{}{:{}}  // {}\n", prefix, constant.name, assign, value, end, "",
                        width - constant.name.size() - value.size(), constant.comment);
  }
  return text;
}

std::string heading(const DesignResult& design, std::string_view library) {
  return fmt::format("// {}, for {}.\n// Loop period {}; volts are at the motor.\n",
                     capitalized(design.job.plant.kind), library,
                     seconds(design.job.controller.period));
}

std::string offset_note(const DesignResult& design, std::string_view how) {
  const double offset = design.job.plant.gains.angle_offset;
  if (design.job.plant.kind != MechanismKind::arm || offset == 0.0) {
    return "";
  }
  return fmt::format("// The sensor's zero is {} rad ({} rotations) from horizontal: {}\n",
                     literal(offset), literal(offset / (2.0 * std::numbers::pi)), how);
}

}  // namespace

std::string wpilib_constants(const DesignResult& design, Language language,
                             std::string_view kA_reason) {
  const study::PlantDescription& plant = design.job.plant;
  const PasteGains* gains = gains_per(design, plant.unit);
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const std::string name = capitalized(plant.kind) + "Constants";
  const std::vector<Constant> constants = constants_of(
      design, *gains, plant.unit, "V·s/" + plant.unit, "V·s²/" + plant.unit, kA_reason);
  const double period = design.job.controller.period;
  const std::string unit_velocity = plant.unit == "m" ? "1_mps" : "1_rad_per_s";
  const bool flywheel = plant.kind == MechanismKind::flywheel;
  const std::string type = flywheel                                ? "SimpleMotorFeedforward"
                           : plant.kind == MechanismKind::elevator ? "ElevatorFeedforward"
                                                                   : "ArmFeedforward";
  std::string text = heading(design, "WPILib 2025") +
                     offset_note(design, "give ArmFeedforward the measured angle plus that.");
  if (cpp) {
    text += fmt::format("namespace {} {{\n", name);
    text += assignments(constants, "inline constexpr double ");
    text += fmt::format("}}  // namespace {}\n\n// using namespace {};\n", name, name);
    text +=
        fmt::format("// frc::{}{} feedforward{{kS * 1_V, {}kV * 1_V / {}, kA * 1_V / {}_sq}};\n",
                    type, flywheel ? "<units::radians>" : "", flywheel ? "" : "kG * 1_V, ",
                    unit_velocity, unit_velocity);
    text += fmt::format(
        "// frc::PIDController feedback{{kP, 0.0, kD, {} * 1_s}};  // answers in volts\n",
        literal(period));
  } else {
    text += fmt::format("public final class {} {{\n", name);
    text += assignments(constants, "  public static final double ");
    text += fmt::format("\n  private {}() {{}}\n}}\n\n", name);
    text += fmt::format("// {0} feedforward = new {0}(kS, {1}kV, kA, {2});\n", type,
                        flywheel ? "" : "kG, ", literal(period));
    text += fmt::format(
        "// PIDController feedback = new PIDController(kP, 0.0, kD, {});  // answers in volts\n",
        literal(period));
  }
  return text;
}

std::string phoenix_constants(const DesignResult& design, Language language,
                              std::string_view kA_reason) {
  const study::PlantDescription& plant = design.job.plant;
  const PasteGains* gains = gains_per(design, "rotation");
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const bool flywheel = plant.kind == MechanismKind::flywheel;
  std::vector<Constant> constants =
      constants_of(design, *gains, "rotation", "V·s/rotation", "V·s²/rotation", kA_reason);
  for (Constant& constant : constants) {
    constant.name = (cpp ? ".WithK" : ".withK") + constant.name.substr(1);
  }
  std::string text = heading(design, "CTRE Phoenix 6, per rotation of the mechanism");
  text += fmt::format(
      "// For voltage requests ({}).\n"
      "// Set Feedback.SensorToMechanismRatio to the gearing{}: one rotation is one of the {}.\n",
      flywheel ? "VelocityVoltage" : "PositionVoltage, MotionMagicVoltage",
      plant.gearing != 1.0 ? " (" + number(plant.gearing) + ")" : "",
      plant.kind == MechanismKind::elevator ? "drum" : "output");
  text += offset_note(design,
                      "Arm_Cosine\n// needs 0 where the arm is horizontal, so set the sensor's "
                      "offset accordingly.");
  text += cpp ? "ctre::phoenix6::configs::Slot0Configs slot0 =\n"
                "    ctre::phoenix6::configs::Slot0Configs{}\n"
              : "Slot0Configs slot0 = new Slot0Configs()\n";
  if (!flywheel) {
    const std::string scope =
        cpp ? "ctre::phoenix6::signals::GravityTypeValue::" : "GravityTypeValue.";
    text += fmt::format("        .{}ithGravityType({}{})\n", cpp ? "W" : "w", scope,
                        plant.kind == MechanismKind::arm ? "Arm_Cosine" : "Elevator_Static");
  }
  text += assignments(constants, "        ", "(", ")");
  // The semicolon belongs to the last call, before its comment.
  const std::size_t last = text.rfind(')', text.rfind("  //"));
  text.insert(last + 1, ";");
  return text;
}

std::string rev_constants(const DesignResult& design, Language language,
                          std::string_view kA_reason) {
  const study::PlantDescription& plant = design.job.plant;
  const PasteGains* gains = gains_per(design, "RPM");
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const bool flywheel = plant.kind == MechanismKind::flywheel;
  const std::string name = capitalized(plant.kind) + "SparkConstants";
  const std::vector<Constant> constants =
      constants_of(design, *gains, "rotation", "V/RPM", "V/(RPM/s)", kA_reason);
  const std::string nominal = literal(plant.nominal_voltage);

  std::string text = heading(design, "REVLib, per rotation and RPM of the mechanism");
  text +=
      fmt::format("// Set the encoder's position and velocity conversion factors to 1/gearing{}.\n",
                  plant.gearing != 1.0 ? " = " + literal(1.0 / plant.gearing) : "");
  text += offset_note(design, "add it before the cosine.");
  if (cpp) {
    text += fmt::format("namespace {} {{\n", name);
    text += assignments(constants, "inline constexpr double ");
    text += fmt::format("}}  // namespace {}\n", name);
  } else {
    text += fmt::format("public final class {} {{\n", name);
    text += assignments(constants, "  public static final double ");
    text += fmt::format("\n  private {}() {{}}\n}}\n", name);
  }
  text +=
      "\n// kS, kG, kV, kA are volts. ClosedLoopConfig takes P and D as a share of the full "
      "voltage:\n";
  const std::string call = cpp ? "config.closedLoop.P" : "config.closedLoop.p";
  text += fmt::format("//   {}(kP / {});\n", call, nominal);
  if (!flywheel) {
    text += fmt::format("//   {}(kD * 60.0 / 0.001 / {});{}\n",
                        cpp ? "config.closedLoop.D" : "config.closedLoop.d", nominal,
                        "  // per change of rotations in a SPARK's 1 ms loop");
  }
  const std::string gravity = plant.kind == MechanismKind::arm        ? ".kCos(kG)"
                              : plant.kind == MechanismKind::elevator ? ".kG(kG)"
                                                                      : "";
  text += fmt::format(
      "// REVLib 2026 takes the feedforward in volts:\n"
      "//   config.closedLoop.feedForward.kS(kS).kV(kV).kA(kA){};\n"
      "// REVLib 2025 has only velocityFF, a share per RPM, for velocity control:\n"
      "//   config.closedLoop.{}(kV / {});{}\n",
      gravity, cpp ? "VelocityFF" : "velocityFF", nominal,
      flywheel ? "" : "  // or pass volts as arbitrary feedforward");
  return text;
}

std::vector<PasteText> paste_constants(const DesignResult& design, std::string_view kA_reason) {
  struct Library {
    std::string title;
    std::string file;
    std::string (*text)(const DesignResult&, Language, std::string_view);
  };
  const std::array libraries{
      Library{"WPILib", "wpilib", &wpilib_constants},
      Library{"CTRE Phoenix 6 (per rotation)", "phoenix6", &phoenix_constants},
      Library{"REVLib (per RPM)", "revlib", &rev_constants}};
  std::vector<PasteText> all;
  for (const Library& library : libraries) {
    for (const Language language : {Language::cpp, Language::java}) {
      const bool cpp = language == Language::cpp;
      std::string text = library.text(design, language, kA_reason);
      if (!text.empty()) {
        all.push_back({library.title + (cpp ? ", C++" : ", Java"),
                       fmt::format("constants/{}_{}.txt", library.file, cpp ? "cpp" : "java"),
                       std::move(text)});
      }
    }
  }
  return all;
}

}  // namespace flyball::report
