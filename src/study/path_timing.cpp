// Times along a path.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"
#include "study/path_route.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

constexpr std::string_view where = "path";
constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double gravity = 9.80665;
constexpr double none = std::numeric_limits<double>::infinity();

/// A point of a part of the path.
struct Station {
  double position = 0.0;  ///< Segment and parameter.
  Vector2d place = Vector2d::Zero();
  double way = 0.0;  ///< rad, in which it goes.
  double curvature = 0.0;
  double heading = 0.0;  ///< rad, continuous.
  double turn = 0.0;     ///< dθ/ds
  double bend = 0.0;     ///< d²θ/ds²
  RouteLimits limits{};
};

/// Lengths along a segment at even parameters.
class SegmentLength {
 public:
  explicit SegmentLength(const SplineSegment& segment) : segment_(segment) {
    lengths_[0] = 0.0;
    for (std::size_t i = 1; i < lengths_.size(); ++i) {
      // Simpson's rule on |p'|.
      const double a = static_cast<double>(i - 1) / steps;
      const double b = static_cast<double>(i) / steps;
      const auto speed = [&](double t) { return segment_.at(t).derivative.norm(); };
      lengths_[i] =
          lengths_[i - 1] + (b - a) / 6.0 * (speed(a) + 4.0 * speed(0.5 * (a + b)) + speed(b));
    }
  }
  [[nodiscard]] double total() const { return lengths_.back(); }
  [[nodiscard]] double parameter(double length) const {
    const auto next = std::upper_bound(lengths_.begin(), lengths_.end(), length);
    if (next == lengths_.begin()) {
      return 0.0;
    }
    if (next == lengths_.end()) {
      return 1.0;
    }
    const auto i = static_cast<std::size_t>(next - lengths_.begin());
    const double share = (length - lengths_[i - 1]) / (lengths_[i] - lengths_[i - 1]);
    return (static_cast<double>(i - 1) + share) / steps;
  }
  [[nodiscard]] double length(double parameter) const {
    const double at = std::clamp(parameter, 0.0, 1.0) * steps;
    const auto i = std::min(static_cast<std::size_t>(at), lengths_.size() - 2);
    return lengths_[i] + (at - static_cast<double>(i)) * (lengths_[i + 1] - lengths_[i]);
  }

 private:
  static constexpr int steps = 200;
  const SplineSegment& segment_;
  std::array<double, steps + 1> lengths_{};
};

/// The direction in which a segment leaves or arrives, past an end at which its derivative is zero.
Vector2d direction(const SplineSegment& segment, bool at_end) {
  for (const double away : {0.0, 1e-6, 1e-4, 1e-2}) {
    const Vector2d d = segment.at(at_end ? 1.0 - away : away).derivative;
    if (d.norm() > 1e-9) {
      return d.normalized();
    }
  }
  return {1.0, 0.0};
}

/// Segments between two stops.
struct Part {
  std::size_t first = 0, last = 0;  ///< Inclusive.
};

std::vector<Part> parts_of(const RouteShape& shape) {
  constexpr double straight = 0.9986;  // cos 3°
  std::vector<Part> parts{{0, 0}};
  for (std::size_t i = 1; i < shape.segments.size(); ++i) {
    const bool corner =
        direction(shape.segments[i - 1], true).dot(direction(shape.segments[i], false)) < straight;
    const bool stop = std::any_of(shape.stops.begin(), shape.stops.end(), [&](double at) {
      return std::abs(at - static_cast<double>(i)) < 1e-9;
    });
    if (corner || stop) {
      parts.push_back({i, i});
    } else {
      parts.back().last = i;
    }
  }
  return parts;
}

