#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/geometry/se2.hpp>

/// Paths of the plane as polynomials, and as points close enough for a trajectory.
namespace flyball {

/// A pose of a path, heading along it, and how the path bends there.
struct PathPoint {
  Pose2d pose;
  double curvature = 0.0;  ///< 1/m, positive to the left.
};

/// Position, first and second derivative by the parameter where a segment begins or ends.
struct SplineEnd {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< m
  Eigen::Vector2d derivative = Eigen::Vector2d::Zero();  ///< m
  Eigen::Vector2d second = Eigen::Vector2d::Zero();      ///< m
};

/// A polynomial of degree five or less, p(t) = Σ c_k t^k, t in [0, 1].
class SplineSegment {
 public:
  using Coefficients = Eigen::Matrix<double, 2, 6>;
  /// @param coefficients  m; column k is that of t^k.
  explicit SplineSegment(const Coefficients& coefficients) noexcept : c_(coefficients) {}

  [[nodiscard]] const Coefficients& coefficients() const noexcept { return c_; }
  /// p, p' and p'' at t.
  [[nodiscard]] SplineEnd at(double t) const noexcept;
  /// The pose along the path and κ = (x' y'' - x'' y')/|p'|³. Where p' vanishes there is no
  /// heading: the angle is that of the frame, the curvature not finite.
  [[nodiscard]] PathPoint point(double t) const noexcept;

 private:
  Coefficients c_;
};

/// The cubic with these positions and derivatives. @param start, end  Their second derivatives do
/// not count.
[[nodiscard]] SplineSegment cubic_hermite(const SplineEnd& start, const SplineEnd& end) noexcept;

/// The quintic with these positions, first and second derivatives.
[[nodiscard]] SplineSegment quintic_hermite(const SplineEnd& start, const SplineEnd& end) noexcept;

/// Segments one after the other.
using Spline = std::vector<SplineSegment>;

/// Quintics through poses: position and heading are met at each, and curvature is continuous.
///
/// The derivative at an end of a segment is 1.2 times its chord's length along the heading. At the
/// path's ends the curvature is zero; in between it is that of the cubics on both sides with the
/// same derivatives, the nearer side counting more.
/// @param waypoints  Two or more; neighbours in different places.
/// @errors ArgumentError::empty (fewer than two), not_finite, out_of_range (neighbours in one
///         place). Cost: O(n), allocates. Source: the tangents' scale and the idea of the second
///         derivatives are WPILib's (SplineHelper); here they are scaled by the chords, so that
///         curvature is continuous between segments of different length.
[[nodiscard]] Expected<Spline> quintic_spline(std::span<const Pose2d> waypoints);

/// The cubic spline with continuous second derivatives through points, its headings at the ends
/// given: m_{i-1} + 4 m_i + m_{i+1} = 3 (p_{i+1} - p_{i-1}) for the derivatives m.
/// @param interior  The points between, of any number. @errors As `quintic_spline`.
/// Source: de Boor, "A Practical Guide to Splines" (2001), chapter IV.
[[nodiscard]] Expected<Spline> cubic_spline(const Pose2d& start,
                                            std::span<const Eigen::Vector2d> interior,
                                            const Pose2d& end);

/// How far two neighbouring points of a path may be apart: the twist from one to the other.
struct PathSpacing {
  double along = 0.127;     ///< m, 5 inches.
  double across = 0.00127;  ///< m, 0.05 inches.
  double turn = 0.0872;     ///< rad, 5°.
};

/// Points along a spline, its ends and its knots among them: each interval of the parameter is
/// halved until the twist from its first point to its last is within the spacing.
/// @errors ArgumentError::empty; not_finite for coefficients; not_positive for a spacing;
///         out_of_range where the path stops and turns on the spot (a cusp), or needs more than a
///         million points, with its place as evidence.
/// Cost: O(points), allocates. Source: the rule of halving is that of WPILib's SplineParameterizer.
[[nodiscard]] Expected<std::vector<PathPoint>> sample_path(const Spline& spline,
                                                           const PathSpacing& spacing = {});

}  // namespace flyball
