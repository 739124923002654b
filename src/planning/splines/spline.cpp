#include <flyball/planning/splines/spline.hpp>

#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;

/// Of a segment's derivatives, times the length of its chord.
constexpr double tangent_scale = 1.2;

Expected<void> check_places(std::span<const Vector2d> places, std::string_view where) {
  if (places.size() < 2) {
    return refusal(ArgumentError::empty, where, "waypoints")
        .got(detail::format("{} of them", places.size()))
        .expected("two or more");
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    FLYBALL_CHECK(check_finite(places[i], where, detail::format("waypoint {}", i + 1)));
    if (i > 0 && !((places[i] - places[i - 1]).norm() > 0.0)) {
      return refusal(ArgumentError::out_of_range, where, detail::format("waypoint {}", i + 1))
          .got("where the one before it is")
          .expected("somewhere else");
    }
  }
  return {};
}

Vector2d direction(const Pose2d& pose) {
  return {pose.rotation().cos(), pose.rotation().sin()};
}

}  // namespace

SplineEnd SplineSegment::at(double t) const noexcept {
  SplineEnd value{c_.col(5), Vector2d::Zero(), Vector2d::Zero()};
  for (int k = 4; k >= 0; --k) {
    value.second = value.second * t + 2.0 * value.derivative;
    value.derivative = value.derivative * t + value.position;
    value.position = value.position * t + c_.col(k);
  }
  return value;
}

PathPoint SplineSegment::point(double t) const noexcept {
  const SplineEnd p = at(t);
  const Vector2d& v = p.derivative;
  const double speed = v.norm();
  return {Pose2d(p.position, Rotation2d::from_direction(v(0), v(1))),
          (v(0) * p.second(1) - v(1) * p.second(0)) / (speed * speed * speed)};
}

SplineSegment cubic_hermite(const SplineEnd& start, const SplineEnd& end) noexcept {
  const Vector2d d = end.position - start.position;
  SplineSegment::Coefficients c = SplineSegment::Coefficients::Zero();
  c.col(0) = start.position;
  c.col(1) = start.derivative;
  c.col(2) = 3.0 * d - 2.0 * start.derivative - end.derivative;
  c.col(3) = -2.0 * d + start.derivative + end.derivative;
  return SplineSegment(c);
}

SplineSegment quintic_hermite(const SplineEnd& start, const SplineEnd& end) noexcept {
  const Vector2d d = end.position - start.position;
  SplineSegment::Coefficients c;
  c.col(0) = start.position;
  c.col(1) = start.derivative;
  c.col(2) = 0.5 * start.second;
  c.col(3) = 10.0 * d - 6.0 * start.derivative - 4.0 * end.derivative - 1.5 * start.second +
             0.5 * end.second;
  c.col(4) =
      -15.0 * d + 8.0 * start.derivative + 7.0 * end.derivative + 1.5 * start.second - end.second;
  c.col(5) = 6.0 * d - 3.0 * start.derivative - 3.0 * end.derivative - 0.5 * start.second +
             0.5 * end.second;
  return SplineSegment(c);
}

Expected<Spline> quintic_spline(std::span<const Pose2d> waypoints) {
  constexpr std::string_view where = "quintic_spline";
  std::vector<Vector2d> places;
  for (const Pose2d& pose : waypoints) {
    FLYBALL_CHECK(check_finite(direction(pose), where, "a heading"));
    places.push_back(pose.translation());
  }
  FLYBALL_CHECK(check_places(places, where));
  const std::size_t segments = waypoints.size() - 1;
  std::vector<double> chord(segments);
  std::vector<SplineEnd> starts(segments);
  std::vector<SplineEnd> ends(segments);
  for (std::size_t i = 0; i < segments; ++i) {
    chord[i] = (places[i + 1] - places[i]).norm();
    starts[i] = {places[i], tangent_scale * chord[i] * direction(waypoints[i])};
    ends[i] = {places[i + 1], tangent_scale * chord[i] * direction(waypoints[i + 1])};
  }
  for (std::size_t i = 0; i + 1 < segments; ++i) {
    // By the path's length over the chord's: so that what both sides share is the curvature.
    const Vector2d before =
        cubic_hermite(starts[i], ends[i]).at(1.0).second / (chord[i] * chord[i]);
    const Vector2d after =
        cubic_hermite(starts[i + 1], ends[i + 1]).at(0.0).second / (chord[i + 1] * chord[i + 1]);
    const Vector2d shared = (chord[i + 1] * before + chord[i] * after) / (chord[i] + chord[i + 1]);
    ends[i].second = shared * (chord[i] * chord[i]);
    starts[i + 1].second = shared * (chord[i + 1] * chord[i + 1]);
  }
  Spline spline;
  for (std::size_t i = 0; i < segments; ++i) {
    spline.push_back(quintic_hermite(starts[i], ends[i]));
  }
  return spline;
}

