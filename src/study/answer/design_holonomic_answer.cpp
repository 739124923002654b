// The follower of a swerve or a mecanum drive, as people, programs and other tools take it.
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/holonomic_follower.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/design_holonomic.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using text::number;

constexpr const char* design_holonomic_schema = "flyball.design_holonomic/1";

bool is_swerve(const HolonomicDesign& design) {
  return design.job.robot.kind == DriveKind::swerve;
}

/// Of both loops for motor controllers, per turn.
std::vector<exports::PasteText> controllers_of(const HolonomicDesign& design) {
  const DriveRobot& robot = design.job.robot;
  exports::MechanismConstants wheel{.kind = mechanisms::MechanismKind::swerve_drive,
                                    .name = "Drive",
                                    .unit = "m",
                                    .period = design.job.period,
                                    .nominal_voltage = robot.motor.nominal_voltage,
                                    .gearing = robot.gearing};
  const double turn = 2.0 * std::numbers::pi * robot.wheel_radius;
  for (const auto& [per, scale] : {std::pair{"rotation", turn}, std::pair{"RPM", turn / 60.0}}) {
    wheel.gains.push_back({.per = per,
                           .kP = scale * design.kP,
                           .kS = design.kS,
                           .kV = scale * design.kV,
                           .kA = scale * design.kA});
  }
  std::vector<exports::PasteText> all = exports::paste_constants(wheel);
  if (!is_swerve(design)) {
    return all;
  }
  exports::MechanismConstants steer{.kind = mechanisms::MechanismKind::swerve_steer,
                                    .name = "Steer",
                                    .unit = "rad",
                                    .period = design.job.period,
                                    .nominal_voltage = robot.steer_motor.nominal_voltage,
                                    .gearing = robot.steer_gearing};
  const double round = 2.0 * std::numbers::pi;
  // Of a speed in turns a minute for kD, kV and kA, while the position stays in turns.
  for (const auto& [per, scale] : {std::pair{"rotation", round}, std::pair{"RPM", round / 60.0}}) {
    steer.gains.push_back({.per = per,
                           .kP = round * design.steer(0),
                           .kD = scale * design.steer(1),
                           .kV = scale * design.steer_kV,
                           .kA = scale * design.steer_kA});
  }
  for (exports::PasteText& paste : exports::paste_constants(steer)) {
    constexpr std::string_view folder = "constants/";
    paste.title += ", of the steering";
    paste.file = fmt::format("{}steer_{}", folder, paste.file.substr(folder.size()));
    all.push_back(std::move(paste));
  }
  return all;
}

std::vector<exports::PasteText> constants_of(const HolonomicDesign& design) {
  const DriveRobot& robot = design.job.robot;
  std::vector<exports::PasteText> all = exports::paste_holonomic_constants(
      {.swerve = is_swerve(design),
       .period = design.job.period,
       .modules = robot.modules,
       .kS = design.kS,
       .kV = design.kV,
       .kA = design.kA,
       .kP = design.kP,
       .steer_kP = design.steer(0),
       .steer_kD = design.steer(1),
       .gains = design.gains,
       .max_velocity = robot.free_speed(design.job.max_voltage)});
  append(all, controllers_of(design));
  return all;
}

Section robot_section(const HolonomicDesign& design) {
  const DriveRobot& robot = design.job.robot;
  Facts facts;
  facts.add("motors", fmt::format("{} {}, geared {}", 4 * robot.motor.count, robot.motor.name,
                                  number(robot.gearing)));
  facts.add("robot",
            fmt::format("{} kg, {} kg·m²", number(robot.mass), number(robot.moment_of_inertia)));
  facts.add("wheels", fmt::format("{} m radius, {} m/s without load", number(robot.wheel_radius),
                                  number(robot.free_speed(design.job.max_voltage), 3)));
  facts.add("a wheel", fmt::format("kS {} V, kV {} V·s/m, kA {} V·s²/m", number(design.kS, 3),
                                   number(design.kV, 4), number(design.kA, 4)));
  if (is_swerve(design)) {
    facts.add("a module's steering",
              fmt::format("{}, geared {}; kV {} V·s/rad, kA {} V·s²/rad", robot.steer_motor.name,
                          number(robot.steer_gearing), number(design.steer_kV, 4),
                          number(design.steer_kA, 4)));
  }
  return {"robot", "Drivetrain", {std::move(facts)}};
}

