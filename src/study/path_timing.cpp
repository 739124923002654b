// Times along a path.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/planning/path/edit_path.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "study/path_geometry.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

TravelLimits travel(const RouteLimits& limits) {
  return {.velocity = limits.velocity,
          .centripetal = limits.centripetal,
          .total_acceleration = limits.acceleration,
          .angular_velocity = limits.angular_velocity,
          .angular_acceleration = limits.angular_acceleration,
          .total_jerk = limits.jerk};
}

/// What the robot's motors, wheels and grip limit.
PathConstraint drive_of(const DriveRobot& robot, double voltage) {
  const DriveLimits limits{.body = {.mass = Mass(robot.mass),
                                    .moment_of_inertia = MomentOfInertia(robot.moment_of_inertia)},
                           .shaft = {.motor = robot.motor,
                                     .gearing = robot.gearing,
                                     .moment_of_inertia = MomentOfInertia(robot.wheel_inertia)},
                           .wheel_radius = Length(robot.wheel_radius),
                           .voltage = voltage,
                           .current = robot.stator_limit,
                           .wheel_speed = robot.free_speed(voltage),
                           .grip = robot.grip};
  if (robot.kind == DriveKind::differential) {
    return DifferentialDriveLimits{limits, Length(robot.trackwidth)};
  }
  const std::vector<Vector2d> modules(robot.modules.begin(), robot.modules.end());
  if (robot.kind == DriveKind::mecanum) {
    return MecanumDriveLimits{limits, modules};
  }
  return SwerveDriveLimits{limits, modules};
}

/// The limits of a part of the path, its parameter from 0.
std::vector<PathConstraint> constraints_of(const RouteShape& shape, const RoutePath& route,
                                           const std::pair<double, double>& part,
                                           const std::optional<DriveRobot>& robot, double voltage) {
  std::vector<PathConstraint> all{travel(shape.limits)};
  const double length = part.second - part.first;
  for (const RouteZone& zone : shape.zones) {
    const double from = route.parameter(zone.from) - part.first;
    const double to = route.parameter(zone.to) - part.first;
    if (to >= 0.0 && from <= length) {
      all.push_back(StretchLimits{std::max(0.0, from), std::min(length, to), travel(zone.limits),
                                  zone.name.empty() ? "a zone" : zone.name});
    }
  }
  if (robot) {
    all.push_back(drive_of(*robot, voltage));
  }
  return all;
}

Expected<void> check_limits(const RouteShape& shape) {
  const auto check = [&](const RouteLimits& limits, const std::string& of) -> Expected<void> {
    for (const auto& [value, name] :
         {std::pair(limits.velocity, "the velocity limit"),
          {limits.acceleration, "the acceleration limit"},
          {limits.centripetal, "the centripetal limit"},
          {limits.angular_velocity, "the angular velocity limit"},
          {limits.angular_acceleration, "the angular acceleration limit"}}) {
      if (!(value > 0.0)) {
        const std::string where =
            limits.place.line > 0
                ? fmt::format("{}:{}:{}", shape.source, limits.place.line, limits.place.column)
                : shape.source;
        return refusal(ArgumentError::not_positive, where, name + of)
            .got(format_number(value))
            .expected("positive");
      }
    }
    return {};
  };
  FLYBALL_CHECK(check(shape.limits, ""));
  for (const RouteZone& zone : shape.zones) {
    if (!(zone.from <= zone.to)) {
      const Place& place = zone.limits.place;
      return refusal(ArgumentError::out_of_range,
                     place.line > 0
                         ? fmt::format("{}:{}:{}", shape.source, place.line, place.column)
                         : shape.source,
                     fmt::format("the zone \"{}\"", zone.name))
          .got(fmt::format("from {} to {}", format_number(zone.from), format_number(zone.to)))
          .expected("from a place of the path to one that is not before it");
    }
    FLYBALL_CHECK(check(zone.limits, fmt::format(" of the zone \"{}\"", zone.name)));
  }
  return {};
}

/// Which way a robot looks that looks where it goes: it goes on in the direction in which it
/// looks, or backs after a cusp.
class FacingHeading {
 public:
  explicit FacingHeading(bool reversed) : offset_(reversed ? pi : 0.0) {}

  void begin_part(double way) {
    if (begun_) {
      const double step = std::remainder(way - heading_, full_turn);
      offset_ = std::abs(step) > 0.5 * pi ? pi : 0.0;
    }
  }
  double at(double way) {
    begun_ = true;
    heading_ = way + offset_;
    return heading_;
  }

 private:
  double offset_;
  double heading_ = 0.0;
  bool begun_ = false;
};