Expected<Spline> cubic_spline(const Pose2d& start, std::span<const Vector2d> interior,
                              const Pose2d& end) {
  constexpr std::string_view where = "cubic_spline";
  FLYBALL_CHECK(Checks(where)
                    .finite(direction(start), "the first heading")
                    .finite(direction(end), "the last heading"));
  std::vector<Vector2d> p{start.translation()};
  p.insert(p.end(), interior.begin(), interior.end());
  p.push_back(end.translation());
  FLYBALL_CHECK(check_places(p, where));
  const std::size_t last = p.size() - 1;
  std::vector<Vector2d> m(p.size());
  m[0] = tangent_scale * (p[1] - p[0]).norm() * direction(start);
  m[last] = tangent_scale * (p[last] - p[last - 1]).norm() * direction(end);
  // Thomas's elimination of the tridiagonal system; its diagonal dominates.
  std::vector<double> upper(p.size(), 0.0);
  for (std::size_t i = 1; i < last; ++i) {
    const double pivot = 4.0 - upper[i - 1];
    upper[i] = 1.0 / pivot;
    m[i] = (3.0 * (p[i + 1] - p[i - 1]) - m[i - 1]) / pivot;
  }
  for (std::size_t i = last - 1; i >= 1; --i) {
    m[i] -= upper[i] * m[i + 1];
  }
  Spline spline;
  for (std::size_t i = 0; i < last; ++i) {
    spline.push_back(cubic_hermite({p[i], m[i]}, {p[i + 1], m[i + 1]}));
  }
  return spline;
}

Expected<std::vector<PathPoint>> sample_path(const Spline& spline, const PathSpacing& spacing) {
  constexpr std::string_view where = "sample_path";
  constexpr std::size_t most_points = 1'000'000;
  // Beyond this many halvings two points are rounding apart: only a cusp asks for it.
  constexpr double least_interval = 1e-12;
  FLYBALL_CHECK(Checks(where)
                    .positive(spacing.along, "spacing.along", "m")
                    .positive(spacing.across, "spacing.across", "m")
                    .positive(spacing.turn, "spacing.turn", "rad"));
  if (spline.empty()) {
    return refusal(ArgumentError::empty, where, "spline").expected("one segment or more");
  }
  struct Interval {
    double t_1;
    PathPoint end;
  };
  std::vector<PathPoint> points;
  std::vector<Interval> open;
  for (std::size_t i = 0; i < spline.size(); ++i) {
    const SplineSegment& segment = spline[i];
    FLYBALL_CHECK(check_finite(segment.coefficients(), where, detail::format("segment {}", i + 1)));
    const auto stops_at = [&](const PathPoint& point) {
      return refusal(ArgumentError::out_of_range, where, detail::format("segment {}", i + 1))
          .got("one that stops and turns on the spot, or needs more than a million points")
          .expected("a smooth path")
          .hint("move its ends apart or turn their headings")
          .with("place", {point.pose.x(), point.pose.y()});
    };
    double t_0 = 0.0;
    PathPoint start = segment.point(t_0);
    if (points.empty()) {
      points.push_back(start);
    }
    open.assign(1, {1.0, segment.point(1.0)});
    while (!open.empty()) {
      const auto [t_1, end] = open.back();
      const Eigen::Vector3d twist = end.pose.minus(start.pose);
      const bool near = std::abs(twist(0)) <= spacing.along &&
                        std::abs(twist(1)) <= spacing.across && std::abs(twist(2)) <= spacing.turn;
      if (!std::isfinite(start.curvature) || !std::isfinite(end.curvature) ||
          points.size() >= most_points || (!near && t_1 - t_0 < least_interval)) {
        return stops_at(std::isfinite(start.curvature) ? end : start);
      }
      if (near) {
        points.push_back(end);
        start = end;
        t_0 = t_1;
        open.pop_back();
      } else {
        const double middle = 0.5 * (t_0 + t_1);
        open.push_back({middle, segment.point(middle)});
      }
    }
  }
  return points;
}

}  // namespace flyball
