#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/configuration/polygons.hpp"
#include "planning/configuration/region_node.hpp"
#include "planning/configuration/space_checks.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail {

namespace {

constexpr std::string_view in_space_checks = "configuration space";

/// m, rad: margins are judged in single precision, and of what is larger nothing is left there.
constexpr double largest_number = 1e9;

Expected<void> check_ordinary(double value, std::string_view name, std::string_view unit = "") {
  return check_within(value, -largest_number, largest_number, in_space_checks, name, unit);
}

Expected<void> check_coordinate(const std::vector<SpaceAxis>& axes, int coordinate,
                                const std::string& name) {
  if (coordinate < 0 || static_cast<std::size_t>(coordinate) >= axes.size()) {
    return refusal(ArgumentError::out_of_range, in_space_checks, name)
        .got(format("about coordinate {}", coordinate))
        .expected(format("about one of 0 to {}", axes.size() - 1));
  }
  return {};
}

Expected<void> check_node(const std::vector<SpaceAxis>& axes, const std::string& name,
                          const RegionNode& node, int depth) {
  using Kind = RegionNode::Kind;
  constexpr int deepest = 1000;
  if (depth > deepest) {
    return refusal(ArgumentError::out_of_range, in_space_checks, name)
        .got("nested more than 1000 deep")
        .expected("unions of flat lists");
  }
  switch (node.kind) {
    case Kind::everything:
      return {};
    case Kind::half_space: {
      if (node.normal.size() != axes.size()) {
        return refusal(ArgumentError::wrong_shape, in_space_checks, name)
            .got(format("a normal of {} entries", node.normal.size()))
            .expected(format("one for each of the {} axes", axes.size()));
      }
      FLYBALL_CHECK(check_ordinary(node.offset, name));
      bool any = false;
      for (std::size_t k = 0; k < axes.size(); ++k) {
        FLYBALL_CHECK(check_ordinary(node.normal[k], name));
        any = any || node.normal[k] != 0.0;
        if (axes[k].wraps && node.normal[k] != 0.0) {
          return refusal(ArgumentError::out_of_range, in_space_checks, name)
              .got("a half-space along " + axes[k].name + ", which wraps")
              .expected("an interval or a polygon")
              .hint("a circle has no half-space");
        }
      }
      if (!any) {
        return refusal(ArgumentError::out_of_range, in_space_checks, name)
            .got("a normal of zeros")
            .expected("a direction");
      }
      return {};
    }
    case Kind::interval:
      FLYBALL_CHECK(check_coordinate(axes, node.coordinate, name));
      if (std::isnan(node.low) || std::isnan(node.high)) {
        return refusal(ArgumentError::not_finite, in_space_checks, name)
            .got("a bound that is not a number, or missing")
            .expected("a low and a high bound for each coordinate");
      }
      if (!(node.low <= node.high)) {
        return refusal(ArgumentError::out_of_range, in_space_checks, name)
            .got(format("from {} to {}", format_number(node.low), format_number(node.high)))
            .expected("low <= high")
            .hint(axes[static_cast<std::size_t>(node.coordinate)].wraps
                      ? "an interval of an angle that wraps may end beyond a turn: from 3 to 4"
                      : "");
      }
      if (axes[static_cast<std::size_t>(node.coordinate)].wraps &&
          !(std::isfinite(node.low) && std::isfinite(node.high))) {
        return refusal(ArgumentError::not_finite, in_space_checks, name)
            .got("without an end along " + axes[static_cast<std::size_t>(node.coordinate)].name +
                 ", which wraps")
            .expected("from an angle to an angle");
      }
      return {};
    case Kind::polygon:
      FLYBALL_CHECK(check_coordinate(axes, node.coordinate, name));
      FLYBALL_CHECK(check_coordinate(axes, node.up, name));
      if (node.coordinate == node.up) {
        return refusal(ArgumentError::out_of_range, in_space_checks, name)
            .got("a polygon over one coordinate")
            .expected("two different ones");
      }
      return check_polygon(node.vertices, in_space_checks, name);
    case Kind::both:
    case Kind::either:
      FLYBALL_CHECK(check_node(axes, name, *node.a, depth + 1));
      return check_node(axes, name, *node.b, depth + 1);
    case Kind::complement:
      return check_node(axes, name, *node.a, depth + 1);
  }
  return {};
}

Expected<void> check_point(const std::array<double, 2>& p, std::string_view name) {
  FLYBALL_CHECK(check_ordinary(p[0], name, "m"));
  return check_ordinary(p[1], name, "m");
}

Expected<void> check_size(double value, std::string_view name, std::string_view unit) {
  return check_within(value, 0.0, largest_number, in_space_checks, name, unit);
}

Expected<void> check_joint(const PlanarMechanism& mechanism, int joint, const std::string& name) {
  if (joint < 0 || static_cast<std::size_t>(joint) >= mechanism.joints.size()) {
    return refusal(ArgumentError::out_of_range, in_space_checks, name)
        .got(format("on joint {}", joint))
        .expected(format("on one of the {} joints", mechanism.joints.size()));
  }
  return {};
}

Expected<void> check_obstacle(const PlanarObstacle& obstacle, const std::string& name) {
  using Shape = PlanarObstacle::Shape;
  FLYBALL_CHECK(check_point(obstacle.at, name));
  switch (obstacle.shape) {
    case Shape::disc:
      return check_size(obstacle.radius, name + ".radius", "m");
    case Shape::half_plane:
      for (const double part : obstacle.normal) {
        FLYBALL_CHECK(check_ordinary(part, name + ".normal"));
      }
      if (obstacle.normal[0] == 0.0 && obstacle.normal[1] == 0.0) {
        return refusal(ArgumentError::out_of_range, in_space_checks, name + ".normal")
            .got("zero")
            .expected("the direction out of it, such as (0, 1) of a floor");
      }
      return {};
    case Shape::polygon:
      return check_polygon(obstacle.vertices, in_space_checks, name);
    case Shape::frame:
      FLYBALL_CHECK(check_polygon(obstacle.vertices, in_space_checks, name));
      if (!is_convex(tidy(obstacle.vertices))) {
        return refusal(ArgumentError::out_of_range, in_space_checks, name)
            .got("a frame that is not convex")
            .expected("a convex one")
            .hint("add what reaches in as a polygon");
      }
      return {};
  }
  return {};
}

bool has_body(const PlanarMechanism& mechanism, const std::string& name) {
  return !name.empty() && std::any_of(mechanism.bodies.begin(), mechanism.bodies.end(),
                                      [&](const LinkBody& body) { return body.name == name; });
}

}  // namespace

