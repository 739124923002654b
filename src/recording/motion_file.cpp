#include <flyball/recording/motion_file.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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
#include "recording/table_fault.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;

std::string at(const std::string& source, const Place& place) {
  return fmt::format("{}:{}:{}", source, place.line, place.column);
}

/// Differences, half from each side, of what samples say at their times.
template <class Get, class Difference>
auto slopes(const std::vector<MotionSample>& samples, const Get& get,
            const Difference& difference) {
  using Value = decltype(get(samples.front()));
  std::vector<Value> result;
  const std::size_t n = samples.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i == 0 ? 0 : i - 1;
    const std::size_t b = i + 1 < n ? i + 1 : i;
    const double dt = samples[b].time - samples[a].time;
    result.push_back(Value(difference(get(samples[b]), get(samples[a])) / dt));
  }
  return result;
}

void differentiate_velocities(RobotTrajectory& trajectory) {
  const auto slope = slopes(
      trajectory.samples, [](const MotionSample& s) { return s.velocity; },
      [](const Vector2d& b, const Vector2d& a) { return Vector2d(b - a); });
  for (std::size_t i = 0; i < slope.size(); ++i) {
    trajectory.samples[i].acceleration = slope[i];
  }
}

void differentiate_places(RobotTrajectory& trajectory) {
  const auto slope = slopes(
      trajectory.samples, [](const MotionSample& s) { return s.pose.translation(); },
      [](const Vector2d& b, const Vector2d& a) { return Vector2d(b - a); });
  for (std::size_t i = 0; i < slope.size(); ++i) {
    trajectory.samples[i].velocity = slope[i];
  }
}

