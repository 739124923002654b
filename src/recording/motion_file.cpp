#include <flyball/recording/motion_file.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/motion/pathplanner.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/finish_trajectory.hpp"
#include "recording/slopes.hpp"
#include "recording/table_fault.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;

std::string at(const std::string& source, const Place& place) {
  return fmt::format("{}:{}:{}", source, place.line, place.column);
}

void differentiate_places(RobotTrajectory& trajectory) {
  const auto slope = recording::slopes(
      trajectory.samples, [](const MotionSample& s) { return s.pose.translation(); },
      [](const Vector2d& b, const Vector2d& a) { return Vector2d(b - a); });
  for (std::size_t i = 0; i < slope.size(); ++i) {
    trajectory.samples[i].velocity = slope[i];
  }
}

void differentiate_headings(RobotTrajectory& trajectory) {
  const auto slope = recording::slopes(
      trajectory.samples, [](const MotionSample& s) { return s.pose.angle(); },
      [](double b, double a) { return std::remainder(b - a, full_turn); });
  for (std::size_t i = 0; i < slope.size(); ++i) {
    trajectory.samples[i].omega = slope[i];
  }
}

/// Whether it looks another way than it goes.
bool is_holonomic(const std::vector<MotionSample>& samples) {
  constexpr double sideways = 0.05;  // m/s
  return std::any_of(samples.begin(), samples.end(), [](const MotionSample& sample) {
    return std::abs(sample.velocity(1) * sample.pose.rotation().cos() -
                    sample.velocity(0) * sample.pose.rotation().sin()) > sideways;
  });
}

Expected<RobotTrajectory> of_choreo(const std::vector<ChoreoSample>& samples,
                                    const std::string& source) {
  RobotTrajectory result{.source = source};
  if (samples.empty()) {
    return refusal(TrajectoryFileError::too_few, source, "the trajectory")
        .got("without samples")
        .expected("generated")
        .hint("generate it in Choreo, and save");
  }
  std::vector<JsonOrigin> origins;
  for (const ChoreoSample& sample : samples) {
    origins.push_back(sample.origin);
  }
  const std::vector<Place> places = places_of(origins);
  bool has_rates = true;
  bool has_accelerations = true;
  for (const ChoreoSample& sample : samples) {
    MotionSample motion{.time = sample.time, .pose = Pose2d(sample.x, sample.y, sample.heading)};
    motion.place = places[result.samples.size()];
    const Vector2d forward(motion.pose.rotation().cos(), motion.pose.rotation().sin());
    if (sample.vx && sample.vy) {
      motion.velocity = {*sample.vx, *sample.vy};
    } else if (sample.vl && sample.vr) {
      motion.velocity = 0.5 * (*sample.vl + *sample.vr) * forward;
    } else {
      return refusal(TrajectoryFileError::wrong_sample, at(source, motion.place),
                     fmt::format("sample {}", result.samples.size() + 1))
          .got("without a velocity")
          .expected("with vx and vy, or with vl and vr");
    }
    motion.omega = sample.omega.value_or(0.0);
    if (sample.ax && sample.ay) {
      motion.acceleration = {*sample.ax, *sample.ay};
    } else if (sample.al && sample.ar) {
      // Across the heading it is accelerated, too, where it turns.
      const Vector2d left(-forward(1), forward(0));
      motion.acceleration = 0.5 * (*sample.al + *sample.ar) * forward +
                            motion.omega * motion.velocity.dot(forward) * left;
    } else {
      has_accelerations = false;
    }
    has_rates = has_rates && sample.omega;
    result.samples.push_back(motion);
  }
  FLYBALL_CHECK(recording::check_samples(result));
  if (!has_rates) {
    differentiate_headings(result);
  }
  if (!has_accelerations) {
    recording::differentiate_velocities(result);
  }
  result.holonomic = is_holonomic(result.samples);
  recording::settle(result);
  return result;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// A column of a table by its name, in SI.
Expected<std::optional<std::vector<double>>> column_of(const Log& table, std::string_view name,
                                                       Dimension dimension) {
  const auto found = std::find_if(table.signals.begin(), table.signals.end(),
                                  [&](const Signal& signal) { return lower(signal.name) == name; });
  if (found == table.signals.end()) {
    return std::optional<std::vector<double>>();
  }
  std::vector<double> values = found->value;
  if (!found->unit.empty()) {
    FLYBALL_TRY(const double scale, parse_quantity("1 " + found->unit, dimension,
                                                   fmt::format("the unit of column {}", name)));
    for (double& value : values) {
      value *= scale;
    }
  }
  return std::optional(std::move(values));
}

}  // namespace

