// Paths of planning tools as segments, headings and limits.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr double none = std::numeric_limits<double>::infinity();

SplineSegment bezier(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  SplineSegment::Coefficients of = SplineSegment::Coefficients::Zero();
  of.col(0) = a;
  of.col(1) = 3.0 * (b - a);
  of.col(2) = 3.0 * (a - 2.0 * b + c);
  of.col(3) = d - a + 3.0 * (b - c);
  return SplineSegment(of);
}

Vector2d of(const PlannerPoint& point) {
  return {point.x, point.y};
}

/// @param unlimited  Only the robot limits it.
RouteLimits limits_of(const PathPlannerConstraints& from) {
  if (from.unlimited.value_or(false)) {
    return {none, none, none, none, none};
  }
  return {.velocity = from.max_velocity,
          // A module's force does not know along from across.
          .acceleration = from.max_acceleration,
          .centripetal = none,
          .angular_velocity = one_degree * from.max_angular_velocity,
          .angular_acceleration = one_degree * from.max_angular_acceleration,
          .place = from.origin.place()};
}

}  // namespace

Expected<RouteShape> shape_of(const PathPlannerPath& path, const std::string& source,
                              bool holonomic) {
  RouteShape shape{.source = source, .limits = limits_of(path.constraints)};
  shape.diagnostics = path.diagnostics;
  if (path.waypoints.size() < 2) {
    return refusal(ArgumentError::empty, source, "the path")
        .got(fmt::format("of {} waypoints", path.waypoints.size()))
        .expected("two or more");
  }
  for (std::size_t i = 0; i + 1 < path.waypoints.size(); ++i) {
    const PathPlannerWaypoint& a = path.waypoints[i];
    const PathPlannerWaypoint& b = path.waypoints[i + 1];
    const auto control = [&](const std::optional<PlannerPoint>& said, const Vector2d& anchor,
                             std::size_t waypoint) {
      if (!said) {
        warn(shape.diagnostics, "control_missing",
             "waypoint {} has no control point where the path goes through: its anchor stands for "
             "it",
             waypoint + 1);
      }
      return said ? of(*said) : anchor;
    };
    const Vector2d from = of(a.anchor);
    const Vector2d to = of(b.anchor);
    shape.segments.push_back(
        bezier(from, control(a.next_control, from, i), control(b.previous_control, to, i + 1), to));
  }
  const double last = static_cast<double>(path.waypoints.size() - 1);
  if (path.is_2023) {
    shape.limits = limits_of(PathPlannerConstraints{});
    shape.limits.velocity = path.max_velocity.value_or(shape.limits.velocity);
    shape.limits.acceleration = path.max_acceleration.value_or(shape.limits.acceleration);
    for (std::size_t i = 0; i < path.waypoints.size(); ++i) {
      const PathPlannerWaypoint& waypoint = path.waypoints[i];
      const double at = static_cast<double>(i);
      if (waypoint.is_stop_point.value_or(false) || waypoint.is_reversal.value_or(false)) {
        shape.stops.push_back(at);
      }
      if (holonomic && waypoint.holonomic_angle) {
        shape.headings.push_back({at, one_degree * *waypoint.holonomic_angle});
      }
      if (waypoint.velocity_override && *waypoint.velocity_override > 0.0) {
        RouteLimits limits{none, none, none, none, none};
        limits.velocity = *waypoint.velocity_override;
        shape.zones.push_back({at, at, limits, "override"});
      }
    }
    shape.reversed = path.reversed;
    return shape;
  }
  for (const PathPlannerZone& zone : path.zones) {
    shape.zones.push_back({zone.from, zone.to, limits_of(zone.constraints), zone.name});
  }
  if (path.ideal_starting_state) {
    shape.start_velocity = path.ideal_starting_state->velocity;
  }
  if (path.goal_end_state) {
    shape.end_velocity = path.goal_end_state->velocity;
  }
  shape.reversed = path.reversed;
  if (!holonomic) {
    return shape;
  }
  const std::optional<PathPlannerState>& start =
      path.ideal_starting_state ? path.ideal_starting_state : path.preview_starting_state;
  const double goal = path.goal_end_state ? path.goal_end_state->rotation : 0.0;
  shape.headings.push_back({0.0, one_degree * (start ? start->rotation : goal)});
  for (const PathPlannerRotation& target : path.rotation_targets) {
    shape.headings.push_back({std::clamp(target.position, 0.0, last), one_degree * target.degrees});
  }
  std::stable_sort(
      shape.headings.begin(), shape.headings.end(),
      [](const RouteHeading& a, const RouteHeading& b) { return a.position < b.position; });
  shape.headings.push_back({last, one_degree * goal});
  for (const PathPlannerPointing& pointing : path.pointing) {
    shape.pointing.push_back({std::clamp(pointing.from, 0.0, last),
                              std::clamp(pointing.to, 0.0, last), of(pointing.place),
                              one_degree * pointing.rotation_offset});
  }
  return shape;
}