Expected<void> check_axes(const std::vector<SpaceAxis>& axes) {
  if (axes.empty() || axes.size() > static_cast<std::size_t>(most_axes)) {
    return refusal(axes.empty() ? ArgumentError::empty : ArgumentError::out_of_range,
                   in_space_checks, "axes")
        .got(format("{}", axes.size()))
        .expected("1 to 16");
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const SpaceAxis& axis = axes[i];
    const std::string name = axis.name.empty() ? format("axis {}", i + 1) : axis.name;
    FLYBALL_CHECK(Checks(in_space_checks)
                      .within(axis.low, -largest_number, largest_number, name + ".low", axis.unit)
                      .within(axis.high, -largest_number, largest_number, name + ".high", axis.unit)
                      .positive(axis.scale, name + ".scale"));
    if (!(axis.low < axis.high)) {
      return refusal(ArgumentError::out_of_range, in_space_checks, name)
          .got(format("from {} to {}", format_number(axis.low), format_number(axis.high)))
          .expected("a low stop below its high one");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (!axis.name.empty() && axes[j].name == axis.name) {
        return refusal(ArgumentError::ambiguous_name, in_space_checks, axis.name)
            .got("the name of two axes")
            .expected("different names");
      }
    }
  }
  return {};
}

Expected<void> check_region(const std::vector<SpaceAxis>& axes, const std::string& name,
                            const Region& region) {
  return check_node(axes, name.empty() ? "region" : name, region.node(), 0);
}