std::string_view to_string(MotionFormat format) {
  constexpr std::array<std::string_view, 8> names{
      "a Choreo trajectory",    "a Choreo project",
      "a path of PathPlanner",  "a routine of PathPlanner",
      "PathPlanner's settings", "PathPlanner's navigation grid",
      "a WPILib trajectory",    "a table"};
  return names[static_cast<std::size_t>(format)];
}

ExpectedAll<MotionFormat> motion_format(std::string_view text, const std::string& source) {
  std::string_view start = text;
  if (start.starts_with("\xEF\xBB\xBF")) {
    start.remove_prefix(3);
  }
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) {
    return tl::unexpected(
        Errors(Error(MotionFileError::wrong_kind).in(source).about("the file").got("empty")));
  }
  if (start[first] != '{' && start[first] != '[') {
    return MotionFormat::trajectory_table;
  }
  if (start[first] == '[') {
    return MotionFormat::wpilib_trajectory;
  }
  FLYBALL_TRY(const std::vector<std::string> keys, json_keys(text, source));
  const auto has = [&](std::string_view key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  if (has("trajectory") && has("params")) {
    return MotionFormat::choreo_trajectory;
  }
  if (has("samples")) {
    const std::size_t time = text.find("\"timestamp\"");
    return time != std::string_view::npos ? MotionFormat::choreo_trajectory
                                          : MotionFormat::wpilib_trajectory;
  }
  if (has("robotConfiguration") || has("config")) {
    return MotionFormat::choreo_project;
  }
  if (has("waypoints")) {
    return MotionFormat::pathplanner_path;
  }
  if (has("command")) {
    return MotionFormat::pathplanner_auto;
  }
  if (has("grid")) {
    return MotionFormat::pathplanner_grid;
  }
  if (has("robotMass") || has("holonomicMode") || has("robotWidth")) {
    return MotionFormat::pathplanner_settings;
  }
  std::string shown;
  for (std::size_t i = 0; i < std::min<std::size_t>(keys.size(), 4); ++i) {
    shown += (i == 0 ? "" : ", ") + cut(printable(keys[i]), 20);
  }
  return tl::unexpected(Errors(
      Error(MotionFileError::wrong_kind)
          .in(source)
          .about("the JSON")
          .got(shown.empty() ? std::string("an empty object") : "an object of " + shown)
          .expected("a file of Choreo (.traj, .chor), PathPlanner (.path, .auto), or a WPILib "
                    "trajectory")));
}

Expected<RobotTrajectory> trajectory_of(const ChoreoTrajectory& file, const std::string& source) {
  FLYBALL_TRY(RobotTrajectory result, of_choreo(file.trajectory.samples, source));
  result.diagnostics.insert(result.diagnostics.begin(), file.diagnostics.begin(),
                            file.diagnostics.end());
  return result;
}

Expected<RobotTrajectory> trajectory_of(const ChoreoPath2024& path, const std::string& source) {
  return of_choreo(path.trajectory, fmt::format("{} ({})", source, printable(cut(path.name, 60))));
}