/// Even distances along a part.
std::vector<Station> stations_of(const RouteShape& shape, const Part& part,
                                 const std::vector<SegmentLength>& lengths, double& spacing) {
  double total = 0.0;
  for (std::size_t i = part.first; i <= part.last; ++i) {
    total += lengths[i].total();
  }
  constexpr double usual = 0.01;  // m
  const auto count =
      static_cast<std::size_t>(std::clamp(std::ceil(total / usual), 200.0, 20'000.0));
  spacing = total / static_cast<double>(count);
  std::vector<Station> stations(count + 1);
  std::size_t segment = part.first;
  double before = 0.0;
  for (std::size_t k = 0; k <= count; ++k) {
    const double s = spacing * static_cast<double>(k);
    while (segment < part.last && s > before + lengths[segment].total()) {
      before += lengths[segment].total();
      ++segment;
    }
    const SplineSegment& of = shape.segments[segment];
    double t = k == count ? 1.0 : lengths[segment].parameter(s - before);
    Station& station = stations[k];
    station.position = static_cast<double>(segment) + t;
    station.place = of.at(t).position;
    // Where the derivative vanishes, at the end of a cubic whose control point is its anchor.
    if (of.at(t).derivative.norm() < 1e-9) {
      t = std::clamp(t, 1e-4, 1.0 - 1e-4);
    }
    const PathPoint point = of.point(t);
    station.way = point.pose.angle();
    station.curvature = std::isfinite(point.curvature) ? point.curvature : 0.0;
  }
  for (std::size_t k = 1; k <= count; ++k) {
    stations[k].way =
        stations[k - 1].way + std::remainder(stations[k].way - stations[k - 1].way, two_pi);
  }
  return stations;
}

/// 3 s² - 2 s³
double smooth(double s) {
  return s * s * (3.0 - 2.0 * s);
}

/// Running means of a width, twice; past the ends the values go on as on the other side of them, so
/// that the ends stay.
void soften(std::vector<double>& values, std::size_t width) {
  const std::size_t n = values.size();
  width = std::min(width, (n - 1) / 2);
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<double> sums{0.0};
    sums.reserve(n + 2 * width + 1);
    for (std::size_t k = width; k > 0; --k) {
      sums.push_back(sums.back() + 2.0 * values.front() - values[k]);
    }
    for (const double value : values) {
      sums.push_back(sums.back() + value);
    }
    for (std::size_t k = 1; k <= width; ++k) {
      sums.push_back(sums.back() + 2.0 * values.back() - values[n - 1 - k]);
    }
    for (std::size_t i = 0; i < n; ++i) {
      values[i] = (sums[i + 2 * width + 1] - sums[i]) / static_cast<double>(2 * width + 1);
    }
  }
}

/// The way that the robot looks, over the whole path.
void take_headings(const RouteShape& shape, std::vector<std::vector<Station>>& parts,
                   const std::vector<double>& spacings) {
  if (shape.headings.empty()) {
    double heading = 0.0;
    bool first = true;
    for (std::vector<Station>& part : parts) {
      // It goes on in the direction in which it looks, or backs after a cusp.
      double offset = shape.reversed ? std::numbers::pi : 0.0;
      if (!first) {
        const double step = std::remainder(part.front().way - heading, two_pi);
        offset = heading + step - part.front().way;
        if (std::abs(step) > 0.5 * std::numbers::pi) {
          offset += step > 0.0 ? -std::numbers::pi : std::numbers::pi;
        }
      }
      for (Station& station : part) {
        station.heading = station.way + offset;
        station.turn = station.curvature;
      }
      heading = part.back().heading;
      first = false;
    }
    return;
  }
  // Over the length of all parts, with targets from place to place.
  struct Target {
    double s, heading;
  };
  std::vector<Station*> all;
  std::vector<double> s;
  double at = 0.0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t k = 0; k < parts[p].size(); ++k) {
      at += k > 0 ? spacings[p] : 0.0;
      all.push_back(&parts[p][k]);
      s.push_back(at);
    }
  }
  const auto index_of = [&](double position) {
    const auto found =
        std::lower_bound(all.begin(), all.end(), position,
                         [](const Station* station, double p) { return station->position < p; });
    return std::min(static_cast<std::size_t>(found - all.begin()), all.size() - 1);
  };
  const auto looks = [&](const RoutePointing& pointing, std::size_t i) {
    const Vector2d d = pointing.place - all[i]->place;
    return std::atan2(d(1), d(0)) + pointing.offset;
  };
  std::vector<std::pair<std::size_t, double>> targets;
  for (const RouteHeading& heading : shape.headings) {
    const bool covered =
        std::any_of(shape.pointing.begin(), shape.pointing.end(), [&](const RoutePointing& zone) {
          return heading.position > zone.from && heading.position < zone.to;
        });
    if (!covered) {
      targets.emplace_back(index_of(heading.position), heading.heading);
    }
  }
  for (const RoutePointing& zone : shape.pointing) {
    for (std::size_t i = index_of(zone.from); i <= index_of(zone.to); ++i) {
      targets.emplace_back(i, looks(zone, i));
    }
  }
  std::stable_sort(targets.begin(), targets.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<double> headings(all.size(), targets.front().second);
  double angle = targets.front().second;
  std::size_t last = targets.front().first;
  for (const auto& [index, wanted] : targets) {
    const double next = angle + std::remainder(wanted - angle, two_pi);
    for (std::size_t i = last; i <= index; ++i) {
      const double span = s[index] - s[last];
      const double share = span > 0.0 ? (s[i] - s[last]) / span : 1.0;
      headings[i] = angle + (next - angle) * (shape.dense_headings ? share : smooth(share));
    }
    angle = next;
    last = index;
  }
  for (std::size_t i = last; i < headings.size(); ++i) {
    headings[i] = angle;
  }
  if (!shape.pointing.empty() || shape.dense_headings) {
    soften(headings, 20);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i]->heading = headings[i];
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const double h = spacings[p];
    std::vector<Station>& part = parts[p];
    for (std::size_t k = 0; k < part.size(); ++k) {
      const std::size_t a = k == 0 ? 0 : k - 1;
      const std::size_t b = std::min(k + 1, part.size() - 1);
      part[k].turn = (part[b].heading - part[a].heading) / (h * static_cast<double>(b - a));
    }
  }
}

