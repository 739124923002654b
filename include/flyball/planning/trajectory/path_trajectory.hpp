#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/path/path.hpp>
#include <flyball/planning/trajectory/path_constraint.hpp>
#include <flyball/planning/trajectory/trajectory.hpp>

namespace flyball {

/// Where a motion along a path is at a time.
struct PathSample {
  double time = 0.0;        ///< s
  double parameter = 0.0;   ///< s of the path
  double rate = 0.0;        ///< ds/dt
  PathVector position;      ///< q
  PathVector velocity;      ///< q' ds/dt
  PathVector acceleration;  ///< q'' (ds/dt)² + q' d²s/dt²
};

/// A stretch of a motion, and the limit that holds it back there.
struct BindingLimit {
  double from = 0.0;   ///< Parameter of the path.
  double to = 0.0;     ///< Parameter of the path.
  double start = 0.0;  ///< s, the time at `from`.
  double end = 0.0;    ///< s, the time at `to`.
  std::string limit;   ///< "coordinate 2: acceleration", "left side: voltage", …
  double use = 0.0;    ///< Of the limit, on the average over the stretch: 1 is all of it. Of a
                       ///< velocity it is the square.
};

/// A path with its timing: over intervals of the parameter (ds/dt)² is a parabola,
///
///     x(s) = x_0 + 2 u_0 s + c s²,   d²s/dt² = u_0 + c s,
///
/// so that in time s is a parabola, a hyperbolic or a circular function, and exact; beside stops of
/// a motion whose jerk is limited d³s/dt³ is constant instead.
class PathTrajectory {
 public:
  [[nodiscard]] const Path& path() const noexcept { return path_; }
  /// s
  [[nodiscard]] double total_time() const noexcept { return total_time_; }
  /// At a time, held to [0, total time] (NaN is the start). Cost: O(1) and a polynomial a
  /// coordinate; noexcept, allocation-free.
  [[nodiscard]] PathSample sample(double t) const noexcept;
  /// d³q/dt³ of the time, by the path's derivatives and ds/dt, d²s/dt², d³s/dt³. It jumps between
  /// intervals, and where no jerk is limited accelerations do. Cost as of `sample`.
  [[nodiscard]] PathVector jerk(double t) const noexcept;
  /// What binds, neighbouring intervals of one limit together. Cost: O(intervals · limits),
  /// allocates.
  [[nodiscard]] std::vector<BindingLimit> binding() const;
  /// Between how many values of the parameter x(s) is one parabola.
  [[nodiscard]] std::size_t intervals() const noexcept { return spans_.size(); }
  /// The parameters between the intervals, both ends among them.
  [[nodiscard]] std::vector<double> parameters() const;
  /// The times at those.
  [[nodiscard]] std::vector<double> times() const;

  /// One interval as `time_optimal` makes it.
  struct Span {
    double start = 0.0;      ///< s, its time.
    double duration = 0.0;   ///< s
    double parameter = 0.0;  ///< Where it begins, from the beginning of its piece.
    double width = 0.0;      ///< Of the parameter.
    double rate = 0.0;       ///< ds/dt at its beginning.
    double u = 0.0;          ///< d²s/dt² there.
    double c = 0.0;          ///< 1/s², by how much that rises with s.
    double jerk = 0.0;       ///< d³s/dt³ where it is constant instead: from rest and to it.
    std::size_t piece = 0;   ///< Of the path.
    double scale = 1.0;      ///< 1 over the piece's span.
  };
  /// @param spans  One or more, one after the other. @param constraints  That it keeps to.
  PathTrajectory(Path path, std::vector<Span> spans, std::vector<PathConstraint> constraints);

  [[nodiscard]] const std::vector<Span>& spans() const noexcept { return spans_; }
  [[nodiscard]] const std::vector<PathConstraint>& constraints() const noexcept {
    return constraints_;
  }

 private:
  [[nodiscard]] std::size_t span_at(double t) const noexcept;
  struct Progress;
  [[nodiscard]] Progress progress(const Span& span, double t) const noexcept;

