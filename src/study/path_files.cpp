// Files of planning tools with the field turned or mirrored.
#include <algorithm>
#include <charconv>
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

void change_waypoints(const FieldChange& change, std::vector<ChoreoWaypoint>& waypoints) {
  for (ChoreoWaypoint& waypoint : waypoints) {
    change_place(change, waypoint.x, waypoint.y);
    set(waypoint.heading, change.heading(waypoint.heading.value), "rad");
  }
}

void change_parameters(const FieldChange& change, ChoreoParameters& parameters) {
  change_waypoints(change, parameters.waypoints);
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

void change_samples(const FieldChange& change, std::vector<ChoreoSample>& samples) {
  const bool mirrored = change.hand() < 0.0;
  for (ChoreoSample& sample : samples) {
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
  change.turn = change.sx < 0.0 ? pi : 0.0;
  return change;
}

double FieldChange::heading(double theta) const {
  return hand() * theta + turn;
}

FieldChange FieldChange::facing(double first) const {
  FieldChange change = *this;
  if (sx < 0.0) {
    change.turn = hand() > 0.0 && std::remainder(first, full_turn) > 0.0 ? -pi : pi;
  }
  return change;
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

ChoreoPath2024 changed(ChoreoPath2024 path, const FieldChange& any) {
  const FieldChange change = !path.trajectory.empty()  ? any.facing(path.trajectory.front().heading)
                             : !path.waypoints.empty() ? any.facing(path.waypoints[0].heading.value)
                                                       : any;
  for (std::vector<ChoreoWaypoint>* waypoints : {&path.waypoints, &path.trajectory_waypoints}) {
    change_waypoints(change, *waypoints);
  }
  change_samples(change, path.trajectory);
  return path;
}

ChoreoParameters changed(ChoreoParameters parameters, const FieldChange& change) {
  change_parameters(change, parameters);
  return parameters;
}

ChoreoParameters reversed(ChoreoParameters parameters) {
  std::vector<ChoreoWaypoint>& waypoints = parameters.waypoints;
  const std::size_t n = waypoints.size();
  std::vector<std::pair<int, bool>> intervals;  // until the next waypoint; the last's say nothing
  for (const ChoreoWaypoint& waypoint : waypoints) {
    intervals.emplace_back(waypoint.intervals, waypoint.override_intervals);
  }
  std::reverse(waypoints.begin(), waypoints.end());
  for (std::size_t i = 0; i < n; ++i) {
    const auto& [count, overridden] = intervals[i + 1 < n ? n - 2 - i : n - 1];
    waypoints[i].intervals = count;
    waypoints[i].override_intervals = overridden;
  }
  const auto other = [&](const std::string& id) -> std::string {
    if (id == "first" || id == "last") {
      return id == "first" ? "last" : "first";
    }
    std::size_t index = 0;
    const auto [end, problem] = std::from_chars(id.data(), id.data() + id.size(), index);
    return problem == std::errc() && end == id.data() + id.size() && index < n
               ? std::to_string(n - 1 - index)
               : id;
  };
  for (ChoreoConstraint& constraint : parameters.constraints) {
    constraint.from = other(constraint.from);
    if (constraint.to) {
      constraint.from = std::exchange(*constraint.to, constraint.from);
      constraint.from = other(constraint.from);
    }
  }
  return parameters;
}

std::vector<ChoreoEvent> reversed(std::vector<ChoreoEvent> events, double duration,
                                  std::size_t waypoints, bool is_2024) {
  for (ChoreoEvent& event : events) {
    if (event.target && *event.target >= 0 && static_cast<std::size_t>(*event.target) < waypoints) {
      event.target = static_cast<int>(waypoints) - 1 - *event.target;
    }
    if (event.target_timestamp) {
      event.target_timestamp = duration - *event.target_timestamp;
    }
    if (!is_2024 && event.offset.value != 0.0) {
      set(event.offset, -event.offset.value, "s");
    }
  }
  return events;
}

ChoreoTrajectory reversed(ChoreoTrajectory file) {
  file.params = reversed(std::move(file.params));
  if (file.snapshot) {
    file.snapshot = reversed(*std::move(file.snapshot));
  }
  ChoreoGenerated& made = file.trajectory;
  const double start = made.samples.empty() ? 0.0 : made.samples.front().time;
  const double end = made.samples.empty() ? 0.0 : made.samples.back().time;
  std::reverse(made.samples.begin(), made.samples.end());
  for (ChoreoSample& sample : made.samples) {
    sample.time = start + (end - sample.time);
    // Of q(T - t) the velocities are -q̇, the accelerations, and so the forces, q̈.
    for (std::optional<double>* rate :
         {&sample.vx, &sample.vy, &sample.vl, &sample.vr, &sample.omega}) {
      if (*rate) {
        **rate = 0.0 - **rate;
      }
    }
  }
  std::reverse(made.waypoints.begin(), made.waypoints.end());
  for (double& time : made.waypoints) {
    time = start + (end - time);
  }
  // Each part but the first begins where the one before it ended.
  const int last = static_cast<int>(made.samples.size()) - 1;
  std::vector<int> splits;
  for (const int split : made.splits) {
    splits.push_back(split == 0 ? 0 : last - split);
  }
  std::sort(splits.begin(), splits.end());
  made.splits = splits;
  file.events =
      reversed(std::move(file.events), start + end, file.params.waypoints.size(), file.is_2024);
  return file;
}

namespace {

/// Whether an object's velocities are of the robot's frame: that in which the poses move.
bool speeds_of_robot(const std::vector<WpilibState>& states) {
  double robot = 0.0;
  double field = 0.0;
  for (std::size_t i = 0; i + 1 < states.size(); ++i) {
    const WpilibState& a = states[i];
    const WpilibState& b = states[i + 1];
    const double half = 0.5 * (b.time - a.time);
    const Vector2d moved(b.x - a.x, b.y - a.y);
    const Vector2d va(a.speeds.vx, a.speeds.vy);
    const Vector2d vb(b.speeds.vx, b.speeds.vy);
    field += (moved - half * (va + vb)).squaredNorm();
    robot += (moved - half * (Rotation2d(a.angle) * va + Rotation2d(b.angle) * vb)).squaredNorm();
  }
  return robot <= field;
}

}  // namespace

WpilibTrajectory changed(WpilibTrajectory file, const FieldChange& any) {
  const FieldChange change = file.states.empty() ? any : any.facing(file.states.front().angle);
  const double hand = change.hand();
  const bool of_robot = file.is_object && speeds_of_robot(file.states);
  const Vector2d factor = of_robot ? Vector2d(1.0, hand) : Vector2d(change.sx, change.sy);
  for (WpilibState& state : file.states) {
    const Vector2d p = change.place({state.x, state.y});
    state.x = p(0);
    state.y = p(1);
    state.angle = change.heading(state.angle);
    state.curvature *= hand;
    const auto by_hand = [&](std::optional<double>& value) {
      if (value) {
        *value *= hand;
      }
    };
    if (state.holonomic_rotation) {
      state.holonomic_rotation = degrees(change, *state.holonomic_rotation);
    }
    by_hand(state.holonomic_angular_velocity);
    by_hand(state.angular_velocity);
    state.speeds.vx *= factor(0);
    state.speeds.vy *= factor(1);
    state.speeds.omega *= hand;
    if (state.accelerations) {
      state.accelerations->ax *= factor(0);
      state.accelerations->ay *= factor(1);
      state.accelerations->alpha *= hand;
    }
    if (hand < 0.0) {
      std::swap(state.left_velocity, state.right_velocity);
    }
  }
  return file;
}

WpilibTrajectory reversed(WpilibTrajectory file) {
  if (file.states.empty()) {
    return file;
  }
  const double whole = file.states.front().time + file.states.back().time;
  file.states = std::vector<WpilibState>(file.states.rbegin(), file.states.rend());
  for (WpilibState& state : file.states) {
    state.time = whole - state.time;
    // Along the same way with -v: ω = v κ turns round with it, v̇ and κ stay.
    for (double* rate :
         {&state.velocity, &state.speeds.vx, &state.speeds.vy, &state.speeds.omega}) {
      *rate = 0.0 - *rate;
    }
    for (std::optional<double>* rate : {&state.holonomic_angular_velocity, &state.angular_velocity,
                                        &state.left_velocity, &state.right_velocity}) {
      if (*rate) {
        **rate = 0.0 - **rate;
      }
    }
  }
  return file;
}

ChoreoTrajectory changed(ChoreoTrajectory file, const FieldChange& any) {
  const FieldChange change =
      !file.trajectory.samples.empty() ? any.facing(file.trajectory.samples.front().heading)
      : !file.params.waypoints.empty() ? any.facing(file.params.waypoints.front().heading.value)
                                       : any;
  change_parameters(change, file.params);
  if (file.snapshot) {
    change_parameters(change, *file.snapshot);
  }
  change_samples(change, file.trajectory.samples);
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
    } else if (path.preview_starting_state && path.goal_end_state) {
      std::swap(path.preview_starting_state->rotation, path.goal_end_state->rotation);
    }
    path.reversed = !path.reversed;
  }
  return path;
}

}  // namespace flyball::study
