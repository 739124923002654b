// The follower of a drivetrain, as people, programs and other tools take it.
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/drive_constants.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/design_drive.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"
#include "study/drive_law.hpp"

namespace flyball::study {

namespace {

using text::number;

constexpr const char* design_drive_schema = "flyball.design_drive/1";

bool answers_volts(const FollowerDesign& design) {
  return design.job.follower == DriveFollower::ltv_drive;
}

exports::WpilibFollower wpilib_follower(const DriveJob& job) {
  using Kind = exports::WpilibFollower::Kind;
  exports::WpilibFollower of{.b = job.b,
                             .zeta = job.zeta,
                             .x_tolerance = job.x_tolerance,
                             .y_tolerance = job.y_tolerance,
                             .heading_tolerance = job.heading_tolerance};
  if (job.follower == DriveFollower::ramsete) {
    return of;
  }
  if (job.follower == DriveFollower::ltv_drive) {
    const LtvDriveSettings settings = ltv_drive_settings(job);
    of.kind = Kind::ltv_drive;
    of.velocity_tolerance = settings.velocity_tolerance;
    of.voltage_tolerance = settings.voltage_tolerance;
    return of;
  }
  const LtvUnicycleSettings settings = ltv_unicycle_settings(job);
  of.kind = Kind::ltv_unicycle;
  of.velocity_tolerance = settings.velocity_tolerance;
  of.angular_velocity_tolerance = settings.angular_velocity_tolerance;
  of.max_velocity = std::ceil(job.robot.free_speed(job.max_voltage));
  return of;
}

std::vector<exports::PasteText> constants_of(const FollowerDesign& design) {
  const DriveJob& job = design.job;
  const mechanisms::DriveGains& gains = design.gains;
  std::vector<exports::PasteText> all = exports::paste_drive_constants(
      {.linear = exports::DriveModeGains{gains.kS_left, gains.kV_linear, gains.kA_linear},
       .angular = exports::DriveModeGains{gains.kS_left, gains.kV_angular, gains.kA_angular},
       .trackwidth = job.robot.trackwidth,
       .kP = design.kP,
       .period = job.period,
       .follower = wpilib_follower(job)});
  // For motor controllers, per turn of the wheel.
  exports::MechanismConstants sides{.kind = mechanisms::MechanismKind::swerve_drive,
                                    .name = "Drivetrain",
                                    .unit = "m",
                                    .period = job.period,
                                    .nominal_voltage = job.robot.motor.nominal_voltage,
                                    .gearing = job.robot.gearing};
  const double turn = 2.0 * std::numbers::pi * job.robot.wheel_radius;
  for (const auto& [per, scale] : {std::pair{"rotation", turn}, std::pair{"RPM", turn / 60.0}}) {
    sides.gains.push_back({.per = per,
                           .kP = scale * design.kP,
                           .kS = gains.kS_left,
                           .kV = scale * gains.kV_linear,
                           .kA = scale * gains.kA_linear});
  }
  append(all, exports::paste_constants(sides));
  return all;
}

Section robot_section(const FollowerDesign& design) {
  const DriveRobot& robot = design.job.robot;
  const mechanisms::DriveGains& gains = design.gains;
  Facts facts;
  facts.add("motors", fmt::format("{} {}, geared {}", 2 * robot.motor.count, robot.motor.name,
                                  number(robot.gearing)));
  facts.add("robot",
            fmt::format("{} kg, {} kg·m²", number(robot.mass), number(robot.moment_of_inertia)));
  facts.add("wheels", fmt::format("{} m radius, {} m apart, {} m/s without load",
                                  number(robot.wheel_radius), number(robot.trackwidth),
                                  number(robot.free_speed(design.job.max_voltage), 3)));
  facts.add("kS", quantity(gains.kS_left, "V"));
  facts.add("straight on", fmt::format("kV {} V·s/m, kA {} V·s²/m", number(gains.kV_linear, 4),
                                       number(gains.kA_linear, 4)));
  const double half = 0.5 * robot.trackwidth;
  facts.add("turning",
            fmt::format("kV {} V·s/rad, kA {} V·s²/rad", number(half * gains.kV_angular, 4),
                        number(half * gains.kA_angular, 4)));
  return {"robot", "Drivetrain", {std::move(facts)}};
}

Section loop_section(const FollowerDesign& design) {
  Section section{"velocity_loop", "Loop of the sides' velocities", {}};
  Facts facts;
  const Eigen::Matrix2d& K = design.K;
  facts.add(
      "K", fmt::format("[{}, {}; {}, {}] V·s/m, u = K (r − x) of [left, right]", number(K(0, 0), 5),
                       number(K(0, 1), 5), number(K(1, 0), 5), number(K(1, 1), 5)));
  facts.add("kP of a side alone", quantity(design.kP, "V·s/m"));
  facts.add("poles", fmt::format("{} straight on, {} turning, each {}", number(design.poles(0), 4),
                                 number(design.poles(1), 4), text::seconds(design.job.period)));
  section.blocks.emplace_back(std::move(facts));
  if (answers_volts(design)) {
    section.blocks.emplace_back(
        Paragraph{"The follower needs no loop below it; this one is for motor controllers."});
  }
  return section;
}

Section follower_section(const FollowerDesign& design) {
  const DriveJob& job = design.job;
  Section section{"follower", "Follower", {}};
  Facts facts;
  facts.add("law", fmt::format("{}, each {}", to_string(job.follower), text::seconds(job.period)));
  if (job.follower == DriveFollower::ramsete) {
    facts.add("b", quantity(job.b, "rad²/m²"));
    facts.add("ζ", quantity(job.zeta, "1/rad"));
  } else {
    facts.add("tolerances", fmt::format("{} m ahead, {} m across, {} rad", number(job.x_tolerance),
                                        number(job.y_tolerance), number(job.heading_tolerance)));
  }
  if (answers_volts(design)) {
    facts.add("tolerance of a side's velocity", quantity(job.velocity_tolerance, "m/s"));
    facts.add("schedule",
              fmt::format("{} gains; between them off by at most {}", design.schedule.size(),
                          text::percent(design.schedule_error.value_or(0.0), 2)));
  }
  facts.add("in C++17", "follower.hpp, with --out");
  section.blocks.emplace_back(std::move(facts));
  Table table;
  table.header = answers_volts(design)
                     ? std::vector<std::string>{"v (m/s)",   "x (V/m)",      "y (V/m)",
                                                "θ (V/rad)", "left (V·s/m)", "right (V·s/m)"}
                     : std::vector<std::string>{"v (m/s)", "v of x (1/s)", "ω of y (rad/(s·m))",
                                                "ω of θ (1/s)"};
  constexpr std::size_t shown = 8;
  const std::size_t stride = (design.schedule.size() - 1) / shown;
  for (std::size_t i = 0; i < design.schedule.size(); i += stride) {
    const auto& [v, K] = design.schedule[i];
    std::vector<Value> row{number(v, 3)};
    if (answers_volts(design)) {
      for (Eigen::Index j = 0; j < K.cols(); ++j) {
        row.emplace_back(number(K(0, j), 4));
      }
    } else {
      row.insert(row.end(), {number(K(0, 0), 4), number(K(1, 1), 4), number(K(1, 2), 4)});
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
  section.blocks.emplace_back(Paragraph{
      answers_volts(design)
          ? "Gains of the left side's voltage, by the error in the robot's frame. The right side's "
            "have y and θ negated, and left and right exchanged; at −v those of y are negated."
          : "Gains by the error in the robot's frame, straight on; at −v that of y is negated."});
  return section;
}

Figure schedule_figure(const FollowerDesign& design) {
  Figure figure{
      "follower",
      "schedule",
      "Gains over the velocity",
      answers_volts(design)
          ? "What an error of each state adds, over the robot's velocity."
          : "What an error adds, over the robot's velocity: ahead to v, across and of the "
            "heading to ω.",
      {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Velocity (m/s)";
  const auto gain = [&](const char* name, Eigen::Index row, Eigen::Index column, int color) {
    PlotLine line{.label = name, .color = color};
    for (const auto& [v, K] : design.schedule) {
      line.x.push_back(v);
      line.y.push_back(K(row, column));
    }
    return line;
  };
  if (answers_volts(design)) {
    figure.plot.panels = {
        panel({"Left volts of a place", "V/m"},
              {gain("ahead", 0, 0, measured_color), gain("across", 0, 1, simulated_color)}),
        panel({"Of the heading", "V/rad"}, {gain("", 0, 2, voltage_color)}),
        panel({"Of the sides", "V·s/m"},
              {gain("left", 0, 3, measured_color), gain("right", 0, 4, simulated_color)})};
  } else {
    figure.plot.panels = {panel({"Ahead", "1/s"}, {gain("", 0, 0, measured_color)}),
                          panel({"Across", "rad/(s·m)"}, {gain("", 1, 1, simulated_color)}),
                          panel({"Heading", "1/s"}, {gain("", 1, 2, voltage_color)})};
  }
  return figure;
}

/// All of the schedule, a row a velocity.
std::string schedule_csv(const FollowerDesign& design) {
  std::string csv =
      answers_volts(design)
          ? "velocity,left_of_x,left_of_y,left_of_heading,left_of_left,left_of_right,right_of_x,"
            "right_of_y,right_of_heading,right_of_left,right_of_right"
          : "velocity,v_of_x,v_of_y,v_of_heading,omega_of_x,omega_of_y,omega_of_heading";
  csv += '\n';
  for (const auto& [v, K] : design.schedule) {
    csv += fmt::format("{}", v);
    for (Eigen::Index i = 0; i < K.rows(); ++i) {
      for (Eigen::Index j = 0; j < K.cols(); ++j) {
        csv += fmt::format(",{}", K(i, j));
      }
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace

std::string to_json(const FollowerDesign& design) {
  const DriveJob& job = design.job;
  const DriveRobot& robot = job.robot;
  const mechanisms::DriveGains& gains = design.gains;
  const double half = 0.5 * robot.trackwidth;
  JsonWriter json;
  json.object([&] {
    json.add("schema", design_drive_schema);
    json.add("drivetrain", to_string(robot.kind));
    json.add("follower", to_string(job.follower));
    json.add("motor", robot.motor.name);
    json.add("motor_count", robot.motor.count);
    json.add({{"mass", robot.mass},
              {"moment_of_inertia", robot.moment_of_inertia},
              {"gearing", robot.gearing},
              {"wheel_radius", robot.wheel_radius},
              {"trackwidth", robot.trackwidth},
              {"wheel_speed", robot.free_speed(job.max_voltage)},
              {"max_voltage", job.max_voltage},
              {"period", job.period}});
    json.add("gains", {{"kS", gains.kS_left},
                       {"kV", gains.kV_linear},
                       {"kA", gains.kA_linear},
                       {"kV_angular", half * gains.kV_angular},
                       {"kA_angular", half * gains.kA_angular}});
    json.object("plant", [&] {
      json.add("A", Eigen::MatrixXd(design.model.A));
      json.add("B", Eigen::MatrixXd(design.model.B));
      json.add("A_discrete", Eigen::MatrixXd(design.A));
      json.add("B_discrete", Eigen::MatrixXd(design.B));
    });
    json.object("velocity_loop", [&] {
      json.add("K", Eigen::MatrixXd(design.K));
      json.add("kP", design.kP);
      json.add("poles", Eigen::VectorXd(design.poles));
    });
    if (job.follower == DriveFollower::ramsete) {
      json.add("settings", {{"b", job.b}, {"zeta", job.zeta}});
    } else {
      json.add("settings", {{"x_tolerance", job.x_tolerance},
                            {"y_tolerance", job.y_tolerance},
                            {"heading_tolerance", job.heading_tolerance},
                            {"velocity_tolerance", wpilib_follower(job).velocity_tolerance}});
    }
    json.list("schedule", design.schedule, [&](const ScheduledGain& entry) {
      json.object([&] {
        json.add("velocity", entry.velocity);
        json.add("K", entry.K);
      });
    });
    json.add("schedule_error", design.schedule_error);
    json.add("diagnostics", design.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const FollowerDesign& design) {
  const DriveJob& job = design.job;
  Answer answer{.schema = design_drive_schema, .json = to_json(design)};
  Document& document = answer.document;
  document.title = fmt::format("A follower for a {} drive", to_string(job.robot.kind));
  document.verdict.line = fmt::format(
      "{} of up to {} m/s, with {}.", text::capitalized(std::string(to_string(job.follower))),
      number(job.robot.free_speed(job.max_voltage), 3),
      answers_volts(design)
          ? fmt::format("{} scheduled gains", design.schedule.size())
          : fmt::format("a loop of the sides' velocities of {} V·s/m", number(design.kP, 4)));
  document.sections = {robot_section(design), loop_section(design), follower_section(design)};
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
  answer.figures = {schedule_figure(design)};
  answer.files.push_back({"follower.hpp", design.header});
  answer.files.push_back({"data/schedule.csv", schedule_csv(design)});
  return answer;
}

}  // namespace flyball::study