/// What a robot adds to the limits.
class RobotLimits {
 public:
  RobotLimits(const std::optional<DriveRobot>& robot, double voltage) {
    if (!robot) {
      return;
    }
    known_ = true;
    robot_ = *robot;
    voltage_ = voltage;
    wheel_speed_ = robot->free_speed(voltage);
    grip_ = robot->grip * gravity;
    const double shafts = robot->kind == DriveKind::differential ? 2.0 : 4.0;
    const double r = robot->wheel_radius;
    per_volt_ = shafts * robot->motor.Kt * robot->gearing / (r * robot->motor.R);
    back_ = robot->gearing / (r * robot->motor.Kv);
    current_force_ = shafts * robot->motor.Kt * robot->gearing / r * robot->stator_limit;
    mass_ = robot->mass + shafts * robot->wheel_inertia / (r * r);
  }
  /// The fastest wheel over the robot's speed.
  [[nodiscard]] double wheel_factor(const Station& station) const {
    if (robot_.kind == DriveKind::differential) {
      return 1.0 + 0.5 * robot_.trackwidth * std::abs(station.turn);
    }
    const double angle = station.way - station.heading;
    const Vector2d p(std::cos(angle), std::sin(angle));
    double most = 0.0;
    for (const Vector2d& module : robot_.modules) {
      const Vector2d w = p + station.turn * Vector2d(-module(1), module(0));
      most = std::max(
          most, robot_.kind == DriveKind::mecanum ? std::abs(w(0)) + std::abs(w(1)) : w.norm());
    }
    return most;
  }
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] double wheel_speed() const { return wheel_speed_; }
  [[nodiscard]] double grip() const { return grip_; }
  /// m/s² that the motors give. @param wheel  m/s, of the fastest.
  [[nodiscard]] double acceleration(double wheel, bool brakes) const {
    const double volts = voltage_ + (brakes ? 1.0 : -1.0) * back_ * wheel;
    return std::max(0.0, std::min(per_volt_ * volts, current_force_)) / mass_;
  }

 private:
  bool known_ = false;
  DriveRobot robot_{};
  double voltage_ = 0.0, wheel_speed_ = none, grip_ = none;
  double per_volt_ = 0.0, back_ = 0.0, current_force_ = none, mass_ = 1.0;
};

/// A number and the limit that it comes of.
struct Bound {
  double value = none;
  const char* limit = "";

  void take(double other, const char* name) {
    if (other < value) {
      value = other;
      limit = name;
    }
  }
};

Bound speed_bound(const Station& at, const RobotLimits& robot) {
  Bound bound;
  bound.take(at.limits.velocity, "velocity");
  const double bend = std::abs(at.curvature);
  if (bend > 0.0) {
    bound.take(std::sqrt(at.limits.centripetal / bend), "centripetal acceleration");
    bound.take(std::sqrt(robot.grip() / bend), "grip");
  }
  if (at.turn != 0.0) {
    bound.take(at.limits.angular_velocity / std::abs(at.turn), "angular velocity");
  }
  if (at.bend != 0.0) {
    bound.take(std::sqrt(at.limits.angular_acceleration / std::abs(at.bend)),
               "angular acceleration");
  }
  if (robot.known()) {
    bound.take(robot.wheel_speed() / robot.wheel_factor(at), "wheel speed");
  }
  return bound;
}