Expected<void> check_mechanism(const std::vector<SpaceAxis>& axes,
                               const PlanarMechanism& mechanism) {
  if (mechanism.joints.empty() || mechanism.joints.size() > static_cast<std::size_t>(most_joints)) {
    return refusal(mechanism.joints.empty() ? ArgumentError::empty : ArgumentError::out_of_range,
                   in_space_checks, "joints")
        .got(format("{}", mechanism.joints.size()))
        .expected("1 to 16");
  }
  for (std::size_t j = 0; j < mechanism.joints.size(); ++j) {
    const PlanarJoint& joint = mechanism.joints[j];
    const std::string name = joint.name.empty() ? format("joint {}", j + 1) : joint.name;
    FLYBALL_CHECK(check_point({joint.x, joint.y}, name));
    FLYBALL_CHECK(check_ordinary(joint.angle, name, "rad"));
    FLYBALL_CHECK(check_coordinate(axes, joint.coordinate, name));
    if (joint.parent < -1 || joint.parent >= static_cast<int>(j)) {
      return refusal(ArgumentError::out_of_range, in_space_checks, name)
          .got(format("carried by joint {}", joint.parent))
          .expected("carried by an earlier one, or -1 for the robot");
    }
    if (joint.slides && axes[static_cast<std::size_t>(joint.coordinate)].wraps) {
      return refusal(ArgumentError::out_of_range, in_space_checks, name)
          .got("sliding along a coordinate that wraps")
          .expected("turning, or an axis with stops");
    }
  }
  for (std::size_t b = 0; b < mechanism.bodies.size(); ++b) {
    const LinkBody& body = mechanism.bodies[b];
    const std::string name = body.name.empty() ? format("body {}", b + 1) : body.name;
    FLYBALL_CHECK(check_joint(mechanism, body.joint, name));
    FLYBALL_CHECK(check_point(body.from, name));
    FLYBALL_CHECK(check_point(body.to, name));
    FLYBALL_CHECK(check_size(body.radius, name + ".radius", "m"));
  }
  for (std::size_t o = 0; o < mechanism.obstacles.size(); ++o) {
    const PlanarObstacle& obstacle = mechanism.obstacles[o];
    const std::string name = obstacle.name.empty() ? format("obstacle {}", o + 1) : obstacle.name;
    FLYBALL_CHECK(check_obstacle(obstacle, name));
    for (const std::string& spared : obstacle.spares) {
      if (!has_body(mechanism, spared)) {
        return refusal(ArgumentError::unknown_name, in_space_checks, name + ".spares")
            .got('"' + spared + '"')
            .expected("the name of a body");
      }
    }
  }
  for (const auto& pair : mechanism.apart) {
    for (const std::string& one : pair) {
      if (!has_body(mechanism, one)) {
        return refusal(ArgumentError::unknown_name, in_space_checks, "apart")
            .got('"' + one + '"')
            .expected("the name of a body");
      }
    }
    if (pair[0] == pair[1]) {
      return refusal(ArgumentError::ambiguous_name, in_space_checks, "apart")
          .got('"' + pair[0] + "\" twice")
          .expected("two bodies");
    }
  }
  for (const LinkMass& mass : mechanism.masses) {
    FLYBALL_CHECK(check_joint(mechanism, mass.joint, "mass"));
    FLYBALL_CHECK(check_point(mass.at, "mass.at"));
    FLYBALL_CHECK(check_size(mass.mass, "mass", "kg"));
  }
  for (const HoldingLimit& hold : mechanism.holding) {
    FLYBALL_CHECK(check_joint(mechanism, hold.joint, "holding limit"));
    FLYBALL_CHECK(check_positive(hold.most, in_space_checks, "holding limit"));
  }
  return check_ordinary(mechanism.gravity, "gravity", "m/s²");
}

}  // namespace flyball::detail
