#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/drive/drive_body.hpp"
#include "planning/drive/drive_rules.hpp"

namespace flyball {

using Eigen::Vector2d;

std::string_view to_string(Drivetrain drivetrain) {
  switch (drivetrain) {
    case Drivetrain::swerve:
      return "swerve";
    case Drivetrain::differential:
      return "differential";
    case Drivetrain::mecanum:
      return "mecanum";
  }
  return "";
}

std::string_view to_string(DriveConstraintKind kind) {
  switch (kind) {
    case DriveConstraintKind::stop_point:
      return "stop point";
    case DriveConstraintKind::max_velocity:
      return "max velocity";
    case DriveConstraintKind::max_acceleration:
      return "max acceleration";
    case DriveConstraintKind::max_angular_velocity:
      return "max angular velocity";
    case DriveConstraintKind::point_at:
      return "point at";
    case DriveConstraintKind::keep_in_rectangle:
      return "keep in rectangle";
    case DriveConstraintKind::keep_in_circle:
      return "keep in circle";
    case DriveConstraintKind::keep_in_lane:
      return "keep in lane";
    case DriveConstraintKind::keep_out_circle:
      return "keep out circle";
    case DriveConstraintKind::keep_in_polygon:
      return "keep in polygon";
    case DriveConstraintKind::keep_out_polygon:
      return "keep out polygon";
  }
  return "";
}

double DriveModel::force() const noexcept {
  double least = max_force;
  if (friction > 0.0) {
    least =
        std::min(least, drivetrain == Drivetrain::mecanum ? friction / std::sqrt(2.0) : friction);
  }
  return least;
}

int DriveModel::wheel_count() const noexcept {
  return drivetrain == Drivetrain::differential ? 2 : 4;
}

namespace drive_rules {

namespace {

constexpr std::string_view in_drive_trajectory = "drive trajectory";
constexpr int most_waypoints = 200;
constexpr double farthest = 1e4;  // m

/// Half-planes n·p ≤ b of a convex polygon that is counter-clockwise.
struct HalfPlane {
  Vector2d normal{};
  double offset = 0.0;
};

std::vector<HalfPlane> half_planes(const std::vector<Vector2d>& polygon) {
  std::vector<HalfPlane> planes;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    const double length = edge.norm();
    if (length > 0.0) {
      const Vector2d normal(edge(1) / length, -edge(0) / length);
      planes.push_back({normal, normal.dot(polygon[i])});
    }
  }
  return planes;
}

double from_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d edge = b - a;
  const double square = edge.squaredNorm();
  const double share = square > 0.0 ? std::clamp((p - a).dot(edge) / square, 0.0, 1.0) : 0.0;
  return (p - a - share * edge).norm();
}

/// What a distance beyond a size is a share of: the size, between 1 cm and 1 m.
double share_of(double size) {
  return size > 0.0 ? std::clamp(size, 0.01, 1.0) : 1.0;
}

double area_of(const std::vector<Vector2d>& polygon) {
  double sum = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    sum += a(0) * b(1) - a(1) * b(0);
  }
  return 0.5 * sum;
}

Expected<void> check_polygon(const std::vector<Vector2d>& polygon, const std::string& name) {
  bool convex = polygon.size() >= 3 && polygon.size() <= 20;
  for (std::size_t i = 0; convex && i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const Vector2d& c = polygon[(i + 2) % polygon.size()];
    const Vector2d ab = b - a;
    const Vector2d bc = c - b;
    convex = a.allFinite() && ab(0) * bc(1) - ab(1) * bc(0) > -1e-9;
  }
  if (!convex || !(area_of(polygon) > 1e-6)) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(in_drive_trajectory))
                              .about(flyball::detail::format("the polygon of {}", name))
                              .expected("3 to 20 corners, convex and counter-clockwise")
                              .got(flyball::detail::format("{} corners, area {}", polygon.size(),
                                                           format_number(area_of(polygon)))));
  }
  return {};
}