/// How fast the speed may grow (or, braking, shrink) at a speed.
Bound acceleration_bound(const Station& at, double v, bool brakes, const RobotLimits& robot) {
  Bound bound;
  bound.take(at.limits.acceleration, "acceleration");
  if (at.turn != 0.0) {
    // |θ' a + θ'' v²| <= α
    const double sign = brakes ? -1.0 : 1.0;
    const double toward = at.turn * sign > 0.0 ? 1.0 : -1.0;
    bound.take((at.limits.angular_acceleration - toward * at.bend * v * v) / std::abs(at.turn),
               "angular acceleration");
  }
  if (robot.known()) {
    const double across = v * v * at.curvature;
    bound.take(std::sqrt(std::max(0.0, robot.grip() * robot.grip() - across * across)), "grip");
    bound.take(robot.acceleration(v * robot.wheel_factor(at), brakes), "the motors");
  }
  bound.value = std::max(bound.value, 0.0);
  return bound;
}

RouteLimits lower(const RouteLimits& a, const RouteLimits& b) {
  return {std::min(a.velocity, b.velocity), std::min(a.acceleration, b.acceleration),
          std::min(a.centripetal, b.centripetal), std::min(a.angular_velocity, b.angular_velocity),
          std::min(a.angular_acceleration, b.angular_acceleration)};
}

/// An end's velocity, if it can be.
Expected<void> check_end(double wanted, double possible, bool start, const RouteShape& shape) {
  if (wanted <= possible * (1.0 + 1e-9) + 1e-9) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, shape.source,
                 start ? "the start velocity" : "the end velocity")
      .got(fmt::format("{} m/s", format_number(wanted, 4)))
      .expected(fmt::format("at most the {} m/s that the limits and the path's length leave",
                            format_number(possible, 4)))
      .hint(start ? "--start-velocity gives another" : "--end-velocity gives another");
}

/// Speeds at a part's stations and what holds each interval back.
Expected<std::vector<double>> speeds_of(const std::vector<Station>& stations, double spacing,
                                        double start, double end, const RobotLimits& robot,
                                        const RouteShape& shape, std::vector<const char*>& limits) {
  const std::size_t n = stations.size();
  std::vector<Bound> caps;
  for (const Station& station : stations) {
    caps.push_back(speed_bound(station, robot));
  }
  std::vector<double> v(n);
  std::vector<const char*> up(n, "");
  std::vector<const char*> down(n, "");
  const auto reach = [&](std::size_t from, std::size_t to, double speed, bool brakes) {
    Bound a = acceleration_bound(stations[from], speed, brakes, robot);
    const Bound b = acceleration_bound(stations[to], speed, brakes, robot);
    a.take(b.value, b.limit);
    return Bound{std::sqrt(speed * speed + 2.0 * a.value * spacing), a.limit};
  };
  FLYBALL_CHECK(check_end(start, caps.front().value, true, shape));
  FLYBALL_CHECK(check_end(end, caps.back().value, false, shape));
  v[0] = start;
  for (std::size_t i = 1; i < n; ++i) {
    const Bound reached = reach(i - 1, i, v[i - 1], false);
    v[i] = std::min(caps[i].value, reached.value);
    up[i - 1] = reached.value < caps[i].value ? reached.limit : "";
  }
  FLYBALL_CHECK(check_end(end, v[n - 1], false, shape));
  v[n - 1] = end;
  for (std::size_t i = n - 1; i-- > 0;) {
    const Bound reached = reach(i + 1, i, v[i + 1], true);
    if (reached.value < v[i]) {
      if (i == 0) {
        FLYBALL_CHECK(check_end(start, reached.value, true, shape));
      }
      v[i] = reached.value;
      down[i] = reached.limit;
    }
  }
  limits.assign(n - 1, "");
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const bool braked = down[i][0] != '\0';
    limits[i] = braked                                       ? down[i]
                : up[i][0] != '\0' && down[i + 1][0] == '\0' ? up[i]
                                                             : caps[i + 1].limit;
  }
  return v;
}

}  // namespace

