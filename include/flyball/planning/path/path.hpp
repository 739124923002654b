#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/planning/splines/spline.hpp>

/// Paths in any number of coordinates: the plane (x, y), the pose of a holonomic robot (x, y, θ),
/// the joints of an arm.
namespace flyball {

/// Most coordinates of a path.
inline constexpr int max_path_coordinates = 16;

/// One number a coordinate, without the heap.
using PathVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_path_coordinates, 1>;

/// Where a path is and its derivatives, by its parameter or by its length.
struct PathState {
  PathVector position;  ///< q
  PathVector first;     ///< q'
  PathVector second;    ///< q''
  PathVector third;     ///< q'''
};

/// A polynomial q(t) = Σ c_k t^k, t in [0, 1].
struct PathPiece {
  Eigen::MatrixXd coefficients;  ///< Coordinates x (degree + 1); column k is that of t^k.
  double span = 1.0;             ///< How much of the path's parameter t covers, > 0.
};

/// A path q(s) of polynomial pieces, s from 0 to the sum of their spans; q is continuous. Every
/// curve that a builder makes (`build_path.hpp`) is one, arcs to rounding, so that all of them are
/// timed, joined, mirrored, reversed in one way.
///
/// Where the derivative jumps there is a corner, where it vanishes and turns a cusp. At a break
/// between two pieces the derivatives are those of the later piece.
class Path {
 public:
  /// Of pieces one after the other. @param pieces  One or more, of as many coordinates, each
  /// beginning where the one before it ends: to 1e-9 of the path's extent, and then moved there.
  /// @errors ArgumentError::empty (no piece), wrong_shape (coordinates differ, none, or more than
  ///         `max_path_coordinates`), not_finite, not_positive (a span), out_of_range (a gap, more
  ///         than degree 20, a path all in one place).
  /// Cost: O(pieces), allocates.
  [[nodiscard]] static Expected<Path> join(std::vector<PathPiece> pieces);
  /// Of a spline of the plane, each segment's span 1. @errors As `join`.
  [[nodiscard]] static Expected<Path> from(const Spline& spline);

  [[nodiscard]] int coordinates() const noexcept { return coordinates_; }
  [[nodiscard]] const std::vector<PathPiece>& pieces() const noexcept { return pieces_; }
  /// The parameter where each piece begins, and where the last one ends.
  [[nodiscard]] const std::vector<double>& breaks() const noexcept { return breaks_; }
  [[nodiscard]] double parameter_end() const noexcept { return breaks_.back(); }
  /// The piece in which a parameter is; the later one at a break, the nearest outside (and for
  /// NaN the first). Cost: O(log pieces), noexcept, allocation-free.
  [[nodiscard]] std::size_t piece_at(double s) const noexcept;

  /// q, q', q'', q''' by the parameter. @param s  Held to the path's range.
  /// Cost: O(coordinates · degree), noexcept, allocation-free.
  [[nodiscard]] PathState at(double s) const noexcept;
  /// The same of one piece. @param t  In [0, 1], not checked.
  [[nodiscard]] PathState at(std::size_t piece, double t) const noexcept;
  /// q alone.
  [[nodiscard]] PathVector position(double s) const noexcept;

 private:
  Path(std::vector<PathPiece> pieces, int coordinates);

  std::vector<PathPiece> pieces_;
  std::vector<double> breaks_;
  int coordinates_ = 0;
};

/// Derivatives by the arc length l from those by the parameter: with σ = |q'|, m = q'·q'',
/// N = σ² q'' - m q' and N' = σ² q''' + m q'' - (q''·q'' + q'·q''') q'
///
///     dq/dl = q'/σ,   d²q/dl² = N/σ⁴,   d³q/dl³ = N'/σ⁵ - 4 m N/σ⁷.
///
/// @param along  How many of the first coordinates the length is measured in (2 for poses); all
/// for 0 or less. Not finite where those do not move. noexcept, allocation-free.
[[nodiscard]] PathState by_arc_length(const PathState& state, int along = 0) noexcept;

/// How a path bends: of its first two coordinates κ = (x' y'' - x'' y')/|q'|³, positive to the
/// left. Not finite where they stop. Unit: 1/m.
[[nodiscard]] double planar_curvature(const PathState& state) noexcept;

/// |d²q/dl²| in any number of coordinates, never negative. @param along  As in `by_arc_length`.
[[nodiscard]] double curvature(const PathState& state, int along = 0) noexcept;

/// The direction of travel in the first two coordinates, rad in (-π, π]. Where they stop, it is
/// that in which they go on: of q'' or, if that vanishes too, of q'''.
[[nodiscard]] double travel_heading(const PathState& state) noexcept;

/// ∫ |q'| ds between two parameters by Gauss and Legendre's rule of 8 points, halved until it and
/// its halves agree to 1e-13 of the whole (40 times at most, at a cusp).
/// @param from, to  Held to the path's range; negative where `to` comes first.
/// @param along  As in `by_arc_length`. Cost: some µs a piece, noexcept, allocation-free.
[[nodiscard]] double path_length(const Path& path, double from, double to, int along = 0) noexcept;
/// Of the whole path.
[[nodiscard]] double path_length(const Path& path, int along = 0) noexcept;

/// The length along a path by its parameter, and back.
class ArcLength {
 public:
  /// @param path  Must outlive this. @param along  As in `by_arc_length`. Cost: `path_length`.
  explicit ArcLength(const Path& path, int along = 0);

  [[nodiscard]] double total() const noexcept { return lengths_.back(); }
  /// From the beginning to a parameter. Cost: `path_length` of a part of a piece.
  [[nodiscard]] double length(double s) const noexcept;
  /// The parameter at a length, by Newton's method within bisection (60 steps at most).
  /// @param length  Held to [0, total].
  [[nodiscard]] double parameter(double length) const noexcept;

 private:
  const Path* path_;
  int along_;
  std::vector<double> lengths_;  ///< Before each piece, and of all.
};

/// Parameters along a path between which its chords are near: each distance from the curve to its
/// chord is at most the tolerance. The curve is within the hull of its Bézier points, so the bound
/// is one, not an estimate; few where it is straight, many where it bends.
/// @param tolerance  > 0, in the coordinates' unit. @param along  As in `by_arc_length`.
/// @return Ascending, the breaks among them.
/// @errors ArgumentError::not_positive, not_finite; out_of_range where more than a million would be
///         needed. Cost: O(points), allocates.
[[nodiscard]] Expected<std::vector<double>> chord_parameters(const Path& path, double tolerance,
                                                             int along = 0);

}  // namespace flyball