Expected<void> check_model(const DriveModel& model) {
  FLYBALL_CHECK(Checks(in_drive_trajectory)
                    .positive(model.mass, "the mass", "kg")
                    .positive(model.moment_of_inertia, "the moment of inertia", "kg m²")
                    .positive(model.max_force, "the wheels' largest force", "N")
                    .positive(model.max_speed, "the wheels' largest speed", "m/s")
                    .not_negative(model.friction, "the wheels' friction", "N")
                    .not_negative(model.free_speed, "the motors' free speed", "m/s")
                    .not_negative(model.stall_force, "the motors' stall force", "N")
                    .not_negative(model.supply_power, "the motors' supply power", "W")
                    .not_negative(model.copper_loss, "the motors' copper loss", "W/N²"));
  if (model.free_speed > 0.0) {
    FLYBALL_CHECK(
        check_positive(model.stall_force, in_drive_trajectory, "the motors' stall force", "N"));
  }
  if (model.drivetrain == Drivetrain::differential) {
    FLYBALL_CHECK(check_positive(model.trackwidth, in_drive_trajectory, "the track width", "m"));
  } else {
    double turn = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      FLYBALL_CHECK(check_finite(model.wheels[i], in_drive_trajectory, "a wheel's place"));
      turn = std::max(turn, model.drivetrain == Drivetrain::mecanum
                                ? std::abs(drive_body::mecanum_row(model, i)[2])
                                : model.wheels[i].norm());
    }
    FLYBALL_CHECK(
        check_positive(turn, in_drive_trajectory, "the wheels' distance from the middle", "m"));
  }
  if (!model.corners.empty()) {
    FLYBALL_CHECK(check_polygon(model.corners, "the bumpers"));
  }
  return {};
}

Expected<void> check_constraint(const DriveProblem& problem, std::size_t number) {
  const DriveConstraint& c = problem.constraints[number];
  const std::string name = name_of(problem, number);
  const int last = static_cast<int>(problem.waypoints.size()) - 1;
  const Span span = span_of(problem, c);
  if (c.from < -1 || c.from > last || (c.to && (*c.to < -1 || *c.to > last)) ||
      span.to < span.from) {
    return tl::unexpected(
        Error(ArgumentError::out_of_range)
            .in(std::string(in_drive_trajectory))
            .about(flyball::detail::format("the waypoints of {}", name))
            .expected(flyball::detail::format("from 0 to {}, or -1 for the last, in order", last))
            .got(flyball::detail::format("{}{}", c.from,
                                         c.to ? flyball::detail::format(" to {}", *c.to) : "")));
  }
  const auto of = [&](std::string_view what) {
    return flyball::detail::format("{} of {}", what, name);
  };
  Checks checks(in_drive_trajectory);
  const std::string x = of("x"), y = of("y"), limit = of("the limit"), radius = of("the radius"),
                    tolerance = of("the tolerance"), width = of("the width"),
                    height = of("the height");
  switch (c.kind) {
    case DriveConstraintKind::stop_point:
      return {};
    case DriveConstraintKind::max_velocity:
    case DriveConstraintKind::max_acceleration:
    case DriveConstraintKind::max_angular_velocity:
      return checks.not_negative(c.limit, limit);
    case DriveConstraintKind::point_at:
      return checks.within(c.x, -farthest, farthest, x, "m")
          .within(c.y, -farthest, farthest, y, "m")
          .not_negative(c.tolerance, tolerance, "rad");
    case DriveConstraintKind::keep_in_rectangle:
      return checks.within(c.x, -farthest, farthest, x, "m")
          .within(c.y, -farthest, farthest, y, "m")
          .positive(c.width, width, "m")
          .positive(c.height, height, "m");
    case DriveConstraintKind::keep_in_circle:
    case DriveConstraintKind::keep_out_circle:
      return checks.within(c.x, -farthest, farthest, x, "m")
          .within(c.y, -farthest, farthest, y, "m")
          .positive(c.radius, radius, "m");
    case DriveConstraintKind::keep_in_lane: {
      FLYBALL_CHECK(check_not_negative(c.tolerance, in_drive_trajectory, tolerance, "m"));
      const DriveWaypoint& a = problem.waypoints[static_cast<std::size_t>(span.from)];
      const DriveWaypoint& b = problem.waypoints[static_cast<std::size_t>(span.to)];
      return check_positive(std::hypot(b.x - a.x, b.y - a.y), in_drive_trajectory, of("the length"),
                            "m");
    }
    case DriveConstraintKind::keep_in_polygon:
    case DriveConstraintKind::keep_out_polygon:
      return check_polygon(c.polygon, name);
  }
  return {};
}

}  // namespace

Span span_of(const DriveProblem& problem, const DriveConstraint& constraint) {
  const int last = static_cast<int>(problem.waypoints.size()) - 1;
  const int from = constraint.from == -1 ? last : constraint.from;
  const int to = !constraint.to ? from : *constraint.to == -1 ? last : *constraint.to;
  return {from, to};
}

