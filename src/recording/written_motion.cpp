// Motions as files of planning tools.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <flyball/recording/motion_file.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "recording/finish_trajectory.hpp"
#include "recording/slopes.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;

}  // namespace

void recording::differentiate_velocities(RobotTrajectory& trajectory) {
  const auto slope = recording::slopes(
      trajectory.samples, [](const MotionSample& s) { return s.velocity; },
      [](const Vector2d& b, const Vector2d& a) { return Vector2d(b - a); });
  for (std::size_t i = 0; i < slope.size(); ++i) {
    trajectory.samples[i].acceleration = slope[i];
  }
}

std::vector<double> angular_accelerations(const RobotTrajectory& trajectory) {
  return recording::slopes(
      trajectory.samples, [](const MotionSample& s) { return s.omega; },
      [](double b, double a) { return b - a; });
}

namespace {

/// A velocity below which what it is divided by says nothing, m/s.
constexpr double moving = 1e-4;

bool moves(const MotionSample& sample) {
  return sample.velocity.norm() > moving;
}

/// Curvatures where it stands, or all but does, are those of the nearest sample in time that moves:
/// the curvature is the path's, which goes on.
void fill_stops(const std::vector<MotionSample>& samples, std::vector<double>& bends) {
  const std::size_t n = samples.size();
  std::size_t before = n;  // the last that moves; none yet
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (moves(samples[i])) {
      before = i;
      continue;
    }
    next = std::max(next, i);
    while (next < n && !moves(samples[next])) {
      ++next;
    }
    const bool ahead = next < n && (before == n || samples[next].time - samples[i].time <
                                                       samples[i].time - samples[before].time);
    bends[i] = ahead ? bends[next] : before < n ? bends[before] : 0.0;
  }
}

/// 1/m at each sample, of the way over the ground: (v × a)/|v|³.
std::vector<double> way_curvatures(const std::vector<MotionSample>& samples) {
  std::vector<double> bends;
  for (const MotionSample& sample : samples) {
    const Vector2d& v = sample.velocity;
    const Vector2d& a = sample.acceleration;
    bends.push_back(moves(sample) ? (v(0) * a(1) - v(1) * a(0)) / (v.squaredNorm() * v.norm())
                                  : 0.0);
  }
  fill_stops(samples, bends);
  return bends;
}

}  // namespace

WpilibTrajectory to_wpilib_trajectory(const RobotTrajectory& trajectory) {
  constexpr double per_degree = std::numbers::pi / 180.0;
  WpilibTrajectory file;
  std::vector<double> bends = way_curvatures(trajectory.samples);
  if (!trajectory.holonomic) {  // of one that backs ω/v has the other sign
    for (std::size_t i = 0; i < bends.size(); ++i) {
      const MotionSample& sample = trajectory.samples[i];
      bends[i] = std::abs(sample.forward()) > moving ? sample.omega / sample.forward() : 0.0;
    }
    fill_stops(trajectory.samples, bends);
  }
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
    state.curvature = bends[file.states.size()];
    if (!trajectory.holonomic) {
      const Vector2d forward(sample.pose.rotation().cos(), sample.pose.rotation().sin());
      state.angle = sample.pose.angle();
      state.velocity = sample.velocity.dot(forward);
      state.acceleration = sample.acceleration.dot(forward);
    } else {
      const double speed = sample.velocity.norm();
      way = speed > moving ? std::atan2(sample.velocity(1), sample.velocity(0)) : way;
      const Vector2d along(std::cos(way), std::sin(way));
      state.angle = way;
      state.velocity = speed;
      state.acceleration = sample.acceleration.dot(along);
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
  const std::vector<double> bends = way_curvatures(trajectory.samples);
  std::array<std::vector<double>, 10> columns;
  const std::vector<double> headings = continuous_headings(trajectory);
  const std::vector<double> alpha = angular_accelerations(trajectory);
  for (std::size_t i = 0; i < trajectory.samples.size(); ++i) {
    const MotionSample& sample = trajectory.samples[i];
    time.push_back(sample.time);
    const double row[] = {sample.pose.x(),
                          sample.pose.y(),
                          headings[i],
                          sample.velocity(0),
                          sample.velocity(1),
                          sample.omega,
                          sample.acceleration(0),
                          sample.acceleration(1),
                          alpha[i],
                          bends[i]};
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
