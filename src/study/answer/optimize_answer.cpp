// The fastest trajectories, for people and programs.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/time_series.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>

#include "core/wording.hpp"
#include "study/answer/optimize_parts.hpp"
#include "study/answer/parts.hpp"
#include "study/optimize_choreo.hpp"

namespace flyball::study {

namespace {

using text::number;
using text::seconds;

constexpr const char* optimize_schema = "flyball.optimize/1";

/// A name as part of a file's.
std::string file_name(const OptimizeResult& result, std::size_t task) {
  std::string name = result.job.tasks[task].name;
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_';
    c = plain ? c : '_';
  }
  if (name.empty()) {
    name = "trajectory";
  }
  for (std::size_t i = 0; i < task; ++i) {
    if (result.job.tasks[i].name == result.job.tasks[task].name) {
      return fmt::format("{}_{}", name, task + 1);
    }
  }
  return name;
}

/// The job's file without folder and ending.
std::string project_name(const OptimizeResult& result) {
  const std::string& path = result.job.path;
  const std::size_t slash = path.find_last_of('/');
  const std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
  return name.substr(0, name.find_last_of('.'));
}

std::string csv_of(const OptimizeTask& task, const DriveSolution& solution) {
  std::vector<double> time;
  for (const DriveSample& s : solution.samples) {
    time.push_back(s.time);
  }
  TimeSeries series(std::move(time));
  const auto add = [&](std::string name, std::string unit, auto&& value) {
    std::vector<double> column;
    for (const DriveSample& s : solution.samples) {
      column.push_back(value(s));
    }
    static_cast<void>(series.add(std::move(name), std::move(unit), std::move(column)));
  };
  add("x", "m", [](const DriveSample& s) { return s.x; });
  add("y", "m", [](const DriveSample& s) { return s.y; });
  add("heading", "rad", [](const DriveSample& s) { return s.heading; });
  add("vx", "m/s", [](const DriveSample& s) { return s.vx; });
  add("vy", "m/s", [](const DriveSample& s) { return s.vy; });
  add("omega", "rad/s", [](const DriveSample& s) { return s.omega; });
  const DriveModel& model = task.problem.model;
  for (std::size_t i = 0; i < static_cast<std::size_t>(model.wheel_count()); ++i) {
    const std::string wheel = wheel_name(model.drivetrain, i);
    add(wheel + "_force_x", "N", [i](const DriveSample& s) { return s.forces[i](0); });
    if (model.drivetrain == Drivetrain::swerve) {
      add(wheel + "_force_y", "N", [i](const DriveSample& s) { return s.forces[i](1); });
    }
  }
  return to_csv(series);
}

void write(JsonWriter& json, const char* key, const std::vector<DriveViolation>& violations) {
  json.list(key, violations, [&](const DriveViolation& v) {
    json.object([&] {
      json.add("name", v.name);
      json.add("segment", v.segment);
      json.add({{"time", v.time}, {"amount", v.amount}, {"share", v.share}});
      json.add("unit", v.unit);
    });
  });
}

void write(JsonWriter& json, const OptimizeTask& task, const DriveSolution& s) {
  json.add("name", task.name);
  json.add("drivetrain", to_string(task.problem.model.drivetrain));
  json.add("solved", s.solved);
  json.add("found", s.found);
  json.add("elastic", s.elastic);
  json.add("largest_share", s.violations.empty() ? 0.0 : s.violations.front().share);
  json.add("duration", s.duration);
  if (task.given_duration) {
    json.add("given_duration", *task.given_duration);
  }
  json.add("best", s.best);
  json.add("message", s.message);
  json.add({{"waypoint_error", s.waypoint_error}, {"heading_error", s.heading_error}});
  json.add("waypoint_times", s.waypoint_times);
  json.list("attempts", s.attempts, [&](const DriveAttempt& a) {
    json.object([&] {
      json.add("name", a.name);
      json.add("solved", a.solved);
      json.add("duration", a.duration);
      json.add("iterations", a.iterations);
    });
  });
  write(json, "violations", s.violations);
  write(json, "relaxed", s.relaxed);
  json.object("samples", [&] {
    const auto column = [&](const char* name, auto&& value) {
      std::vector<double> values;
      for (const DriveSample& sample : s.samples) {
        values.push_back(value(sample));
      }
      json.add(name, values);
    };
    column("time", [](const DriveSample& x) { return x.time; });
    column("x", [](const DriveSample& x) { return x.x; });
    column("y", [](const DriveSample& x) { return x.y; });
    column("heading", [](const DriveSample& x) { return x.heading; });
    column("vx", [](const DriveSample& x) { return x.vx; });
    column("vy", [](const DriveSample& x) { return x.vy; });
    column("omega", [](const DriveSample& x) { return x.omega; });
  });
}

std::string where_of(const OptimizeTask& task, const DriveViolation& v) {
  const int last = static_cast<int>(task.problem.waypoints.size()) - 1;
  return v.segment >= last ? fmt::format("at waypoint {}", last)
                           : fmt::format("between waypoints {} and {}", v.segment, v.segment + 1);
}

Table violations_table(const OptimizeTask& task, const std::vector<DriveViolation>& violations) {
  Table table;
  table.header = {"what", "by", "where", "when"};
  for (const DriveViolation& v : violations) {
    table.rows.push_back({v.name, fmt::format("{} {}", number(v.amount, 3), v.unit),
                          where_of(task, v), seconds(v.time)});
  }
  return table;
}

/// What is worth a word: a thousandth of a limit, a millimetre.
std::vector<DriveViolation> seen(const DriveSolution& s) {
  std::vector<DriveViolation> some;
  std::copy_if(s.violations.begin(), s.violations.end(), std::back_inserter(some),
               [](const DriveViolation& v) { return v.share > 1e-3; });
  return some;
}

Section run_section(const OptimizeResult& result, std::size_t i) {
  const OptimizeTask& task = result.job.tasks[i];
  const DriveSolution& s = result.solutions[i];
  const DriveModel& model = task.problem.model;
  Section section{section_title(i), task.name, {}};
  Facts facts;
  facts.add("duration", seconds(s.duration), s.solved ? Tone::good : Tone::bad);
  if (task.given_duration) {
    const double change = s.duration / *task.given_duration - 1.0;
    facts.add("in the file", fmt::format("{}, {}{} %", seconds(*task.given_duration),
                                         change > 0.0 ? "+" : "", number(100.0 * change, 3)));
  }
  facts.add("robot", fmt::format("{}, {} kg, {} kg·m²", to_string(model.drivetrain),
                                 number(model.mass), number(model.moment_of_inertia)));
  facts.add("wheels", fmt::format("at most {} N and {} m/s each", number(model.force(), 4),
                                  number(model.max_speed, 3)));
  facts.add("way", fmt::format("{}, {}", text::count(task.problem.waypoints.size(), "waypoint"),
                               text::count(task.problem.constraints.size(), "constraint")));
  facts.add("best start", s.best);
  facts.add("waypoints", fmt::format("missed by {} mm in an independent simulation",
                                     number(1e3 * s.waypoint_error, 2)));
  if (s.found) {
    facts.add("limits",
              s.violations.empty()
                  ? std::string("kept at a hundred instants of each interval")
                  : fmt::format("exceeded by at most {} % there: {}, {}",
                                number(100.0 * s.violations.front().share, 2),
                                s.violations.front().name, where_of(task, s.violations.front())),
              s.solved ? Tone::good : Tone::bad);
  }
  section.blocks.emplace_back(std::move(facts));
  if (!s.message.empty()) {
    section.blocks.emplace_back(Paragraph{text::capitalized(s.message) + "."});
  }
  if (!s.relaxed.empty()) {
    section.blocks.emplace_back(Paragraph{"What gives way in the nearest trajectory:"});
    section.blocks.emplace_back(violations_table(task, s.relaxed));
  }
  if (const auto exceeded = seen(s); !exceeded.empty() && s.relaxed.empty()) {
    section.blocks.emplace_back(Paragraph{"Limits that are exceeded in the simulation:"});
    section.blocks.emplace_back(violations_table(task, exceeded));
  }
  Table attempts;
  attempts.header = {"start", "duration", "iterations"};
  for (const DriveAttempt& a : s.attempts) {
    attempts.rows.push_back(
        {a.name, a.solved ? seconds(a.duration) : "not solved", fmt::to_string(a.iterations)});
  }
  section.blocks.emplace_back(std::move(attempts));
  return section;
}

Verdict verdict_of(const OptimizeResult& result) {
  Verdict verdict;
  std::size_t solved = 0;
  double total = 0.0;
  for (const DriveSolution& s : result.solutions) {
    solved += s.solved ? 1 : 0;
    total += s.duration;
  }
  if (result.solutions.size() == 1) {
    const DriveSolution& s = result.solutions.front();
    verdict.line = s.solved  ? fmt::format("The fastest trajectory takes {}.", seconds(s.duration))
                   : s.found ? "A trajectory was found, but it does not keep its limits."
                             : "There is no such trajectory.";
  } else {
    verdict.line = fmt::format("{} of {} trajectories found, {} in all.", solved,
                               result.solutions.size(), seconds(total));
  }
  for (std::size_t i = 0; i < result.solutions.size(); ++i) {
    const DriveSolution& s = result.solutions[i];
    if (!s.solved) {
      verdict.add(Tone::bad, fmt::format("{}: {}", result.job.tasks[i].name, s.message));
    } else if (!s.message.empty()) {
      verdict.add(Tone::caution, fmt::format("{}: {}", result.job.tasks[i].name, s.message));
    }
  }
  return verdict;
}

}  // namespace

