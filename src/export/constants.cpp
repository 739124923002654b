#include <flyball/export/constants.hpp>

#include <algorithm>
#include <array>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "export/text.hpp"

namespace flyball::exports {

namespace {

using mechanisms::MechanismKind;

/// Finer than any gain is known.
constexpr int digits = 6;

/// Per unit, of those of a robot's loop or of a motor controller's.
const UnitGains* gains_per(const std::vector<UnitGains>& all, std::string_view per) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const UnitGains& gains) { return gains.per == per; });
  return found == all.end() ? nullptr : &*found;
}

const std::vector<UnitGains>& on_board(const MechanismConstants& of) {
  return of.on_board.empty() ? of.gains : of.on_board;
}

struct Constant {
  std::string name;
  double value = 0.0;
  std::string comment;  ///< Unit first.
};

std::string kA_comment(const MechanismConstants& of, const UnitGains& gains,
                       std::string_view unit) {
  if (of.kA_determined) {
    return std::string(unit);
  }
  // The bound per another unit scales as kV does.
  const UnitGains* own = gains_per(of.gains, of.unit);
  const double scale = own != nullptr && own->kV > 0.0 ? gains.kV / own->kV : 1.0;
  return fmt::format("{}; not determined, below {}{}{}", unit,
                     format_number(of.kA_upper_bound * scale, 3), of.kA_reason.empty() ? "" : ": ",
                     comment_text(of.kA_reason));
}

/// The gains of one unit as constants, each with its unit.
std::vector<Constant> constants_of(const MechanismConstants& of, const UnitGains& gains,
                                   const std::string& position, const std::string& per_velocity,
                                   const std::string& per_acceleration) {
  const MechanismKind kind = of.kind;
  const bool flywheel = controls_velocity(kind);
  std::vector<Constant> all{{"kS", gains.kS, "V, static friction"}};
  if (has_gravity(kind)) {
    all.push_back(
        {"kG", gains.kG,
         kind == MechanismKind::arm ? "V, gravity with the arm horizontal" : "V, gravity"});
  }
  all.push_back({"kV", gains.kV, per_velocity});
  all.push_back({"kA", gains.kA, kA_comment(of, gains, per_acceleration)});
  all.push_back({"kP", gains.kP, flywheel ? per_velocity : "V/" + position});
  all.push_back({"kD", gains.kD, flywheel ? per_acceleration : per_velocity});
  return all;
}

/// "prefix NAME = VALUE;  // comment" in aligned columns.
std::string assignments(const std::vector<Constant>& constants, std::string_view prefix,
                        std::string_view assign = " = ", std::string_view end = ";") {
  std::size_t width = 0;
  for (const Constant& constant : constants) {
    width = std::max(width, constant.name.size() + literal(constant.value, digits).size());
  }
  std::string text;
  for (const Constant& constant : constants) {
    const std::string value = literal(constant.value, digits);
    text += fmt::format("{}{}{}{}{}{:{}}  // {}\n", prefix, constant.name, assign, value, end, "",
                        width - constant.name.size() - value.size(), constant.comment);
  }
  return text;
}

/// @param board  Of a loop on the motor controller.
std::string heading(const MechanismConstants& of, std::string_view library, bool board) {
  const bool own = board && !of.on_board.empty();
  const std::string late = of.delay > 0.0 ? fmt::format(" and a measurement that is {} ms old",
                                                        format_number(1e3 * of.delay, 3))
                                          : "";
  return fmt::format("// {}, for {}.\n// Loop period {} ms{}{}; volts are at the motor.\n",
                     capitalized(of.kind), library, own ? "1" : format_number(1e3 * of.period, 4),
                     own ? ", on the controller," : "", late);
}

std::string offset_note(const MechanismConstants& of, std::string_view how) {
  const double offset = of.angle_offset;
  if (of.kind != MechanismKind::arm || offset == 0.0) {
    return "";
  }
  return fmt::format("// The sensor's zero is {} rad ({} rotations) from horizontal: {}\n",
                     literal(offset, digits), literal(offset / (2.0 * std::numbers::pi), digits),
                     how);
}