  Path path_;
  std::vector<Span> spans_;
  std::vector<PathConstraint> constraints_;
  std::vector<std::size_t> buckets_;  ///< The span at each of equal parts of the total time.
  double total_time_ = 0.0;
  double buckets_per_second_ = 0.0;
};

/// How fast the ends are, and how finely the timing is cut.
struct TimingOptions {
  double start_velocity = 0.0;  ///< |dq/dt| at the start, >= 0, in the coordinates' unit a second.
  double end_velocity = 0.0;    ///< |dq/dt| at the end, >= 0.
  /// How far the time is from the fastest, relative and on the average of many paths; the limits
  /// hold in any case. Half of it takes about 1.4 times as long. In [1e-6, 0.1].
  double tolerance = 1.5e-3;
};

/// The fastest motion along a path under limits that hold at every point of it, not only at a
/// grid's.
///
/// Over each interval of the parameter x = (ds/dt)² is a parabola with Bézier points b_0, b_1, b_2,
/// so that an acceleration q'' x + q' u and whatever is linear in u = d²s/dt² and x is a polynomial
/// whose Bézier points are linear in b; the limits are put on those, and a polynomial is within the
/// hull of them. The largest b_0 from which the rest of the path can be driven is a linear program
/// of three variables (back from the end); the largest b_2 then one of two (forward from the
/// start). A second pass cuts the intervals in which no limit is used up.
///
/// @param path  Corners of it (`path_stops`) are driven to a stop. So are the places where the
/// curvature jumps (from a line to an arc), if the turning rate is the way's — of a differential
/// drive, or under an angular acceleration limit on a path (x, y): there it would jump, too.
/// @param constraints  Something must limit the velocity everywhere. If nothing limits an
/// acceleration, the velocity jumps to its limit at the ends and corners, whatever it is to be
/// there.
/// @errors ArgumentError::empty (no constraint), not_positive (a limit that is zero or negative),
///         not_finite (NaN), wrong_shape (not one limit a coordinate; a drive on a path that is not
///         of the plane), out_of_range: an end's velocity above what the limits allow there, or
///         that the path is too short to brake from or to reach; a friction that the motors cannot
///         overcome; limits of jerks with which no motion was found.
/// Where a jerk is limited d²s/dt² is continuous, too, and vanishes at stops and at the ends (of an
/// end that is passed the acceleration along the path). With s⃛ = ½ x'' √x the jerk is √x times what
/// is linear in b, and 1/√x is convex: convex programs of all intervals together, each about the
/// motion of the one before it and within the limits, come to a motion that no small change makes
/// faster. Limits of coordinates' jerks and of the whole jerk of travel make stops of places where
/// the curvature jumps. The tolerance is then 5e-5 or more.
///
/// Cost: O(intervals · limits), 10 to 40 intervals a piece; with limits of jerks some hundred to a
/// thousand times as much. Allocates.
/// Source: Pham and Pham, "A new approach to time-optimal path parameterization based on
/// reachability analysis", IEEE T-RO 34 (2018), for the two passes; Debrouwere et al.,
/// "Time-optimal path following for robots with convex-concave constraints using sequential convex
/// programming", IEEE T-RO 29 (2013), for those of jerks; the Bézier points in place of a grid's
/// are Flyball's.
[[nodiscard]] Expected<PathTrajectory> time_optimal(const Path& path,
                                                    std::span<const PathConstraint> constraints,
                                                    const TimingOptions& options = {});

/// The points of a trajectory of the plane as followers take them (`Trajectory`): pose, velocity
/// and curvature. Of three coordinates the third is the heading, of two it is that of travel.
/// @param step  s, > 0, between two points at most.
/// @errors ArgumentError::wrong_shape (coordinates other than two or three), not_positive,
///         not_finite, out_of_range (more than a million points).
[[nodiscard]] Expected<Trajectory> planar_trajectory(const PathTrajectory& trajectory,
                                                     double step = 0.02);

}  // namespace flyball