Expected<TimedRoute> time_route(const RouteShape& shape, const std::optional<DriveRobot>& robot,
                                double voltage) {
  if (shape.segments.empty()) {
    return refusal(ArgumentError::empty, shape.source, "the path").got("without a segment");
  }
  for (const auto& [value, name] :
       {std::pair(shape.limits.velocity, "the velocity limit"),
        {shape.limits.acceleration, "the acceleration limit"},
        {shape.limits.centripetal, "the centripetal limit"},
        {shape.limits.angular_velocity, "the angular velocity limit"},
        {shape.limits.angular_acceleration, "the angular acceleration limit"}}) {
    if (!(value > 0.0)) {
      return refusal(ArgumentError::not_positive, shape.source, name)
          .got(format_number(value))
          .expected("positive");
    }
  }
  const RobotLimits limits_of_robot(robot, voltage);
  std::vector<SegmentLength> lengths;
  for (const SplineSegment& segment : shape.segments) {
    lengths.emplace_back(segment);
    constexpr double least = 1e-6;  // m
    constexpr double most = 1e4;
    if (!(lengths.back().total() > least && lengths.back().total() < most)) {
      return refusal(ArgumentError::out_of_range, shape.source,
                     fmt::format("segment {} of the path", lengths.size()))
          .got(fmt::format("{} m long", format_number(lengths.back().total(), 4)))
          .expected("longer than 1e-6 m and shorter than 10 km")
          .hint("take one of the waypoints that are in one place out");
    }
  }
  std::vector<std::vector<Station>> parts;
  std::vector<double> spacings;
  for (const Part& part : parts_of(shape)) {
    double spacing = 0.0;
    parts.push_back(stations_of(shape, part, lengths, spacing));
    spacings.push_back(spacing);
  }
  take_headings(shape, parts, spacings);
  TimedRoute result;
  RobotTrajectory& trajectory = result.trajectory;
  trajectory.source = shape.source;
  trajectory.holonomic = !shape.headings.empty();
  trajectory.diagnostics = shape.diagnostics;
  double t = 0.0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<Station>& part = parts[p];
    const double h = spacings[p];
    for (std::size_t k = 0; k < part.size(); ++k) {
      const std::size_t a = k == 0 ? 0 : k - 1;
      const std::size_t b = std::min(k + 1, part.size() - 1);
      part[k].bend = (part[b].turn - part[a].turn) / (h * static_cast<double>(b - a));
      part[k].limits = shape.limits;
      for (const RouteZone& zone : shape.zones) {
        if (part[k].position >= zone.from - 1e-9 && part[k].position <= zone.to + 1e-9) {
          part[k].limits = lower(part[k].limits, zone.limits);
        }
      }
    }
    std::vector<const char*> held;
    FLYBALL_TRY(
        const std::vector<double> v,
        speeds_of(part, h, p == 0 ? shape.start_velocity : 0.0,
                  p + 1 == parts.size() ? shape.end_velocity : 0.0, limits_of_robot, shape, held));
    for (std::size_t k = 0; k < part.size(); ++k) {
      const Station& at = part[k];
      if (k > 0) {
        const double mean = 0.5 * (v[k - 1] + v[k]);
        if (!(mean > 1e-9)) {
          return refusal(ArgumentError::out_of_range, shape.source, "the path")
              .got(fmt::format("not to be driven at ({}, {}) m", format_number(at.place(0), 4),
                               format_number(at.place(1), 4)))
              .expected("one that turns within the limits")
              .hint("widen its bends, or raise the limits");
        }
        const double from = t;
        t += h / mean;
        if (result.binding.empty() || result.binding.back().limit != held[k - 1]) {
          result.binding.push_back({from, t, held[k - 1]});
        } else {
          result.binding.back().to = t;
        }
      } else if (p > 0) {
        continue;  // the end of the part before
      }
      const Vector2d along(std::cos(at.way), std::sin(at.way));
      const Vector2d across(-along(1), along(0));
      const std::size_t next = std::min(k + 1, part.size() - 1);
      const std::size_t from = next - 1;
      const double a = (v[next] * v[next] - v[from] * v[from]) / (2.0 * h);
      MotionSample sample{.time = t, .pose = Pose2d(at.place(0), at.place(1), at.heading)};
      sample.velocity = v[k] * along;
      sample.omega = v[k] * at.turn;
      sample.acceleration = a * along + v[k] * v[k] * at.curvature * across;
      trajectory.samples.push_back(sample);
    }
  }
  return result;
}

}  // namespace flyball::study
