// How a drivetrain followed its trajectory.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/answer/driven_parts.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using text::number;
using text::percent;
using text::seconds;

constexpr const char* driven_schema = "flyball.drive/1";
constexpr double brownout = 6.75;  // V

std::string centimetres(double metres) {
  constexpr double seen = 5e-5;  // m, a twentieth of a millimetre
  return fmt::format("{} cm", number(std::abs(metres) < seen ? 0.0 : 100.0 * metres, 3));
}

std::string degrees_text(double angle) {
  return fmt::format("{}°", number(angle / one_degree, 3));
}

Facts robot_facts(const DriveResult& result) {
  const DriveRobot& robot = result.job.robot;
  Facts facts;
  facts.add("drivetrain", std::string(to_string(robot.kind)));
  const int units = robot.kind == DriveKind::differential ? 2 : 4;
  facts.add("motors", fmt::format("{} {}, geared {}", units * robot.motor.count, robot.motor.name,
                                  number(robot.gearing)));
  facts.add("robot",
            fmt::format("{} kg, {} kg·m²", number(robot.mass), number(robot.moment_of_inertia)));
  facts.add("wheels", fmt::format("{} m radius, {} m/s without load", number(robot.wheel_radius),
                                  number(robot.free_speed(result.job.max_voltage), 3)));
  facts.add("follower",
            fmt::format("{}, each {}", to_string(result.job.follower), seconds(result.job.period)));
  facts.add("trajectory", fmt::format("{}, {}", seconds(result.duration),
                                      text::count(result.job.trajectory.samples.size(), "sample")));
  return facts;
}

/// What it meets, in words; empty: nothing.
std::string disturbances(const DriveResult& result) {
  const DisturbanceSection& off = result.job.disturbance;
  std::vector<std::string> words;
  if (off.ahead.si() != 0.0 || off.left.si() != 0.0 || off.turned.si() != 0.0) {
    words.push_back(fmt::format("a start {} ahead, {} to the left and {} turned",
                                centimetres(off.ahead.si()), centimetres(off.left.si()),
                                degrees_text(off.turned.si())));
  }
  if (off.latency.si() > 0.0) {
    words.push_back(fmt::format("poses {} old", seconds(off.latency.si())));
  }
  const auto factor = [&](double value, const char* of) {
    if (value != 1.0) {
      words.push_back(fmt::format("{} of {}", of, number(value, 3)));
    }
  };
  factor(off.mass_factor, "a mass factor");
  factor(off.strength_factor, "a strength factor");
  factor(off.left_factor, "a factor of the left wheels");
  if (off.push.si() > 0.0 && off.push_for.si() > 0.0) {
    words.push_back(
        fmt::format("a push of {} N for {}", number(off.push.si(), 3), seconds(off.push_for.si())));
  }
  if (off.slip_grip != 1.0 && off.slip_for.si() > 0.0) {
    words.push_back(fmt::format("{} of the grip for {}", percent(off.slip_grip, 2),
                                seconds(off.slip_for.si())));
  }
  if (off.position_noise.si() > 0.0 || off.heading_noise.si() > 0.0) {
    words.push_back(fmt::format("noise of {} and {}", centimetres(off.position_noise.si()),
                                degrees_text(off.heading_noise.si())));
  }
  return text::enumerate(words);
}

Section errors_section(const DriveResult& result) {
  const TrackingErrors& e = result.errors;
  Table table;
  table.header = {"error", "largest", "at the end"};
  table.rows = {{"across the way", centimetres(e.largest_across), centimetres(e.final_across)},
                {"along the way", centimetres(e.largest_along), centimetres(e.final_along)},
                {"heading", degrees_text(e.largest_heading), degrees_text(e.final_heading)}};
  Facts facts;
  facts.add("distance, root mean square", centimetres(e.rms));
  facts.add("saturated", percent(result.saturated_share, 2),
            result.saturated_share > 0.2 ? Tone::caution : Tone::plain);
  facts.add("fastest slip of a wheel", fmt::format("{} m/s", number(result.largest_slip, 3)));
  facts.add("least rail", fmt::format("{} V", number(result.least_rail, 3)),
            result.least_rail < brownout ? Tone::bad : Tone::plain);
  facts.add("peak of the battery", fmt::format("{} A", number(result.peak_current, 3)));
  facts.add("energy", fmt::format("{} J", number(result.energy, 4)));
  return {"errors", "How it followed", {std::move(table), std::move(facts)}};
}

/// The largest of a vector whose parts are columns.
double largest_of(const DriveResult& result, std::initializer_list<const char*> columns) {
  double most = 0.0;
  for (std::size_t i = 0; i < result.series.rows(); ++i) {
    double square = 0.0;
    for (const char* name : columns) {
      const double part = (*result.series.find(name))[i];
      square += part * part;
    }
    most = std::max(most, std::sqrt(square));
  }
  return most;
}