Section loops_section(const HolonomicDesign& design) {
  Facts facts;
  const std::string each = text::seconds(design.job.period);
  facts.add("kP of a wheel's speed", quantity(design.kP, "V·s/m"));
  facts.add("its pole",
            fmt::format("{} with a quarter of the robot, {} where the floor does not "
                        "hold the wheel, each {}",
                        number(design.pole, 3), number(design.spinning_pole, 3), each),
            design.spinning_pole <= -1.0 ? Tone::caution : Tone::plain);
  facts.add("tolerance of a wheel's speed", quantity(design.job.velocity_tolerance, "m/s"));
  if (is_swerve(design)) {
    facts.add("kP of a module's direction", quantity(design.steer(0), "V/rad"));
    facts.add("kD of it", quantity(design.steer(1), "V·s/rad"));
    const auto& pole = design.steer_poles(0);
    facts.add("its poles", std::abs(pole.imag()) > 0.0
                               ? fmt::format("{} ± {}i", number(pole.real(), 3),
                                             number(std::abs(pole.imag()), 3))
                               : fmt::format("{}, {}", number(pole.real(), 3),
                                             number(design.steer_poles(1).real(), 3)));
  }
  return {"loops",
          is_swerve(design) ? "Loops of wheels and modules" : "Loop of a wheel",
          {std::move(facts)}};
}

Section follower_section(const HolonomicDesign& design) {
  const DriveJob& job = design.job;
  Facts facts;
  facts.add("law", fmt::format("holonomic, each {}", text::seconds(job.period)));
  facts.add("gains", fmt::format("x {} 1/s, y {} 1/s, heading {} 1/s", number(design.gains(0), 4),
                                 number(design.gains(1), 4), number(design.gains(2), 4)));
  facts.add("tolerances", fmt::format("{} m, {} m, {} rad", number(job.x_tolerance),
                                      number(job.y_tolerance), number(job.heading_tolerance)));
  facts.add("in C++17", "follower.hpp, with --out");
  Section section{"follower", "Follower", {std::move(facts)}};
  section.blocks.emplace_back(
      Paragraph{is_swerve(design)
                    ? "Each module takes the shorter turn, and pushes only as far as it points "
                      "where it should; one factor for all wheels keeps them within their speed."
                    : "Each wheel's speed is that of the inverse kinematics."});
  return section;
}

/// A step of each loop, period by period.
Figure steps_figure(const HolonomicDesign& design) {
  Figure figure{"loops",
                "steps",
                "Steps of the loops",
                "A wheel's speed from rest to 1 m/s by feedback alone, beside what feedforward "
                "asks, with its share of the robot and where it spins freely.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  const int periods = std::clamp(static_cast<int>(0.5 / design.job.period), 10, 200);
  const auto wheel = [&](const char* name, double A, double B, int color) {
    PlotLine line{.label = name, .style = LineStyle::steps, .color = color};
    double error = 1.0;
    for (int k = 0; k <= periods; ++k) {
      line.x.push_back(k * design.job.period);
      line.y.push_back(1.0 - error);
      error *= A - B * design.kP;
    }
    return line;
  };
  figure.plot.panels = {
      panel({"Wheel", "m/s"},
            {wheel("with its share", design.A, design.B, measured_color),
             wheel("spinning", design.spinning_A, design.spinning_B, simulated_color)})};
  if (is_swerve(design)) {
    figure.description += " A module's direction, from a quarter turn off.";
    PlotLine turn{.style = LineStyle::steps, .color = voltage_color};
    Eigen::Vector2d x(0.5 * std::numbers::pi, 0.0);
    for (int k = 0; k <= periods; ++k) {
      turn.x.push_back(k * design.job.period);
      turn.y.push_back(90.0 - x(0) / std::numbers::pi * 180.0);
      const double u =
          std::clamp(-design.steer.dot(x), -design.job.max_voltage, design.job.max_voltage);
      x = design.steer_A * x + design.steer_B * u;
    }
    figure.plot.panels.push_back(panel({"Direction", "°"}, {std::move(turn)}));
  }
  return figure;
}

}  // namespace