/// How a loop is told that it may turn the shorter way.
std::string wrap_note(const MechanismConstants& of, std::string_view how) {
  return turns_endlessly(of.kind)
             ? fmt::format(
                   "// It may turn the shorter way{}:\n//   {}\n",
                   of.kind == MechanismKind::turret ? ", unless a cable or a stop forbids it" : "",
                   how)
             : "";
}

}  // namespace

std::string wpilib_constants(const MechanismConstants& of, Language language) {
  const UnitGains* gains = gains_per(of.gains, of.unit);
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const std::string name = capitalized(of.kind) + "Constants";
  const std::vector<Constant> constants =
      constants_of(of, *gains, of.unit, "V·s/" + of.unit, "V·s²/" + of.unit);
  const double period = of.period;
  const std::string unit_velocity = of.unit == "m" ? "1_mps" : "1_rad_per_s";
  const bool gravity = has_gravity(of.kind);
  const std::string type = of.kind == MechanismKind::elevator ? "ElevatorFeedforward"
                           : of.kind == MechanismKind::arm    ? "ArmFeedforward"
                                                              : "SimpleMotorFeedforward";
  std::string text = heading(of, "WPILib 2025", false) +
                     offset_note(of, "give ArmFeedforward the measured angle plus that.");
  if (cpp) {
    text += fmt::format("namespace {} {{\n", name);
    text += assignments(constants, "inline constexpr double ");
    text += fmt::format("}}  // namespace {}\n\n// using namespace {};\n", name, name);
    text += fmt::format(
        "// frc::{}{} feedforward{{kS * 1_V, {}kV * 1_V / {}, kA * 1_V / {}_sq}};\n", type,
        gravity          ? ""
        : of.unit == "m" ? "<units::meters>"
                         : "<units::radians>",
        gravity ? "kG * 1_V, " : "", unit_velocity, unit_velocity);
    text += fmt::format(
        "// frc::PIDController feedback{{kP, 0.0, kD, {} * 1_s}};  // answers in volts\n",
        literal(period, digits));
  } else {
    text += fmt::format("public final class {} {{\n", name);
    text += assignments(constants, "  public static final double ");
    text += fmt::format("\n  private {}() {{}}\n}}\n\n", name);
    text += fmt::format("// {0} feedforward = new {0}(kS, {1}kV, kA, {2});\n", type,
                        gravity ? "kG, " : "", literal(period, digits));
    text += fmt::format(
        "// PIDController feedback = new PIDController(kP, 0.0, kD, {});  // answers in volts\n",
        literal(period, digits));
  }
  text += wrap_note(of, cpp ? "feedback.EnableContinuousInput(-std::numbers::pi, std::numbers::pi);"
                            : "feedback.enableContinuousInput(-Math.PI, Math.PI);");
  return text;
}

