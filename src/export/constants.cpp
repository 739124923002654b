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

/// Per unit, of those of a robot's loop or of a motor controller's.
const UnitGains* gains_per(const std::vector<UnitGains>& all, std::string_view per) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const UnitGains& gains) { return gains.per == per; });
  return found == all.end() ? nullptr : &*found;
}

const std::vector<UnitGains>& on_board(const MechanismConstants& of) {
  return of.on_board.empty() ? of.gains : of.on_board;
}

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

std::string called(const MechanismConstants& of) {
  return of.name.empty() ? capitalized(of.kind) : of.name;
}

/// @param board  Of a loop on the motor controller.
std::string heading(const MechanismConstants& of, std::string_view library, bool board,
                    Language language) {
  const bool own = board && !of.on_board.empty();
  const double late_ms = 1e3 * of.delay;
  const std::string late = of.delay > 0.0
                               ? fmt::format(" and a measurement that is {} ms old",
                                             late_ms < 100.0 ? format_number(late_ms, 3)
                                                             : fmt::format("{:.0f}", late_ms))
                               : "";
  const std::string none = of.no_feedback.empty()
                               ? ""
                               : fmt::format("// There is no feedback, kP and kD are 0: {}.\n",
                                             comment_text(of.no_feedback));
  return comments(
      fmt::format("// {}, for {}.\n// Loop period {} ms{}{}; volts are at the motor.\n{}",
                  called(of), library, own ? "1" : format_number(1e3 * of.period, 4),
                  own ? ", on the controller" : "", late.empty() || !own ? late : "," + late, none),
      language);
}

std::string offset_note(const MechanismConstants& of, std::string_view how) {
  const double offset = of.angle_offset;
  if (of.kind != MechanismKind::arm || offset == 0.0) {
    return "";
  }
  return fmt::format("// The sensor's zero is {} rad ({} rotations) from horizontal: {}\n",
                     literal(offset, constant_digits),
                     literal(offset / (2.0 * std::numbers::pi), constant_digits), how);
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
  const std::string name = called(of) + "Constants";
  const std::string period = literal(of.period, constant_digits);
  const std::string unit_velocity = of.unit == "m" ? "1_mps" : "1_rad_per_s";
  const bool gravity = has_gravity(of.kind);
  const bool arm = of.kind == MechanismKind::arm;
  const std::string type = of.kind == MechanismKind::elevator ? "ElevatorFeedforward"
                           : arm                              ? "ArmFeedforward"
                                                              : "SimpleMotorFeedforward";
  std::string text =
      heading(of, "WPILib 2025", false, language) +
      comments(offset_note(of, "give ArmFeedforward the measured angle plus that."), language) +
      scope(name, constants_of(of, *gains, of.unit, "V·s/" + of.unit, "V·s²/" + of.unit),
            language) +
      "\n";
  switch (language) {
    case Language::cpp:
      text += fmt::format(
          "// using namespace {};\n"
          "// frc::{}{} feedforward{{kS * 1_V, {}kV * 1_V / {}, kA * 1_V / {}_sq}};\n"
          "// frc::PIDController feedback{{kP, 0.0, kD, {} * 1_s}};  // answers in volts\n",
          name, type,
          gravity          ? ""
          : of.unit == "m" ? "<units::meters>"
                           : "<units::radians>",
          gravity ? "kG * 1_V, " : "", unit_velocity, unit_velocity, period);
      return text +
             wrap_note(of, "feedback.EnableContinuousInput(-std::numbers::pi, std::numbers::pi);");
    case Language::java:
      text += fmt::format(
          "// {0} feedforward = new {0}(kS, {1}kV, kA, {2});\n"
          "// PIDController feedback = new PIDController(kP, 0.0, kD, {2});  // answers in volts\n",
          type, gravity ? "kG, " : "", period);
      return text + wrap_note(of, "feedback.enableContinuousInput(-Math.PI, Math.PI);");
    case Language::python:
      break;
  }
  const std::string python_type = type + (gravity ? "" : of.unit == "m" ? "Meters" : "Radians");
  text += fmt::format(
      "# from wpimath.controller import PIDController, {0}\n"
      "# c = {1}\n"
      "# feedforward = {0}(c.kS, {2}c.kV, c.kA{3})\n"
      "# feedback = PIDController(c.kP, 0.0, c.kD, {4})  # answers in volts\n",
      python_type, name, gravity ? "c.kG, " : "", arm ? "" : ", " + period, period);
  return text +
         comments(wrap_note(of, "feedback.enableContinuousInput(-math.pi, math.pi)"), language);
}