Expected<RouteShape> shape_of(const ChoreoTrajectory& trajectory, const std::string& source) {
  RouteShape shape{.source = source, .limits = limits_of(PathPlannerConstraints{})};
  shape.diagnostics = trajectory.diagnostics;
  const std::vector<ChoreoWaypoint>& waypoints = trajectory.params.waypoints;
  std::vector<Vector2d> points;
  for (const ChoreoWaypoint& waypoint : waypoints) {
    points.emplace_back(waypoint.x.value, waypoint.y.value);
  }
  if (points.size() < 2) {
    return refusal(ArgumentError::empty, source, "the trajectory")
        .got(fmt::format("of {} waypoints, and without samples", points.size()))
        .expected("two waypoints or more");
  }
  const auto toward = [&](std::size_t from, std::size_t to) {
    const Vector2d d = points[to] - points[from];
    return std::atan2(d(1), d(0));
  };
  const std::size_t last = points.size() - 1;
  FLYBALL_TRY(shape.segments,
              cubic_spline(Pose2d(points[0](0), points[0](1), toward(0, 1)),
                           std::span(points).subspan(1, last - 1),
                           Pose2d(points[last](0), points[last](1), toward(last - 1, last))));
  for (std::size_t i = 0; i <= last; ++i) {
    if (waypoints[i].fix_heading) {
      shape.headings.push_back({static_cast<double>(i), waypoints[i].heading.value});
    }
  }
  if (trajectory.differential()) {
    shape.headings.clear();
  }
  const auto index_of = [&](const std::string& id) {
    if (id == "first") {
      return 0.0;
    }
    const double at = id == "last" ? static_cast<double>(last) : std::atof(id.c_str());
    return std::clamp(at, 0.0, static_cast<double>(last));
  };
  std::size_t left_out = 0;
  for (const ChoreoConstraint& constraint : trajectory.params.constraints) {
    if (!constraint.enabled) {
      continue;
    }
    const double from = index_of(constraint.from);
    const double to = constraint.to ? index_of(*constraint.to) : from;
    RouteLimits limits{none, none, none, none, none};
    const double most = constraint.prop("max").value_or(none);
    if (constraint.type == "StopPoint") {
      shape.stops.push_back(from);
      continue;
    }
    if (constraint.type == "MaxVelocity") {
      limits.velocity = most;
    } else if (constraint.type == "MaxAcceleration") {
      limits.acceleration = most;
    } else if (constraint.type == "MaxAngularVelocity") {
      limits.angular_velocity = most;
    } else {
      ++left_out;
      continue;
    }
    if (most > 0.0) {
      shape.zones.push_back({from, to, limits, constraint.type});
    }
  }
  note(shape.diagnostics, "waypoints_alone",
       "the file has no samples: a spline through its waypoints takes their place, which is not "
       "the path that Choreo would find");
  if (left_out > 0) {
    warn(shape.diagnostics, "constraints_left_out",
         "{} of its constraints {} the path's shape, and {} left out", left_out,
         left_out == 1 ? "is about" : "are about", left_out == 1 ? "is" : "are");
  }
  return shape;
}

Expected<RouteShape> shape_of(const RobotTrajectory& trajectory) {
  RouteShape shape{.source = trajectory.source, .limits = {none, none, none, none, none}};
  // Points at even distances along it, as straight as its samples are between.
  std::vector<double> lengths{0.0};
  for (std::size_t i = 1; i < trajectory.samples.size(); ++i) {
    lengths.push_back(lengths.back() + (trajectory.samples[i].pose.translation() -
                                        trajectory.samples[i - 1].pose.translation())
                                           .norm());
  }
  const double total = lengths.back();
  constexpr double spacing = 0.15;  // m
  constexpr double least = 0.01;    // m
  if (!(total > least)) {
    return refusal(ArgumentError::out_of_range, trajectory.source, "the trajectory")
        .got(fmt::format("{} m long", format_number(total, 3)))
        .expected("one that goes somewhere, to be timed anew");
  }
  const auto count = static_cast<std::size_t>(std::clamp(std::ceil(total / spacing), 2.0, 5000.0));
  std::vector<Vector2d> points;
  double previous = trajectory.samples.front().pose.angle();
  for (std::size_t k = 0; k <= count; ++k) {
    const double s = total * static_cast<double>(k) / static_cast<double>(count);
    const auto next = std::lower_bound(lengths.begin() + 1, lengths.end(), s);
    const auto i = std::min(static_cast<std::size_t>(next - lengths.begin()), lengths.size() - 1);
    const double gap = lengths[i] - lengths[i - 1];
    const double share = gap > 0.0 ? std::clamp((s - lengths[i - 1]) / gap, 0.0, 1.0) : 0.0;
    const MotionSample& a = trajectory.samples[i - 1];
    const MotionSample& b = trajectory.samples[i];
    // Between two samples the cubic of their velocities: chords would be corners.
    const SplineSegment between =
        cubic_hermite({a.pose.translation(), (b.time - a.time) * a.velocity, {}},
                      {b.pose.translation(), (b.time - a.time) * b.velocity, {}});
    points.push_back(between.at(share).position);
    if (trajectory.holonomic) {
      const double angle = a.pose.interpolate(b.pose, share).angle();
      previous += std::remainder(angle - previous, 2.0 * std::numbers::pi);
      shape.headings.push_back({static_cast<double>(k), previous});
    }
  }
  const auto way = [&](std::size_t from, std::size_t to) {
    const Vector2d d = points[to] - points[from];
    return std::atan2(d(1), d(0));
  };
  FLYBALL_TRY(shape.segments,
              cubic_spline(Pose2d(points.front()(0), points.front()(1), way(0, 1)),
                           std::span(points).subspan(1, count - 1),
                           Pose2d(points.back()(0), points.back()(1), way(count - 1, count))));
  shape.reversed =
      !trajectory.holonomic && trajectory.at(0.5 * trajectory.duration()).forward() < 0.0;
  shape.dense_headings = trajectory.holonomic;
  return shape;
}

}  // namespace flyball::study