Verdict verdict_of(const DriveResult& result) {
  const TrackingErrors& e = result.errors;
  Verdict verdict;
  verdict.line = fmt::format("{} followed the trajectory of {} within {} across and {} along it.",
                             text::capitalized(std::string(to_string(result.job.follower))),
                             seconds(result.duration), centimetres(e.largest_across),
                             centimetres(e.largest_along));
  if (result.arrival) {
    verdict.line += fmt::format(" It arrived after {}.", seconds(*result.arrival));
  }
  if (result.lost) {
    verdict.line = fmt::format("{} lost the trajectory: {} across it, {} along it.",
                               text::capitalized(std::string(to_string(result.job.follower))),
                               centimetres(e.largest_across), centimetres(e.largest_along));
    verdict.add(Tone::bad, "the robot was more than a metre from where it should be");
  }
  if (result.job.follower == DriveFollower::pure_pursuit && !result.arrival && !result.lost) {
    verdict.line =
        fmt::format("{} did not arrive: it is within {} of the path, but not at its end.",
                    text::capitalized(std::string(to_string(result.job.follower))),
                    centimetres(e.largest_across));
    verdict.add(Tone::bad, "the end was not reached in the time that it had");
  }
  constexpr double near = 0.1;  // m
  if (const double last = std::hypot(e.final_along, e.final_across); last > near) {
    verdict.add(Tone::caution, fmt::format("{} after the end it is still {} from it",
                                           seconds(result.job.settle), centimetres(last)));
  }
  if (result.saturated_share > 0.2) {
    verdict.add(Tone::caution, fmt::format("it asks for more than there is for {} of the time",
                                           percent(result.saturated_share, 2)));
  }
  if (result.least_rail < brownout) {
    verdict.add(Tone::bad,
                fmt::format("the battery falls to {} V, a brownout", number(result.least_rail, 3)));
  }
  return verdict;
}

}  // namespace

std::string to_json(const DriveResult& result) {
  const DriveRobot& robot = result.job.robot;
  const TrackingErrors& e = result.errors;
  JsonWriter json;
  json.object([&] {
    json.add("schema", driven_schema);
    json.add("drivetrain", to_string(robot.kind));
    json.add("follower", to_string(result.job.follower));
    json.add("motor", robot.motor.name);
    json.add("motor_count", robot.motor.count);
    json.add({{"mass", robot.mass},
              {"moment_of_inertia", robot.moment_of_inertia},
              {"gearing", robot.gearing},
              {"wheel_radius", robot.wheel_radius},
              {"trackwidth", robot.trackwidth},
              {"wheel_speed", robot.free_speed(result.job.max_voltage)},
              {"period", result.job.period},
              {"duration", result.duration}});
    json.object("errors", [&] {
      json.add({{"largest_across", e.largest_across},
                {"final_across", e.final_across},
                {"largest_along", e.largest_along},
                {"final_along", e.final_along},
                {"largest_heading", e.largest_heading},
                {"final_heading", e.final_heading},
                {"rms", e.rms}});
    });
    json.add({{"saturated_share", result.saturated_share},
              {"largest_slip", result.largest_slip},
              {"least_rail", result.least_rail},
              {"peak_current", result.peak_current},
              {"energy", result.energy}});
    if (result.job.follower == DriveFollower::pure_pursuit) {
      json.add("arrival", result.arrival);
    }
    json.add("lost", result.lost);
    json.add("seed", result.job.seed);
    json.object("series", [&] {
      json.add("time", result.series.time());
      for (const TimeSeries::Column& column : result.series.columns()) {
        json.add(column.name, column.values);
      }
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const DriveResult& result) {
  Answer answer{.schema = driven_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = fmt::format("A {} drive follows a trajectory", to_string(result.job.robot.kind));
  document.verdict = verdict_of(result);
  Section robot{"field", "Robot and field", {robot_facts(result)}};
  const std::string met = disturbances(result);
  robot.blocks.emplace_back(
      Paragraph{met.empty() ? std::string("Nothing disturbs it: [disturbance] says what could.")
                            : fmt::format("It meets, without its follower's knowing, {}.", met)});
  document.sections = {
      errors_section(result),
      std::move(robot),
      {"speeds",
       "Speeds",
       {Paragraph{fmt::format("At most {} m/s and {} rad/s; data/drive.csv of the report has every "
                              "period.",
                              number(largest_of(result, {"vx", "vy"}), 3),
                              number(largest_of(result, {"omega"}), 3))}}},
      {"voltages",
       "Voltages",
       {Paragraph{fmt::format("Asked for within ± {} V; data/drive.wpilog is for "
                              "AdvantageScope.",
                              number(result.job.max_voltage))}}}};
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("project", result.job.path);
  if (result.job.trajectory.source != result.job.path) {
    document.origins.add("trajectory", result.job.trajectory.source);
  }
  document.origins.add("seed", fmt::to_string(result.job.seed));
  answer.figures = figures_of(result);
  answer.animations = animations_of(result);
  answer.files = {{"data/drive.csv", to_csv(result.series)}, driven_log_file(result)};
  const TrackingErrors& e = result.errors;
  const bool pursues = result.job.follower == DriveFollower::pure_pursuit;
  if (result.lost) {
    answer.refusal =
        Error(DriveError::lost)
            .in(result.job.path)
            .about(std::string(to_string(result.job.follower)))
            .got(fmt::format("{} across and {} along at most", centimetres(e.largest_across),
                             centimetres(e.largest_along)))
            .expected("within a metre of the trajectory")
            .hint(
                "a slower trajectory, tighter tolerances or less of a disturbance "
                "keep it");
  } else if (pursues && !result.arrival) {
    answer.refusal = Error(DriveError::not_arrived)
                         .in(result.job.path)
                         .about("pure pursuit")
                         .got("not at the path's end in twice the trajectory's time")
                         .hint("a shorter lookahead follows tighter bends");
  }
  return answer;
}

}  // namespace flyball::study