std::string name_of(const DriveProblem& problem, std::size_t constraint) {
  const DriveConstraint& c = problem.constraints[constraint];
  if (!c.name.empty()) {
    return c.name;
  }
  int before = 0;
  int all = 0;
  for (std::size_t i = 0; i < problem.constraints.size(); ++i) {
    if (problem.constraints[i].kind == c.kind) {
      ++all;
      before += i <= constraint ? 1 : 0;
    }
  }
  return all > 1 ? flyball::detail::format("{} {}", to_string(c.kind), before)
                 : std::string(to_string(c.kind));
}

bool stops_at(const DriveProblem& problem, int waypoint) {
  if (problem.waypoints[static_cast<std::size_t>(waypoint)].stop) {
    return true;
  }
  return std::any_of(problem.constraints.begin(), problem.constraints.end(),
                     [&](const DriveConstraint& c) {
                       const Span span = span_of(problem, c);
                       return c.kind == DriveConstraintKind::stop_point && span.from <= waypoint &&
                              waypoint <= span.to;
                     });
}

bool is_obstacle(const DriveConstraint& constraint) noexcept {
  return constraint.kind == DriveConstraintKind::keep_out_circle ||
         constraint.kind == DriveConstraintKind::keep_out_polygon;
}

Disc disc_of(const DriveConstraint& obstacle) {
  if (obstacle.kind == DriveConstraintKind::keep_out_circle) {
    return {Vector2d(obstacle.x, obstacle.y), obstacle.radius};
  }
  Vector2d sum = Vector2d::Zero();
  for (const Vector2d& corner : obstacle.polygon) {
    sum += corner;
  }
  const Vector2d center = sum / static_cast<double>(obstacle.polygon.size());
  double radius = 0.0;
  for (const Vector2d& corner : obstacle.polygon) {
    radius = std::max(radius, (corner - center).norm());
  }
  return {center, radius};
}

std::vector<Vector2d> corners_of(const DriveModel& model) {
  return model.corners.empty() ? std::vector<Vector2d>{Vector2d::Zero()} : model.corners;
}

double reach_of(const DriveModel& model) {
  double reach = 0.0;
  for (const Vector2d& corner : model.corners) {
    reach = std::max(reach, corner.norm());
  }
  return reach;
}

double wheel_reach_of(const DriveModel& model) {
  double reach = 0.05;
  if (model.drivetrain == Drivetrain::differential) {
    return std::max(reach, 0.5 * model.trackwidth);
  }
  for (const Vector2d& wheel : model.wheels) {
    reach = std::max(reach, wheel.norm());
  }
  return reach;
}

Lane lane_of(const DriveProblem& problem, const DriveConstraint& constraint) {
  const Span span = span_of(problem, constraint);
  const DriveWaypoint& a = problem.waypoints[static_cast<std::size_t>(span.from)];
  const DriveWaypoint& b = problem.waypoints[static_cast<std::size_t>(span.to)];
  const Vector2d along = Vector2d(b.x - a.x, b.y - a.y).normalized();
  return {Vector2d(a.x, a.y), Vector2d(-along(1), along(0))};
}

double distance(const std::vector<Vector2d>& a, const std::vector<Vector2d>& b) {
  // The largest separation along the edges' normals; positive ones are exact but at corners.
  double most = -std::numeric_limits<double>::infinity();
  const auto along = [&](const std::vector<Vector2d>& of, const std::vector<Vector2d>& other) {
    for (const HalfPlane& plane : half_planes(of)) {
      double least = std::numeric_limits<double>::infinity();
      for (const Vector2d& corner : other) {
        least = std::min(least, plane.normal.dot(corner) - plane.offset);
      }
      most = std::max(most, least);
    }
  };
  if (a.size() > 2) {
    along(a, b);
  }
  if (b.size() > 2) {
    along(b, a);
  }
  if (most < 0.0 && std::isfinite(most)) {
    return most;
  }
  double least = std::numeric_limits<double>::infinity();
  const auto corners = [&](const std::vector<Vector2d>& of, const std::vector<Vector2d>& other) {
    for (const Vector2d& p : of) {
      for (std::size_t i = 0; i < other.size(); ++i) {
        least = std::min(least, from_segment(p, other[i], other[(i + 1) % other.size()]));
      }
    }
  };
  corners(a, b);
  corners(b, a);
  return least;
}

std::string_view unit_of(DriveConstraintKind kind) {
  switch (kind) {
    case DriveConstraintKind::stop_point:
    case DriveConstraintKind::max_velocity:
      return "m/s";
    case DriveConstraintKind::max_acceleration:
      return "m/s²";
    case DriveConstraintKind::max_angular_velocity:
      return "rad/s";
    case DriveConstraintKind::point_at:
      return "rad";
    default:
      return "m";
  }
}

