#pragma once

#include <span>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/planning/path/path.hpp>

/// Paths from waypoints, control points and arcs. Points are columns: coordinates x count.
namespace flyball {

/// How much of the parameter lies between two waypoints of a spline, d apart.
enum class KnotSpacing {
  uniform,      ///< 1
  centripetal,  ///< √d: no loops and no cusps between waypoints at uneven distances.
  chord,        ///< d: the parameter is near the length.
};

/// The straight line. @errors ArgumentError::wrong_shape, not_finite, out_of_range (both in one
/// place).
[[nodiscard]] Expected<Path> line_path(const MatrixRef& from, const MatrixRef& to);

/// An arc of a circle in the plane, its parameter the angle: center + radius (cos, sin)(start + s),
/// in pieces of at most π/8, each Taylor's polynomial of degree 13, which is the arc to rounding
/// (θ¹⁴/14! = 2.4e-17 of the radius).
/// @param radius  m, > 0. @param start  rad. @param sweep  rad, not 0, at most 2000 turns; negative
/// is clockwise. @errors ArgumentError::not_positive, not_finite, out_of_range.
[[nodiscard]] Expected<Path> arc_path(const Eigen::Vector2d& center, double radius, double start,
                                      double sweep);
/// The arc from a point with a direction to another point; a line where that is straight ahead.
/// @errors ArgumentError::not_finite; out_of_range for an end at the start or straight behind it.
[[nodiscard]] Expected<Path> arc_path(const Pose2d& start, const Eigen::Vector2d& end);

/// The cubic spline through waypoints with continuous second derivatives that vanish at both ends:
/// with d_i the knots' distances and m the derivatives
///
///     m_{i-1}/d_{i-1} + 2 (1/d_{i-1} + 1/d_i) m_i + m_{i+1}/d_i
///         = 3 ((p_i - p_{i-1})/d_{i-1}² + (p_{i+1} - p_i)/d_i²).
///
/// @param waypoints  Coordinates x two or more; one where the one before it is, is left out.
/// @errors ArgumentError::wrong_shape, empty (fewer than two), not_finite, out_of_range (all in one
///         place). Cost: O(n), allocates.
/// Source: de Boor, "A Practical Guide to Splines" (2001), chapter IV.
[[nodiscard]] Expected<Path> natural_cubic_path(const MatrixRef& waypoints,
                                                KnotSpacing spacing = KnotSpacing::centripetal);

/// The same with its derivatives at the ends given.
/// @param start, end  dq/ds, coordinates x 1. @errors As `natural_cubic_path`.
[[nodiscard]] Expected<Path> clamped_cubic_path(const MatrixRef& waypoints, const MatrixRef& start,
                                                const MatrixRef& end,
                                                KnotSpacing spacing = KnotSpacing::centripetal);

/// The cubics with these places and derivatives, each over a parameter of 1. Second derivatives
/// jump. @param derivatives  dq/ds, of the waypoints' shape.
/// @errors As `natural_cubic_path`; waypoints in one place are pieces of their own.
[[nodiscard]] Expected<Path> cubic_hermite_path(const MatrixRef& waypoints,
                                                const MatrixRef& derivatives);

/// The quintics with these places, first and second derivatives, each over a parameter of 1, as
/// WPILib's control vectors have them. @errors As `cubic_hermite_path`.
[[nodiscard]] Expected<Path> quintic_hermite_path(const MatrixRef& waypoints,
                                                  const MatrixRef& derivatives,
                                                  const MatrixRef& second);

/// A Bézier curve of any degree to 20, q(s) = Σ C(d, j) sʲ (1 - s)^{d-j} b_j.
/// @param points  Coordinates x (degree + 1), two or more.
/// @errors ArgumentError::wrong_shape, empty, not_finite, out_of_range (degree, all in one place).
[[nodiscard]] Expected<Path> bezier_path(const MatrixRef& points);

/// Bézier curves of one degree joined: the last point of each is the first of the next, as in
/// PathPlanner. @param points  Coordinates x (1 + degree · curves). @param degree  1 to 20.
/// @errors As `bezier_path`; wrong_shape for a count that is no 1 + degree · curves.
[[nodiscard]] Expected<Path> bezier_path(const MatrixRef& points, int degree);

/// The B-spline of a degree that begins at the first control point, ends at the last one and keeps
/// within their hull; its knots are 0, 1, 2 … between, and degree - 1 derivatives are continuous.
/// @param points  Coordinates x degree + 1 or more. @param degree  1 to 20.
/// @errors As `bezier_path`. Cost: O(points · degree³), allocates.
/// Source: de Boor, chapters IX and X; pieces by inserting knots (Boehm 1980).
[[nodiscard]] Expected<Path> b_spline_path(const MatrixRef& points, int degree = 3);

}  // namespace flyball
