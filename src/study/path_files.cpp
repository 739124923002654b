// Files of planning tools with the field turned or mirrored.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

/// A number with the expression that says it.
void set(ExpressedNumber& number, double value, std::string_view unit) {
  number.expression = number.expression.empty() ? "" : fmt::format("{} {}", value, unit);
  number.value = value;
}

void change_place(const FieldChange& change, ExpressedNumber& x, ExpressedNumber& y) {
  const Vector2d p = change.place({x.value, y.value});
  if (p(0) != x.value) {
    set(x, p(0), "m");
  }
  if (p(1) != y.value) {
    set(y, p(1), "m");
  }
}

void change_parameters(const FieldChange& change, ChoreoParameters& parameters) {
  for (ChoreoWaypoint& waypoint : parameters.waypoints) {
    change_place(change, waypoint.x, waypoint.y);
    set(waypoint.heading, change.heading(waypoint.heading.value), "rad");
  }
  for (ChoreoConstraint& constraint : parameters.constraints) {
    const auto prop = [&](std::string_view name) -> ExpressedNumber* {
      const auto found =
          std::find_if(constraint.props.begin(), constraint.props.end(),
                       [&](const NamedNumber& number) { return number.name == name; });
      return found == constraint.props.end() ? nullptr : &found->number;
    };
    ExpressedNumber* const x = prop("x");
    ExpressedNumber* const y = prop("y");
    if (x == nullptr || y == nullptr) {
      continue;
    }
    change_place(change, *x, *y);
    // Of a rectangle it is the corner with the least coordinates.
    if (const ExpressedNumber* w = prop("w"); w != nullptr && change.sx < 0.0) {
      set(*x, x->value - w->value, "m");
    }
    if (const ExpressedNumber* h = prop("h"); h != nullptr && change.sy < 0.0) {
      set(*y, y->value - h->value, "m");
    }
  }
}

double degrees(const FieldChange& change, double angle) {
  double turned = angle;
  turned = change.hand() * turned + (change.sx < 0.0 ? 180.0 : 0.0);
  return std::remainder(turned, 360.0);
}

void change_point(const FieldChange& change, PlannerPoint& point) {
  const Vector2d p = change.place({point.x, point.y});
  point.x = p(0);
  point.y = p(1);
}

}  // namespace

FieldChange FieldChange::of(const PathJob& job) {
  FieldChange change;
  change.sx = (job.flip ? -1.0 : 1.0) * (job.mirror ? -1.0 : 1.0);
  change.sy = (job.flip ? -1.0 : 1.0) * (job.mirror_sides ? -1.0 : 1.0);
  change.ox = change.sx < 0.0 ? job.field_length.si() : 0.0;
  change.oy = change.sy < 0.0 ? job.field_width.si() : 0.0;
  return change;
}

double FieldChange::heading(double theta) const {
  return hand() * theta + (sx < 0.0 ? pi : 0.0);
}

RobotTrajectory changed(RobotTrajectory trajectory, const FieldChange& change) {
  for (MotionSample& sample : trajectory.samples) {
    const Vector2d p = change.place(sample.pose.translation());
    sample.pose = Pose2d(p(0), p(1), change.heading(sample.pose.angle()));
    sample.velocity = change.vector(sample.velocity);
    sample.acceleration = change.vector(sample.acceleration);
    sample.omega *= change.hand();
  }
  return trajectory;
}

RobotTrajectory reversed(const RobotTrajectory& trajectory) {
  RobotTrajectory back = trajectory;
  std::reverse(back.samples.begin(), back.samples.end());
  for (MotionSample& sample : back.samples) {
    sample.time = trajectory.duration() - sample.time;
    sample.velocity = -sample.velocity;
    sample.omega = -sample.omega;
  }
  return back;
}

ChoreoTrajectory changed(ChoreoTrajectory file, const FieldChange& change) {
  change_parameters(change, file.params);
  if (file.snapshot) {
    change_parameters(change, *file.snapshot);
  }
  const bool mirrored = change.hand() < 0.0;
  for (ChoreoSample& sample : file.trajectory.samples) {
    const Vector2d p = change.place({sample.x, sample.y});
    sample.x = p(0);
    sample.y = p(1);
    sample.heading = change.heading(sample.heading);
    const auto by = [](std::optional<double>& value, double factor) {
      if (value) {
        *value *= factor;
      }
    };
    by(sample.vx, change.sx);
    by(sample.vy, change.sy);
    by(sample.ax, change.sx);
    by(sample.ay, change.sy);
    by(sample.omega, change.hand());
    by(sample.alpha, change.hand());
    for (const auto& [forces, factor] :
         {std::pair(&sample.fx, change.sx), {&sample.fy, change.sy}}) {
      if (*forces) {
        for (double& force : **forces) {
          force *= factor;
        }
        if (mirrored) {  // left and right modules
          std::swap((**forces)[0], (**forces)[1]);
          std::swap((**forces)[2], (**forces)[3]);
        }
      }
    }
    if (mirrored) {
      std::swap(sample.vl, sample.vr);
      std::swap(sample.al, sample.ar);
      std::swap(sample.fl, sample.fr);
    }
  }
  return file;
}

PathPlannerPath changed(PathPlannerPath path, const FieldChange& change, bool reverse) {
  if (!change.none()) {
    for (PathPlannerWaypoint& waypoint : path.waypoints) {
      change_point(change, waypoint.anchor);
      for (std::optional<PlannerPoint>* control :
           {&waypoint.previous_control, &waypoint.next_control}) {
        if (*control) {
          change_point(change, **control);
        }
      }
      waypoint.linked_name.reset();  // it is no longer where the others of its name are
      if (waypoint.holonomic_angle) {
        *waypoint.holonomic_angle = degrees(change, *waypoint.holonomic_angle);
      }
    }
    for (PathPlannerRotation& target : path.rotation_targets) {
      target.degrees = degrees(change, target.degrees);
    }
    for (PathPlannerPointing& pointing : path.pointing) {
      change_point(change, pointing.place);
      pointing.rotation_offset *= change.hand();
    }
    for (std::optional<PathPlannerState>* state :
         {&path.goal_end_state, &path.ideal_starting_state, &path.preview_starting_state}) {
      if (*state) {
        (*state)->rotation = degrees(change, (*state)->rotation);
      }
    }
  }
  if (reverse) {
    const double last = static_cast<double>(path.waypoints.size()) - 1.0;
    std::reverse(path.waypoints.begin(), path.waypoints.end());
    for (PathPlannerWaypoint& waypoint : path.waypoints) {
      std::swap(waypoint.previous_control, waypoint.next_control);
    }
    for (PathPlannerRotation& target : path.rotation_targets) {
      target.position = last - target.position;
    }
    for (PathPlannerMarker& marker : path.markers) {
      marker.position = last - marker.position;
      if (marker.end_position) {
        const double end = last - *marker.end_position;
        marker.end_position = marker.position;
        marker.position = end;
      }
    }
    for (PathPlannerZone& zone : path.zones) {
      zone.from = last - std::exchange(zone.to, last - zone.from);
    }
    for (PathPlannerPointing& zone : path.pointing) {
      zone.from = last - std::exchange(zone.to, last - zone.from);
    }
    if (path.ideal_starting_state && path.goal_end_state) {
      std::swap(path.ideal_starting_state->velocity, path.goal_end_state->velocity);
      std::swap(path.ideal_starting_state->rotation, path.goal_end_state->rotation);
    }
    path.reversed = !path.reversed;
  }
  return path;
}

}  // namespace flyball::study