Expected<RobotTrajectory> trajectory_of(const Log& table) {
  RobotTrajectory result{.source = table.source, .diagnostics = table.diagnostics};
  using Column = std::optional<std::vector<double>>;
  FLYBALL_TRY(const Column x, column_of(table, "x", Dimension::length));
  FLYBALL_TRY(const Column y, column_of(table, "y", Dimension::length));
  FLYBALL_TRY(const Column heading, column_of(table, "heading", Dimension::angle));
  FLYBALL_TRY(const Column vx, column_of(table, "vx", Dimension::velocity));
  FLYBALL_TRY(const Column vy, column_of(table, "vy", Dimension::velocity));
  FLYBALL_TRY(const Column omega, column_of(table, "omega", Dimension::angular_velocity));
  FLYBALL_TRY(const Column ax, column_of(table, "ax", Dimension::acceleration));
  FLYBALL_TRY(const Column ay, column_of(table, "ay", Dimension::acceleration));
  if (!x || !y) {
    std::string columns;
    for (const Signal& signal : table.signals) {
      columns += (columns.empty() ? "" : ", ") + cut(printable(signal.name), 20);
    }
    return refusal(TrajectoryFileError::not_a_trajectory, table.source, "the table")
        .got(columns.empty() ? std::string("without columns")
                             : fmt::format("of columns {}", cut(columns, 100)))
        .expected("columns time, x, y, heading, and best vx, vy, omega, ax, ay");
  }
  const std::vector<double>* time = nullptr;
  for (const Signal& signal : table.signals) {
    if (lower(signal.name) == "x") {
      time = &signal.time;
    }
  }
  const std::size_t n = x->size();
  for (const Column* column : {&y, &heading, &vx, &vy, &omega, &ax, &ay}) {
    if (*column && (*column)->size() != n) {
      return refusal(TrajectoryFileError::wrong_sample, table.source, "the table")
          .got(fmt::format("with a column of {} numbers beside {} of x", (*column)->size(), n))
          .expected("a number in each cell of each column");
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    MotionSample sample{.time = (*time)[i],
                        .pose = Pose2d((*x)[i], (*y)[i], heading ? (*heading)[i] : 0.0)};
    sample.place = {.line = i + 2, .column = 1};
    sample.velocity = vx && vy ? Vector2d((*vx)[i], (*vy)[i]) : Vector2d(0.0, 0.0);
    sample.omega = omega ? (*omega)[i] : 0.0;
    sample.acceleration = ax && ay ? Vector2d((*ax)[i], (*ay)[i]) : Vector2d(0.0, 0.0);
    result.samples.push_back(sample);
  }
  FLYBALL_CHECK(recording::check_samples(result));
  if (!vx || !vy) {
    differentiate_places(result);
  }
  if (!heading) {  // it looks where it goes
    double angle = 0.0;
    for (MotionSample& sample : result.samples) {
      angle = sample.velocity.norm() > 1e-9 ? std::atan2(sample.velocity(1), sample.velocity(0))
                                            : angle;
      sample.pose = Pose2d(sample.pose.x(), sample.pose.y(), angle);
    }
  }
  if (!omega) {
    differentiate_headings(result);
  }
  if (!ax || !ay) {
    recording::differentiate_velocities(result);
  }
  result.holonomic = is_holonomic(result.samples);
  recording::settle(result);
  return result;
}

ExpectedAll<RobotTrajectory> read_motion(const std::string& file, const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(file));
  FLYBALL_TRY(const MotionFormat format, motion_format(text, file));
  switch (format) {
    case MotionFormat::choreo_trajectory: {
      FLYBALL_TRY(const ChoreoTrajectory read, parse_choreo_trajectory(text, file));
      return trajectory_of(read, file);
    }
    case MotionFormat::choreo_project: {
      FLYBALL_TRY(const ChoreoProject project, parse_choreo_project(text, file));
      std::string names;
      const ChoreoPath2024* chosen = nullptr;
      for (const ChoreoPath2024& one : project.paths) {
        names += (names.empty() ? "" : ", ") + cut(printable(one.name), 40);
        if (one.name == path || (path.empty() && project.paths.size() == 1)) {
          chosen = &one;
        }
      }
      if (chosen == nullptr) {
        return tl::unexpected(Errors(
            Error(TrajectoryFileError::not_a_trajectory)
                .in(file)
                .about(path.empty() ? "the project" : fmt::format("the path \"{}\"", path))
                .got(project.paths.empty() ? "without paths"
                     : path.empty()        ? "of several paths"
                                           : "not of this project")
                .expected(project.paths.empty() ? "a trajectory: one of the .traj files beside it"
                                                : "one of " + cut(names, 200))
                .hint(!project.paths.empty() && path.empty() ? "say which by its name" : "")));
      }
      return trajectory_of(*chosen, file);
    }
    case MotionFormat::wpilib_trajectory:
      return parse_trajectory(text, file);
    case MotionFormat::trajectory_table: {
      FLYBALL_TRY(const Log table, parse_csv(text, file));
      auto motion = trajectory_of(table);
      const bool sorted =
          std::none_of(table.diagnostics.begin(), table.diagnostics.end(),
                       [](const Diagnostic& noticed) { return noticed.code == "unsorted_time"; });
      if (!motion || !sorted) {  // the table knows no lines
        if (auto fault = recording::table_fault(text, file)) {
          return tl::unexpected(Errors(std::vector<QuotedError>{*std::move(fault)}));
        }
      }
      return motion;
    }
    case MotionFormat::pathplanner_path:
    case MotionFormat::pathplanner_auto:
    case MotionFormat::pathplanner_settings:
    case MotionFormat::pathplanner_grid:
      break;
  }
  return tl::unexpected(Errors(Error(TrajectoryFileError::not_a_trajectory)
                                   .in(file)
                                   .about("the file")
                                   .got(std::string(to_string(format)))
                                   .expected("a trajectory: samples with their times")));
}

}  // namespace flyball
