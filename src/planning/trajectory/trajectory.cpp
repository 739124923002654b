#include <flyball/planning/trajectory/trajectory.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_time_path = "time_path";

/// The highest velocity at a point, whatever comes before and after it.
double velocity_cap(const PathPoint& point, const PathLimits& limits) {
  const double bend = std::abs(point.curvature);
  // v² |κ| <= centripetal
  return bend > 0.0 ? std::min(limits.velocity, std::sqrt(limits.centripetal / bend))
                    : limits.velocity;
}

/// v² <= v_before² + 2 a Δs at each point of a range, in its order.
template <class Velocities, class Lengths>
void reach(Velocities first, std::size_t count, Lengths length, double acceleration) {
  for (std::size_t i = 1; i < count; ++i) {
    const double before = *first;
    ++first;
    *first = std::min(*first, std::sqrt(before * before + 2.0 * acceleration * *length));
    ++length;
  }
}

Refusal end_velocity_refusal(std::string_view name, double wanted, double possible) {
  return refusal(ArgumentError::out_of_range, in_time_path, name)
      .got(detail::format("{:.4g} m/s", wanted))
      .expected(detail::format("at most {:.4g} m/s under the limits", possible));
}

}  // namespace

Expected<Trajectory> time_path(std::span<const PathPoint> path, const PathLimits& limits) {
  FLYBALL_CHECK(Checks(in_time_path)
                    .positive(limits.velocity, "limits.velocity", "m/s")
                    .positive(limits.acceleration, "limits.acceleration", "m/s²")
                    .not_negative(limits.start_velocity, "limits.start_velocity", "m/s")
                    .not_negative(limits.end_velocity, "limits.end_velocity", "m/s"));
  if (!(limits.centripetal > 0.0)) {
    return refusal(ArgumentError::not_positive, in_time_path, "limits.centripetal")
        .got(format_number(limits.centripetal) + " m/s²")
        .expected("positive, or infinite");
  }
  if (path.size() < 2) {
    return refusal(ArgumentError::empty, in_time_path, "path")
        .got(detail::format("{} points", path.size()))
        .expected("two points or more");
  }
  std::vector<PathPoint> points(path.begin(), path.end());
  if (points.size() == 2) {  // from rest to rest, speed needs a point in between
    const Pose2d middle = points[0].pose.interpolate(points[1].pose, 0.5);
    points.insert(points.begin() + 1, {middle, 0.5 * (points[0].curvature + points[1].curvature)});
  }
  const std::size_t n = points.size();
  std::vector<double> length;
  std::vector<double> v;
  for (std::size_t i = 0; i < n; ++i) {
    const PathPoint& point = points[i];
    const std::string name = detail::format("point {}", i + 1);
    FLYBALL_CHECK(
        Checks(in_time_path).finite(point.pose.matrix(), name).finite(point.curvature, name));
    v.push_back(velocity_cap(point, limits));
    if (i > 0) {
      length.push_back((point.pose.translation() - points[i - 1].pose.translation()).norm());
      if (!(length.back() > 0.0)) {
        return refusal(ArgumentError::out_of_range, in_time_path, name)
            .got("where the one before it is")
            .expected("somewhere else");
      }
    }
  }
  if (limits.start_velocity > v.front()) {
    return end_velocity_refusal("limits.start_velocity", limits.start_velocity, v.front());
  }
  if (limits.end_velocity > v.back()) {
    return end_velocity_refusal("limits.end_velocity", limits.end_velocity, v.back());
  }
  v.front() = limits.start_velocity;
  reach(v.begin(), n, length.begin(), limits.acceleration);
  // Rounding of the square root is no reason.
  if (limits.end_velocity > v.back() * (1.0 + 1e-12)) {
    return end_velocity_refusal("limits.end_velocity", limits.end_velocity, v.back());
  }
  v.back() = limits.end_velocity;
  reach(v.rbegin(), n, length.rbegin(), limits.acceleration);
  if (limits.start_velocity > v.front() * (1.0 + 1e-12)) {
    return end_velocity_refusal("limits.start_velocity", limits.start_velocity, v.front());
  }

  std::vector<TrajectoryPoint> timed;
  double t = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double acceleration = i + 1 < n
                                    ? (v[i + 1] - v[i]) * (v[i + 1] + v[i]) / (2.0 * length[i])
                                    : timed.back().acceleration;
    timed.push_back({t, v[i], acceleration, points[i].pose, points[i].curvature});
    if (i + 1 < n) {
      t += 2.0 * length[i] / (v[i] + v[i + 1]);
    }
  }
  return Trajectory(std::move(timed));
}

TrajectoryPoint Trajectory::sample(double t) const noexcept {
  if (!(t > points_.front().time)) {
    return points_.front();
  }
  if (t >= points_.back().time) {
    return points_.back();
  }
  const auto next =
      std::upper_bound(points_.begin(), points_.end(), t,
                       [](double time, const TrajectoryPoint& point) { return time < point.time; });
  const TrajectoryPoint& a = *(next - 1);
  const TrajectoryPoint& b = *next;
  const double dt = t - a.time;
  // Of the chord: s = v dt + a dt²/2 over what both ends' velocities cover.
  const double fraction = std::min(1.0, (a.velocity + 0.5 * a.acceleration * dt) * dt /
                                            (0.5 * (a.velocity + b.velocity) * (b.time - a.time)));
  return {t, a.velocity + a.acceleration * dt, a.acceleration, a.pose.interpolate(b.pose, fraction),
          a.curvature + fraction * (b.curvature - a.curvature)};
}

}  // namespace flyball