std::string phoenix_constants(const MechanismConstants& of, Language language) {
  const UnitGains* gains = gains_per(on_board(of), "rotation");
  if (gains == nullptr) {
    return "";
  }
  const bool cpp = language == Language::cpp;
  const bool python = language == Language::python;
  const bool arm = of.kind == MechanismKind::arm;
  std::vector<Constant> constants =
      constants_of(of, *gains, "rotation", "V·s/rotation", "V·s²/rotation");
  for (Constant& constant : constants) {
    const char which = constant.name.back();
    constant.name = python ? fmt::format(".with_k_{}", static_cast<char>(which - 'A' + 'a'))
                           : fmt::format(".{}ithK{}", cpp ? 'W' : 'w', which);
  }
  std::string notes = fmt::format(
      "// For voltage requests ({}).\n"
      "// Set {} to the gearing{}: one rotation is one of the {}.\n",
      controls_velocity(of.kind) ? "VelocityVoltage" : "PositionVoltage, MotionMagicVoltage",
      python ? "feedback.sensor_to_mechanism_ratio" : "Feedback.SensorToMechanismRatio",
      of.gearing != 1.0 ? " (" + format_number(of.gearing) + ")" : "",
      of.kind == MechanismKind::elevator       ? "drum"
      : of.kind == MechanismKind::swerve_drive ? "wheel"
                                               : "output");
  notes += wrap_note(of, python ? "config.closed_loop_general.continuous_wrap = True"
                                : "config.ClosedLoopGeneral.ContinuousWrap = true;");
  notes += offset_note(
      of, fmt::format("{}\n// needs 0 where the arm is horizontal, so set the sensor's offset "
                      "accordingly.",
                      python ? "ARM_COSINE" : "Arm_Cosine"));
  std::string text = heading(of, "CTRE Phoenix 6, per rotation of the mechanism", true, language) +
                     comments(std::move(notes), language);
  text += cpp      ? "ctre::phoenix6::configs::Slot0Configs slot0 =\n"
                     "    ctre::phoenix6::configs::Slot0Configs{}\n"
          : python ? "from phoenix6 import configs, signals\n\n"
                     "slot0 = (\n    configs.Slot0Configs()\n"
                   : "Slot0Configs slot0 = new Slot0Configs()\n";
  const std::string_view indent = python ? "    " : "        ";
  if (has_gravity(of.kind)) {
    text += python ? fmt::format("{}.with_gravity_type(signals.GravityTypeValue.{})\n", indent,
                                 arm ? "ARM_COSINE" : "ELEVATOR_STATIC")
                   : fmt::format(
                         "{}.{}ithGravityType({}{})\n", indent, cpp ? "W" : "w",
                         cpp ? "ctre::phoenix6::signals::GravityTypeValue::" : "GravityTypeValue.",
                         arm ? "Arm_Cosine" : "Elevator_Static");
  }
  text += assignments(constants, language, indent, "(", ")");
  if (python) {
    return text + ")\n";
  }
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
  const bool java = language == Language::java;
  const bool python = language == Language::python;
  const bool flywheel = controls_velocity(of.kind);
  const std::string name = called(of) + "SparkConstants";
  const std::string nominal = literal(of.nominal_voltage, constant_digits);

  std::string text = heading(of, "REVLib, per rotation and RPM of the mechanism", true, language);
  text += comments(
      fmt::format("// Set the encoder's position and velocity conversion factors to 1/gearing{}.\n",
                  of.gearing != 1.0 ? " = " + literal(1.0 / of.gearing, constant_digits) : "") +
          offset_note(of, "add it before the cosine."),
      language);
  text += scope(name, constants_of(of, *gains, "rotation", "V/RPM", "V/(RPM/s)"), language);
  // What is called with them, to be taken out of its comment.
  const std::string_view end = python ? "" : ";";
  const std::string own = python ? "c." : "";
  std::string calls =
      "// kS, kG, kV, kA are volts. ClosedLoopConfig takes P and D as a share of the full "
      "voltage:\n";
  calls += python ? fmt::format("//   c = {}\n", name) : "";
  calls += fmt::format("//   config.closedLoop.{}({}kP / {}){}  {} {} of the voltage per {}\n",
                       java ? "p" : "P", own, nominal, end, comment_mark(language),
                       literal(gains->kP / of.nominal_voltage, constant_digits),
                       flywheel ? "RPM" : "rotation");
  if (!flywheel) {
    calls += fmt::format(
        "//   config.closedLoop.{}({}kD * 60.0 / 0.001 / {}){}  {} {} per change of rotations in "
        "its 1 ms loop\n",
        java ? "d" : "D", own, nominal, end, comment_mark(language),
        literal(gains->kD * 60.0 / 0.001 / of.nominal_voltage, constant_digits));
  }
  calls +=
      wrap_note(of, language == Language::cpp ? "config.closedLoop.PositionWrappingEnabled(true)"
                                                ".PositionWrappingInputRange(0, 1);"
                    : java                    ? "config.closedLoop.positionWrappingEnabled(true)"
                                                ".positionWrappingInputRange(0, 1);"
                                              : "config.closedLoop.positionWrappingEnabled(True)"
                                                ".positionWrappingInputRange(0, 1)");
  const std::string gravity = of.kind == MechanismKind::arm        ? fmt::format(".kCos({}kG)", own)
                              : of.kind == MechanismKind::elevator ? fmt::format(".kG({}kG)", own)
                                                                   : "";
  calls += fmt::format(
      "// REVLib 2026 takes the feedforward in volts:\n"
      "//   config.closedLoop.feedForward.kS({0}kS).kV({0}kV).kA({0}kA){1}{2}\n"
      "// REVLib 2025 has only velocityFF, a share per RPM, for velocity control:\n"
      "//   config.closedLoop.{3}({0}kV / {4}){2}{5}\n",
      own, gravity, end, language == Language::cpp ? "VelocityFF" : "velocityFF", nominal,
      flywheel
          ? ""
          : fmt::format("  {} or pass volts as arbitrary feedforward", comment_mark(language)));
  return text + "\n" + comments(std::move(calls), language);
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
    for (const Language language : languages) {
      std::string text = library.text(of, language);
      if (!text.empty()) {
        all.push_back({fmt::format("{}, {}", library.title, name_of(language)),
                       constants_file(library.file, language), std::move(text)});
      }
    }
  }
  return all;
}

}  // namespace flyball::exports