void differentiate_headings(RobotTrajectory& trajectory) {
  const auto slope = slopes(
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
    differentiate_velocities(result);
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
    differentiate_velocities(result);
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

std::vector<double> angular_accelerations(const RobotTrajectory& trajectory) {
  return slopes(
      trajectory.samples, [](const MotionSample& s) { return s.omega; },
      [](double b, double a) { return b - a; });
}

WpilibTrajectory to_wpilib_trajectory(const RobotTrajectory& trajectory) {
  constexpr double moving = 1e-6;  // m/s
  constexpr double per_degree = std::numbers::pi / 180.0;
  WpilibTrajectory file;
  double way = trajectory.samples.front().pose.angle();
  // Of a robot that starts from rest the way is that of the first sample that moves.
  for (const MotionSample& sample : trajectory.samples) {
    if (trajectory.holonomic && sample.velocity.norm() > moving) {
      way = std::atan2(sample.velocity(1), sample.velocity(0));
      break;
    }
  }
  for (const MotionSample& sample : trajectory.samples) {
    WpilibState state{.time = sample.time, .x = sample.pose.x(), .y = sample.pose.y()};
    if (!trajectory.holonomic) {
      const Vector2d forward(sample.pose.rotation().cos(), sample.pose.rotation().sin());
      state.angle = sample.pose.angle();
      state.velocity = sample.velocity.dot(forward);
      state.acceleration = sample.acceleration.dot(forward);
      state.curvature = std::abs(state.velocity) > moving ? sample.omega / state.velocity : 0.0;
    } else {
      const double speed = sample.velocity.norm();
      way = speed > moving ? std::atan2(sample.velocity(1), sample.velocity(0)) : way;
      const Vector2d along(std::cos(way), std::sin(way));
      const Vector2d across(-along(1), along(0));
      state.angle = way;
      state.velocity = speed;
      state.acceleration = sample.acceleration.dot(along);
      state.curvature = speed > moving ? sample.acceleration.dot(across) / (speed * speed) : 0.0;
      state.holonomic_rotation = sample.pose.angle() / per_degree;
      state.holonomic_angular_velocity = sample.omega / per_degree;
    }
    file.states.push_back(state);
  }
  return file;
}

namespace {

/// Headings that go on beyond π.
std::vector<double> continuous_headings(const RobotTrajectory& trajectory) {
  std::vector<double> headings;
  for (const MotionSample& sample : trajectory.samples) {
    const double angle = sample.pose.angle();
    headings.push_back(headings.empty()
                           ? angle
                           : headings.back() + std::remainder(angle - headings.back(), full_turn));
  }
  return headings;
}

ExpressedNumber expressed(double value, std::string_view unit) {
  return {value, fmt::format("{} {}", value, unit), {}};
}

}  // namespace

ChoreoTrajectory to_choreo_trajectory(const RobotTrajectory& trajectory, const std::string& name,
                                      const std::optional<ChoreoSides>& sides,
                                      const std::optional<ChoreoConfig>& config) {
  ChoreoTrajectory file;
  file.name = name;
  file.version = std::to_string(ChoreoTrajectory::newest);
  file.params.target_dt = {0.05, "0.05 s", {}};
  const std::vector<double> headings = continuous_headings(trajectory);
  for (const std::size_t i : {std::size_t{0}, trajectory.samples.size() - 1}) {
    ChoreoWaypoint waypoint;
    waypoint.x = expressed(trajectory.samples[i].pose.x(), "m");
    waypoint.y = expressed(trajectory.samples[i].pose.y(), "m");
    waypoint.heading = expressed(headings[i], "rad");
    waypoint.intervals = static_cast<int>(trajectory.samples.size()) - 1;
    file.params.waypoints.push_back(waypoint);
    file.trajectory.waypoints.push_back(trajectory.samples[i].time);
  }
  file.trajectory.config = config;
  file.trajectory.sample_type = sides ? "Differential" : "Swerve";
  file.trajectory.splits = {0};
  const std::vector<double> alpha = angular_accelerations(trajectory);
  const double half = sides ? 0.5 * sides->trackwidth : 0.0;
  for (std::size_t i = 0; i < trajectory.samples.size(); ++i) {
    const MotionSample& from = trajectory.samples[i];
    ChoreoSample sample{.time = from.time,
                        .x = from.pose.x(),
                        .y = from.pose.y(),
                        .heading = headings[i],
                        .omega = from.omega,
                        .alpha = alpha[i]};
    if (sides) {
      const Vector2d forward(from.pose.rotation().cos(), from.pose.rotation().sin());
      const double v = from.velocity.dot(forward);
      const double a = from.acceleration.dot(forward);
      sample.vl = v - half * from.omega;
      sample.vr = v + half * from.omega;
      sample.al = a - half * alpha[i];
      sample.ar = a + half * alpha[i];
      sample.fl = 0.0;
      sample.fr = 0.0;
    } else {
      sample.vx = from.velocity(0);
      sample.vy = from.velocity(1);
      sample.ax = from.acceleration(0);
      sample.ay = from.acceleration(1);
      sample.fx = std::array<double, 4>{};
      sample.fy = std::array<double, 4>{};
    }
    file.trajectory.samples.push_back(sample);
  }
  return file;
}

Expected<TimeSeries> to_table(const RobotTrajectory& trajectory) {
  std::vector<double> time;
  std::array<std::vector<double>, 10> columns;
  const std::vector<double> headings = continuous_headings(trajectory);
  const std::vector<double> alpha = angular_accelerations(trajectory);
  for (std::size_t i = 0; i < trajectory.samples.size(); ++i) {
    const MotionSample& sample = trajectory.samples[i];
    time.push_back(sample.time);
    const double speed = sample.velocity.norm();
    const double bend = speed > 1e-6 ? (sample.velocity(0) * sample.acceleration(1) -
                                        sample.velocity(1) * sample.acceleration(0)) /
                                           (speed * speed * speed)
                                     : 0.0;
    const double row[] = {sample.pose.x(),
                          sample.pose.y(),
                          headings[i],
                          sample.velocity(0),
                          sample.velocity(1),
                          sample.omega,
                          sample.acceleration(0),
                          sample.acceleration(1),
                          alpha[i],
                          bend};
    for (std::size_t k = 0; k < columns.size(); ++k) {
      columns[k].push_back(row[k]);
    }
  }
  TimeSeries table(std::move(time));
  constexpr std::array<std::pair<const char*, const char*>, 10> names{{{"x", "m"},
                                                                       {"y", "m"},
                                                                       {"heading", "rad"},
                                                                       {"vx", "m/s"},
                                                                       {"vy", "m/s"},
                                                                       {"omega", "rad/s"},
                                                                       {"ax", "m/s²"},
                                                                       {"ay", "m/s²"},
                                                                       {"alpha", "rad/s²"},
                                                                       {"curvature", "1/m"}}};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    FLYBALL_CHECK(table.add(names[k].first, names[k].second, std::move(columns[k])));
  }
  return table;
}

}  // namespace flyball
