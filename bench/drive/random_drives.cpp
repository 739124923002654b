#include <algorithm>
#include <cmath>
#include <numbers>

#include "random_drives.hpp"

namespace bench {

using Eigen::Vector2d;
using namespace flyball;
using Kind = DriveConstraintKind;

namespace {

DriveModel robot(Random& random) {
  const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(); };
  const auto chance = [&](double share) { return random.uniform() < share; };
  DriveModel model;
  model.drivetrain = static_cast<Drivetrain>(std::min(2, static_cast<int>(3.0 * random.uniform())));
  model.mass = between(25.0, 75.0);
  const double half = between(0.2, 0.33);
  const double bumper = half + between(0.08, 0.15);
  model.moment_of_inertia = model.mass * half * half * between(0.8, 2.0);
  model.wheels = {Vector2d(half, half), Vector2d(half, -half), Vector2d(-half, half),
                  Vector2d(-half, -half)};
  model.trackwidth = 2.0 * half;
  model.corners = {Vector2d(bumper, bumper), Vector2d(-bumper, bumper), Vector2d(-bumper, -bumper),
                   Vector2d(bumper, -bumper)};
  model.max_speed = between(3.0, 5.5);
  const double wheels = model.wheel_count();
  model.max_force = model.mass * between(4.0, 12.0) / wheels;
  if (chance(0.6)) {
    model.stall_force = model.max_force * between(1.0, 3.0);
    model.free_speed = model.max_speed * between(1.0, 1.1);
  }
  if (chance(0.7)) {
    model.friction = between(0.9, 1.5) * model.mass * 9.80665 / wheels;
  }
  return model;
}

}  // namespace

DriveProblem random_drive(Random& random) {
  const auto between = [&](double a, double b) { return a + (b - a) * random.uniform(); };
  const auto chance = [&](double share) { return random.uniform() < share; };
  DriveProblem problem;
  problem.model = robot(random);
  const double reach = problem.model.corners[0].norm();
  const bool steers = problem.model.drivetrain == Drivetrain::differential;
  const int count = 2 + static_cast<int>(4.99 * random.uniform());
  while (static_cast<int>(problem.waypoints.size()) < count) {
    const DriveWaypoint w{.x = between(1.0, 15.0),
                          .y = between(1.0, 7.2),
                          .heading = between(-std::numbers::pi, std::numbers::pi),
                          .fix_heading = chance(steers ? 0.2 : 0.6),
                          .stop = chance(0.15)};
    const bool apart = std::all_of(
        problem.waypoints.begin(), problem.waypoints.end(),
        [&](const DriveWaypoint& other) { return std::hypot(w.x - other.x, w.y - other.y) > 1.5; });
    if (apart) {
      problem.waypoints.push_back(w);
    }
  }
  problem.waypoints.front().stop = true;
  problem.waypoints.back().stop = true;
  if (chance(0.7)) {
    problem.constraints.push_back(
        {.kind = Kind::keep_in_rectangle, .from = 0, .to = -1, .width = 16.0, .height = 8.2});
  }
  // Obstacles near the way, with room beside them.
  for (int i = 0; i < 3; ++i) {
    if (!chance(0.6)) {
      continue;
    }
    const auto s = static_cast<std::size_t>(random.uniform() * 0.999 * (count - 1));
    const DriveWaypoint& a = problem.waypoints[s];
    const DriveWaypoint& b = problem.waypoints[s + 1];
    const double share = between(0.3, 0.7);
    const Vector2d center(a.x + share * (b.x - a.x) + between(-0.8, 0.8),
                          a.y + share * (b.y - a.y) + between(-0.8, 0.8));
    const double radius = between(0.2, 0.7);
    const auto near = [&](double x, double y, double room) {
      return std::hypot(x - center(0), y - center(1)) < room;
    };
    bool free = center(1) > 2.5 + radius && center(1) < 5.7 - radius;
    for (const DriveWaypoint& w : problem.waypoints) {
      free = free && !near(w.x, w.y, radius + 1.3 * reach);
    }
    for (const DriveConstraint& other : problem.constraints) {
      const Vector2d at =
          other.kind == Kind::keep_out_polygon ? other.polygon[0] : Vector2d(other.x, other.y);
      free = free && (other.kind == Kind::keep_in_rectangle ||
                      !near(at(0), at(1), 1.4 + radius + 2.4 * reach));
    }
    if (!free) {
      continue;
    }
    if (chance(0.6)) {
      problem.constraints.push_back({.kind = Kind::keep_out_circle,
                                     .from = 0,
                                     .to = -1,
                                     .x = center(0),
                                     .y = center(1),
                                     .radius = radius});
    } else {
      const int corners = 3 + static_cast<int>(3.99 * random.uniform());
      const double turn = between(0.0, 6.28);
      DriveConstraint c{.kind = Kind::keep_out_polygon, .from = 0, .to = -1};
      for (int k = 0; k < corners; ++k) {
        const double angle = turn + 2.0 * std::numbers::pi * k / corners;
        c.polygon.emplace_back(center + radius * Vector2d(std::cos(angle), std::sin(angle)));
      }
      problem.constraints.push_back(std::move(c));
    }
  }
  if (chance(0.3)) {
    problem.constraints.push_back(
        {.kind = Kind::max_velocity, .from = 0, .to = 1, .limit = between(1.0, 3.0)});
  }
  if (chance(0.3)) {
    problem.constraints.push_back(
        {.kind = Kind::max_angular_velocity, .from = 0, .to = -1, .limit = between(2.0, 6.0)});
  }
  if (chance(0.3)) {
    problem.constraints.push_back(
        {.kind = Kind::max_acceleration, .from = 0, .to = -1, .limit = between(3.0, 9.0)});
  }
  return problem;
}

}  // namespace bench