std::string phoenix_constants(const MechanismConstants& of, Language language) {
  const UnitGains* gains = gains_per(on_board(of), "rotation");
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const bool flywheel = controls_velocity(of.kind);
  std::vector<Constant> constants =
      constants_of(of, *gains, "rotation", "V·s/rotation", "V·s²/rotation");
  for (Constant& constant : constants) {
    constant.name = (cpp ? ".WithK" : ".withK") + constant.name.substr(1);
  }
  std::string text = heading(of, "CTRE Phoenix 6, per rotation of the mechanism", true);
  text += fmt::format(
      "// For voltage requests ({}).\n"
      "// Set Feedback.SensorToMechanismRatio to the gearing{}: one rotation is one of the {}.\n",
      flywheel ? "VelocityVoltage" : "PositionVoltage, MotionMagicVoltage",
      of.gearing != 1.0 ? " (" + format_number(of.gearing) + ")" : "",
      of.kind == MechanismKind::elevator       ? "drum"
      : of.kind == MechanismKind::swerve_drive ? "wheel"
                                               : "output");
  text += wrap_note(of, "config.ClosedLoopGeneral.ContinuousWrap = true;");
  text += offset_note(of,
                      "Arm_Cosine\n// needs 0 where the arm is horizontal, so set the sensor's "
                      "offset accordingly.");
  text += cpp ? "ctre::phoenix6::configs::Slot0Configs slot0 =\n"
                "    ctre::phoenix6::configs::Slot0Configs{}\n"
              : "Slot0Configs slot0 = new Slot0Configs()\n";
  if (has_gravity(of.kind)) {
    const std::string scope =
        cpp ? "ctre::phoenix6::signals::GravityTypeValue::" : "GravityTypeValue.";
    text += fmt::format("        .{}ithGravityType({}{})\n", cpp ? "W" : "w", scope,
                        of.kind == MechanismKind::arm ? "Arm_Cosine" : "Elevator_Static");
  }
  text += assignments(constants, "        ", "(", ")");
  // The semicolon belongs to the last call, before its comment.
  const std::size_t last = text.rfind(')', text.rfind("  //"));
  text.insert(last + 1, ";");
  return text;
}

std::string rev_constants(const MechanismConstants& of, Language language) {
  const UnitGains* gains = gains_per(on_board(of), "RPM");
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const bool flywheel = controls_velocity(of.kind);
  const std::string name = capitalized(of.kind) + "SparkConstants";
  const std::vector<Constant> constants =
      constants_of(of, *gains, "rotation", "V/RPM", "V/(RPM/s)");
  const std::string nominal = literal(of.nominal_voltage, digits);

  std::string text = heading(of, "REVLib, per rotation and RPM of the mechanism", true);
  text +=
      fmt::format("// Set the encoder's position and velocity conversion factors to 1/gearing{}.\n",
                  of.gearing != 1.0 ? " = " + literal(1.0 / of.gearing, digits) : "");
  text += offset_note(of, "add it before the cosine.");
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
  text +=
      fmt::format("//   {}(kP / {});  // {} of the voltage per {}\n", call, nominal,
                  literal(gains->kP / of.nominal_voltage, digits), flywheel ? "RPM" : "rotation");
  if (!flywheel) {
    text +=
        fmt::format("//   {}(kD * 60.0 / 0.001 / {});{}\n",
                    cpp ? "config.closedLoop.D" : "config.closedLoop.d", nominal,
                    fmt::format("  // {} per change of rotations in its 1 ms loop",
                                literal(gains->kD * 60.0 / 0.001 / of.nominal_voltage, digits)));
  }
  text += wrap_note(of, cpp ? "config.closedLoop.PositionWrappingEnabled(true)"
                              ".PositionWrappingInputRange(0, 1);"
                            : "config.closedLoop.positionWrappingEnabled(true)"
                              ".positionWrappingInputRange(0, 1);");
  const std::string gravity = of.kind == MechanismKind::arm        ? ".kCos(kG)"
                              : of.kind == MechanismKind::elevator ? ".kG(kG)"
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

std::vector<PasteText> paste_constants(const MechanismConstants& of) {
  struct Library {
    std::string title;
    std::string file;
    std::string (*text)(const MechanismConstants&, Language);
  };
  const std::array libraries{
      Library{"WPILib", "wpilib", &wpilib_constants},
      Library{"CTRE Phoenix 6 (per rotation)", "phoenix6", &phoenix_constants},
      Library{"REVLib (per RPM)", "revlib", &rev_constants}};
  std::vector<PasteText> all;
  for (const Library& library : libraries) {
    for (const Language language : {Language::cpp, Language::java}) {
      const bool cpp = language == Language::cpp;
      std::string text = library.text(of, language);
      if (!text.empty()) {
        all.push_back({library.title + (cpp ? ", C++" : ", Java"),
                       fmt::format("constants/{}_{}.txt", library.file, cpp ? "cpp" : "java"),
                       std::move(text)});
      }
    }
  }
  return all;
}

}  // namespace flyball::exports