std::string to_json(const OptimizeResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", optimize_schema);
    std::size_t i = 0;
    json.list("trajectories", result.solutions, [&](const DriveSolution& solution) {
      json.object([&] { write(json, result.job.tasks[i], solution); });
      ++i;
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const OptimizeResult& result) {
  Answer answer{.schema = optimize_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title =
      result.solutions.size() == 1 ? "The fastest trajectory" : "The fastest trajectories";
  document.verdict = verdict_of(result);
  for (std::size_t i = 0; i < result.solutions.size(); ++i) {
    const OptimizeTask& task = result.job.tasks[i];
    const DriveSolution& solution = result.solutions[i];
    document.sections.push_back(run_section(result, i));
    if (solution.samples.size() < 2) {
      continue;
    }
    for (Figure& figure : optimize_figures(task, solution, i)) {
      answer.figures.push_back(std::move(figure));
    }
    answer.animations.push_back(optimize_animation(task, solution, i));
    const std::string name = file_name(result, i);
    answer.files.push_back({fmt::format("data/{}.csv", name), csv_of(task, solution)});
    if (solution.solved) {
      if (auto text = to_choreo(choreo_of(task, solution))) {
        answer.files.push_back({fmt::format("data/{}.traj", name), *std::move(text)});
      }
    }
  }
  const bool any_solved = std::any_of(result.solutions.begin(), result.solutions.end(),
                                      [](const DriveSolution& s) { return s.solved; });
  if (any_solved && !result.job.path.ends_with(".traj")) {
    const auto project = choreo_project_of(result);
    if (const auto text = project ? to_choreo(*project) : Expected<std::string>(std::string());
        text && !text->empty()) {
      answer.files.push_back({fmt::format("data/{}.chor", project_name(result)), *text});
    }
  }
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("file", result.job.path);
  for (std::size_t i = 0; i < result.solutions.size(); ++i) {
    const DriveSolution& s = result.solutions[i];
    if (!s.solved && !answer.refusal) {
      answer.refusal =
          Error(s.relaxed.empty() ? OptimizeError::not_found : OptimizeError::contradiction)
              .in(result.job.path)
              .about(fmt::format("the trajectory {}", result.job.tasks[i].name))
              .got(s.found ? "found, but not within its limits" : "not possible")
              .hint(s.message);
    }
  }
  return answer;
}

}  // namespace flyball::study