Excess excess(const DriveProblem& problem, const DriveConstraint& c, const Eigen::VectorXd& x,
              const Eigen::VectorXd& u) {
  const DriveModel& model = problem.model;
  const auto at = drive_body::motion<double>(model, x, u);
  const Vector2d p = x.head<2>();
  const double cosine = std::cos(x(2));
  const double sine = std::sin(x(2));
  std::vector<Vector2d> corners = corners_of(model);
  for (Vector2d& corner : corners) {
    corner =
        p + Vector2d(cosine * corner(0) - sine * corner(1), sine * corner(0) + cosine * corner(1));
  }
  const auto worst = [&](auto&& outside) {
    double most = -std::numeric_limits<double>::infinity();
    for (const Vector2d& corner : corners) {
      most = std::max(most, outside(corner));
    }
    return most;
  };
  switch (c.kind) {
    case DriveConstraintKind::stop_point:
      return {std::hypot(at.vx, at.vy) + std::abs(at.omega), 1.0};
    case DriveConstraintKind::max_velocity:
      return {std::hypot(at.vx, at.vy) - c.limit, c.limit};
    case DriveConstraintKind::max_acceleration:
      return {std::hypot(at.ax, at.ay) - c.limit, c.limit};
    case DriveConstraintKind::max_angular_velocity:
      return {std::abs(at.omega) - c.limit, c.limit};
    case DriveConstraintKind::point_at: {
      const Vector2d d = Vector2d(c.x, c.y) - p;
      const double sign = c.flip ? -1.0 : 1.0;
      const double off =
          std::atan2(sign * (cosine * d(1) - sine * d(0)), sign * (cosine * d(0) + sine * d(1)));
      return {std::abs(off) - c.tolerance, share_of(c.tolerance)};
    }
    case DriveConstraintKind::keep_in_rectangle:
      return {
          worst([&](const Vector2d& q) {
            return std::max({c.x - q(0), q(0) - c.x - c.width, c.y - q(1), q(1) - c.y - c.height});
          }),
          1.0};
    case DriveConstraintKind::keep_in_circle:
      return {worst([&](const Vector2d& q) { return (q - Vector2d(c.x, c.y)).norm() - c.radius; }),
              share_of(c.radius)};
    case DriveConstraintKind::keep_in_lane: {
      const Lane lane = lane_of(problem, c);
      return {std::abs(lane.left.dot(p - lane.start)) - c.tolerance, share_of(c.tolerance)};
    }
    case DriveConstraintKind::keep_out_circle:
      return {c.radius - distance(corners, {Vector2d(c.x, c.y)}), share_of(c.radius)};
    case DriveConstraintKind::keep_in_polygon:
      return {worst([&](const Vector2d& q) {
                double most = -std::numeric_limits<double>::infinity();
                for (const HalfPlane& plane : half_planes(c.polygon)) {
                  most = std::max(most, plane.normal.dot(q) - plane.offset);
                }
                return most;
              }),
              1.0};
    case DriveConstraintKind::keep_out_polygon:
      return {-distance(corners, c.polygon), 1.0};
  }
  return {};
}

Expected<void> check(const DriveProblem& problem) {
  FLYBALL_CHECK(check_model(problem.model));
  if (problem.waypoints.size() < 2 || problem.waypoints.size() > most_waypoints) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in(std::string(in_drive_trajectory))
                              .about("the waypoints")
                              .expected(flyball::detail::format("2 to {}", most_waypoints))
                              .got(flyball::detail::format("{}", problem.waypoints.size())));
  }
  for (std::size_t i = 0; i < problem.waypoints.size(); ++i) {
    const DriveWaypoint& w = problem.waypoints[i];
    const std::string x = flyball::detail::format("x of waypoint {}", i);
    const std::string y = flyball::detail::format("y of waypoint {}", i);
    const std::string heading = flyball::detail::format("the heading of waypoint {}", i);
    const std::string intervals = flyball::detail::format("the intervals of waypoint {}", i);
    FLYBALL_CHECK(Checks(in_drive_trajectory)
                      .within(w.x, -farthest, farthest, x, "m")
                      .within(w.y, -farthest, farthest, y, "m")
                      .within(w.heading, -1e4, 1e4, heading, "rad")
                      .within(w.intervals, 0, 10000, intervals));
  }
  FLYBALL_CHECK(check_within(problem.target_interval, 1e-4, 10.0, in_drive_trajectory,
                             "the target interval", "s"));
  for (std::size_t i = 0; i < problem.constraints.size(); ++i) {
    FLYBALL_CHECK(check_constraint(problem, i));
  }
  return {};
}

}  // namespace drive_rules

}  // namespace flyball
