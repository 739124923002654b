#pragma once

#include <utility>
#include <vector>

#include <flyball/planning/path/path.hpp>

#include "study/path_route.hpp"

/// Shapes as paths that can be timed.
namespace flyball::study {

/// A place of a shape, and the parameter of the path there.
struct RouteKnot {
  double position = 0.0, parameter = 0.0;
};

/// A path of one (x, y) that looks where it goes, or of (x, y, θ).
struct RoutePath {
  Path path;
  std::vector<RouteKnot> knots;                  ///< Ascending; in proportion between.
  std::vector<std::pair<double, double>> parts;  ///< Parameters between which it does not stop.

  [[nodiscard]] double parameter(double position) const;
};

/// Whether the curvature is made continuous between stops, and because of what.
enum class Smoothing {
  none,
  wheels,        ///< It looks where it goes: its wheels' speeds would jump with the curvature.
  acceleration,  ///< The jerk is limited: the acceleration across the path would jump.
};

/// A shape as a path whose derivative is continuous between stops. Segments all in one place are
/// left out; control points on their anchors move off them; directions that differ by 3° or less at
/// a joint become one, more is a stop; the heading goes from target to target as `with_headings`
/// has it, its turning rate continuous, at 24 places a segment where the robot looks at a place.
/// @param noticed  What was changed is told there.
/// @errors ArgumentError::empty (all in one place), out_of_range (a segment longer than 10 km).
[[nodiscard]] Expected<RoutePath> path_of(const RouteShape& shape, Smoothing smoothing,
                                          std::vector<Diagnostic>& noticed);

}  // namespace flyball::study