std::string to_json(const HolonomicDesign& design) {
  const DriveJob& job = design.job;
  const DriveRobot& robot = job.robot;
  JsonWriter json;
  json.object([&] {
    json.add("schema", design_holonomic_schema);
    json.add("drivetrain", to_string(robot.kind));
    json.add("follower", to_string(job.follower));
    json.add("motor", robot.motor.name);
    json.add("motor_count", robot.motor.count);
    json.add({{"mass", robot.mass},
              {"moment_of_inertia", robot.moment_of_inertia},
              {"gearing", robot.gearing},
              {"wheel_radius", robot.wheel_radius},
              {"wheel_speed", robot.free_speed(job.max_voltage)},
              {"max_voltage", job.max_voltage},
              {"period", job.period}});
    json.list("modules", robot.modules,
              [&](const Eigen::Vector2d& place) { json.write(Eigen::VectorXd(place)); });
    json.add("gains",
             {{"x", design.gains(0)}, {"y", design.gains(1)}, {"heading", design.gains(2)}});
    json.add("tolerances", {{"x", job.x_tolerance},
                            {"y", job.y_tolerance},
                            {"heading", job.heading_tolerance},
                            {"velocity", job.velocity_tolerance}});
    json.object("wheel", [&] {
      json.add({{"kS", design.kS},
                {"kV", design.kV},
                {"kA", design.kA},
                {"A", design.A},
                {"B", design.B},
                {"kP", design.kP},
                {"pole", design.pole},
                {"spinning_pole", design.spinning_pole}});
    });
    if (is_swerve(design)) {
      json.object("steer", [&] {
        json.add("motor", robot.steer_motor.name);
        json.add({{"gearing", robot.steer_gearing},
                  {"kV", design.steer_kV},
                  {"kA", design.steer_kA},
                  {"kP", design.steer(0)},
                  {"kD", design.steer(1)}});
        json.add("poles", Eigen::VectorXcd(design.steer_poles));
      });
    }
    json.add("diagnostics", design.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const HolonomicDesign& design) {
  const DriveJob& job = design.job;
  Answer answer{.schema = design_holonomic_schema, .json = to_json(design)};
  Document& document = answer.document;
  document.title = fmt::format("A follower for a {} drive", to_string(job.robot.kind));
  document.verdict.line = fmt::format(
      "Holonomic, of up to {} m/s: {} 1/s in place, {} 1/s in heading, and a loop of each wheel's "
      "speed of {} V·s/m.",
      number(job.robot.free_speed(job.max_voltage), 3), number(design.gains(0), 4),
      number(design.gains(2), 4), number(design.kP, 4));
  if (design.spinning_pole <= -1.0) {
    document.verdict.add(Tone::caution, "a wheel that loses the floor oscillates");
  }
  document.sections = {robot_section(design), loops_section(design), follower_section(design)};
  Section constants{"constants", "Constants to paste", {}};
  for (const exports::PasteText& paste : constants_of(design)) {
    constants.blocks.emplace_back(Code{paste.title, paste.text, paste.file});
    answer.files.push_back({paste.file, paste.text});
  }
  document.sections.push_back(std::move(constants));
  if (!design.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(design.diagnostics));
  }
  document.origins.add("project", job.path);
  answer.figures = {steps_figure(design)};
  answer.files.push_back({"follower.hpp", design.header});
  return answer;
}

}  // namespace flyball::study