/// Even times of a part's motion. @param rests  Whether it does at its start, at its end.
void sample_part(const PathTrajectory& motion, double start, double step,
                 const std::pair<bool, bool>& rests, FacingHeading& facing,
                 std::vector<MotionSample>& samples) {
  const Path& path = motion.path();
  const bool looks_elsewhere = path.coordinates() == 3;
  const double total = motion.total_time();
  const auto count = static_cast<std::size_t>(std::max(2.0, std::ceil(total / step)));
  facing.begin_part(travel_heading(path.at(0.0)));
  for (std::size_t k = samples.empty() ? 0 : 1; k <= count; ++k) {
    const PathSample at =
        motion.sample(total * static_cast<double>(k) / static_cast<double>(count));
    const PathState state = path.at(at.parameter);
    const double way = travel_heading(state);
    MotionSample sample{.time = start + at.time};
    sample.pose =
        Pose2d(at.position(0), at.position(1), looks_elsewhere ? at.position(2) : facing.at(way));
    sample.velocity = at.velocity.head<2>();
    sample.acceleration = at.acceleration.head<2>();
    if (looks_elsewhere) {
      sample.omega = at.velocity(2);
    } else {
      const double bend = planar_curvature(state);
      sample.omega = std::isfinite(bend) ? sample.velocity.norm() * bend : 0.0;
    }
    if ((k == 0 && rests.first) || (k == count && rests.second)) {  // not to rounding
      sample.velocity.setZero();
      sample.omega = 0.0;
    }
    samples.push_back(sample);
  }
}

/// When a place of the shape is reached: s(t) does not fall, so that halves find it.
double time_at(const std::vector<PathTrajectory>& motions, const RoutePath& route, double place) {
  const double parameter = route.parameter(place);
  double start = 0.0;
  for (std::size_t p = 0; p < motions.size(); ++p) {
    const auto& part = route.parts[p];
    if (parameter > part.second && p + 1 < motions.size()) {
      start += motions[p].total_time();
      continue;
    }
    double low = 0.0;
    double high = motions[p].total_time();
    // At rest the place says little of the time.
    if (parameter <= part.first || parameter >= part.second) {
      return start + (parameter <= part.first ? low : high);
    }
    constexpr int halves = 60;
    for (int i = 0; i < halves && low < high; ++i) {
      const double middle = 0.5 * (low + high);
      (part.first + motions[p].sample(middle).parameter < parameter ? low : high) = middle;
    }
    return start + high;
  }
  return start;
}

}  // namespace

Expected<TimedRoute> time_route(const RouteShape& shape, const std::optional<DriveRobot>& robot,
                                double voltage) {
  if (shape.segments.empty()) {
    return refusal(ArgumentError::empty, shape.source, "the path").got("without a segment");
  }
  FLYBALL_CHECK(check_limits(shape));
  TimedRoute result;
  RobotTrajectory& trajectory = result.trajectory;
  trajectory.source = shape.source;
  trajectory.holonomic = !shape.headings.empty();
  trajectory.diagnostics = shape.diagnostics;
  const bool turns_as_it_goes =
      shape.headings.empty() &&
      (std::isfinite(shape.limits.angular_acceleration) || robot.has_value());
  const Smoothing smoothing = turns_as_it_goes                   ? Smoothing::wheels
                              : std::isfinite(shape.limits.jerk) ? Smoothing::acceleration
                                                                 : Smoothing::none;
  FLYBALL_TRY(const RoutePath route, path_of(shape, smoothing, trajectory.diagnostics));

  std::vector<PathTrajectory> motions;
  double total = 0.0;
  for (std::size_t p = 0; p < route.parts.size(); ++p) {
    const auto& part = route.parts[p];
    const auto named = [&](Error error) { return std::move(error).in(shape.source); };
    FLYBALL_TRY(const Path path, part_of(route.path, part.first, part.second).map_error(named));
    TimingOptions options;
    options.start_velocity = p == 0 ? shape.start_velocity : 0.0;
    options.tolerance = std::isinf(shape.limits.jerk) ? 2e-4 : 1e-3;
    options.end_velocity = p + 1 == route.parts.size() ? shape.end_velocity : 0.0;
    FLYBALL_TRY(PathTrajectory motion,
                time_optimal(path, constraints_of(shape, route, part, robot, voltage), options)
                    .map_error(named));
    total += motion.total_time();
    motions.push_back(std::move(motion));
  }
  // 10 ms; of a short motion 200 samples, of a long one 20 000.
  const double step = std::clamp(0.01, total / 20'000.0, total / 200.0);
  double start = 0.0;
  FacingHeading facing(shape.reversed);
  for (const PathTrajectory& motion : motions) {
    const std::pair<bool, bool> rests{&motion != &motions.front() || shape.start_velocity == 0.0,
                                      &motion != &motions.back() || shape.end_velocity == 0.0};
    sample_part(motion, start, step, rests, facing, trajectory.samples);
    for (const BindingLimit& limit : motion.binding()) {
      if (!result.binding.empty() && result.binding.back().limit == limit.limit) {
        result.binding.back().to = start + limit.end;
      } else {
        result.binding.push_back({start + limit.start, start + limit.end, limit.limit});
      }
    }
    start += motion.total_time();
  }
  for (const double mark : shape.marks) {
    result.mark_times.push_back(time_at(motions, route, mark));
  }
  return result;
}

}  // namespace flyball::study
