#include <flyball/control/followers/pure_pursuit.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <flyball/core/signal.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_pure_pursuit_follower = "PurePursuitFollower";

Expected<void> check_settings(const PurePursuitSettings& settings) {
  const auto positive_or_infinite = [](double value, std::string_view name) {
    return value == std::numeric_limits<double>::infinity()
               ? Expected<void>()
               : check_positive(value, in_pure_pursuit_follower, name, "m/s²");
  };
  FLYBALL_CHECK(
      Checks(in_pure_pursuit_follower)
          .positive(settings.velocity, "velocity", "m/s")
          .within(settings.velocity, 0.0, largest_signal, "velocity", "m/s")
          .also([&] { return positive_or_infinite(settings.acceleration, "acceleration"); })
          .also([&] { return positive_or_infinite(settings.centripetal, "centripetal"); })
          .positive(settings.least_lookahead, "least_lookahead", "m")
          .within(settings.largest_lookahead, settings.least_lookahead, largest_signal,
                  "largest_lookahead", "m")
          .not_negative(settings.lookahead_time, "lookahead_time", "s")
          .not_negative(settings.heading_gain, "heading_gain", "1/s")
          .positive(settings.tolerance, "tolerance", "m")
          .positive(settings.period.si(), "period", "s")
          .also([&] {
            return detail::check_speed_limits(settings.limits, in_pure_pursuit_follower);
          }));
  if (settings.reversed && settings.drive == PursuitDrive::in_any_direction) {
    return refusal(ArgumentError::out_of_range, in_pure_pursuit_follower, "reversed")
        .got("true for a robot that moves in any direction")
        .expected("false")
        .hint("give the path's poses the headings that the robot is to have");
  }
  return {};
}

}  // namespace

Expected<PurePursuitFollower> PurePursuitFollower::create(std::span<const PathPoint> path,
                                                          const PurePursuitSettings& settings) {
  FLYBALL_CHECK(check_settings(settings));
  if (path.size() < 2) {
    return refusal(ArgumentError::empty, in_pure_pursuit_follower, "path")
        .got(detail::format("{} points", path.size()))
        .expected("two points or more");
  }
  std::vector<double> stations{0.0};
  for (std::size_t i = 0; i < path.size(); ++i) {
    const std::string name = detail::format("point {}", i + 1);
    if (!detail::known(path[i].pose) || !is_signal(path[i].curvature)) {
      return refusal(ArgumentError::not_finite, in_pure_pursuit_follower, name)
          .got(detail::format("({:.6g}, {:.6g}), heading {:.6g}, curvature {:.6g}",
                              path[i].pose.x(), path[i].pose.y(), path[i].pose.angle(),
                              path[i].curvature))
          .expected("finite numbers");
    }
    if (i > 0) {
      const double length = (path[i].pose.translation() - path[i - 1].pose.translation()).norm();
      if (!(length > 0.0)) {
        return refusal(ArgumentError::out_of_range, in_pure_pursuit_follower, name)
            .got("where the one before it is")
            .expected("somewhere else");
      }
      stations.push_back(stations.back() + length);
    }
  }
  return PurePursuitFollower({path.begin(), path.end()}, std::move(stations), settings);
}

PurePursuitFollower::PurePursuitFollower(std::vector<PathPoint> path, std::vector<double> stations,
                                         const PurePursuitSettings& settings) noexcept
    : path_(std::move(path)), stations_(std::move(stations)), settings_(settings) {
  reset();
}

void PurePursuitFollower::reset() noexcept {
  segment_ = 0;
  progress_ = 0.0;
  distance_ = 0.0;
  cross_track_ = 0.0;
  speed_ = 0.0;
  curvature_ = 0.0;
  lookahead_ = settings_.least_lookahead;
  target_ = path_.front().pose.translation();
  arrived_ = false;
}

void PurePursuitFollower::advance(const Eigen::Vector2d& position) noexcept {
  const double window = 2.0 * settings_.largest_lookahead;
  // One that was carried away may come back to any part that is left.
  const double search_until = progress_ + (distance_ > window ? stations_.back() : window);
  double best = std::numeric_limits<double>::infinity();
  std::size_t segment = segment_;
  double station = progress_;
  for (std::size_t i = segment_; i + 1 < path_.size() && stations_[i] <= search_until; ++i) {
    const Eigen::Vector2d& from = path_[i].pose.translation();
    const Eigen::Vector2d along = path_[i + 1].pose.translation() - from;
    const double length = stations_[i + 1] - stations_[i];
    const double share = std::clamp((position - from).dot(along) / (length * length), 0.0, 1.0);
    const double at_station = std::max(progress_, stations_[i] + share * length);
    const Eigen::Vector2d nearest =
        from + std::min(1.0, (at_station - stations_[i]) / length) * along;
    const double distance = (position - nearest).norm();
    if (distance < best) {
      best = distance;
      segment = i;
      station = at_station;
      const Eigen::Vector2d off = position - nearest;
      cross_track_ = (along(0) * off(1) - along(1) * off(0)) / length;
    }
  }
  segment_ = segment;
  progress_ = std::min(station, stations_.back());
  distance_ = best;
}

PurePursuitFollower::Place PurePursuitFollower::at(double station) const noexcept {
  std::size_t i = segment_;
  while (i + 2 < path_.size() && stations_[i + 1] < station) {
    ++i;
  }
  const double fraction = (station - stations_[i]) / (stations_[i + 1] - stations_[i]);
  const Eigen::Vector2d& from = path_[i].pose.translation();
  const Eigen::Vector2d& to = path_[i + 1].pose.translation();
  if (station <= stations_.back()) {
    return {from + fraction * (to - from), i, std::min(1.0, fraction)};
  }
  // Past the end along the last heading, which is along the path where the robot goes on arcs.
  const double past = station - stations_.back();
  const Eigen::Vector2d ahead =
      settings_.drive == PursuitDrive::on_arcs
          ? Eigen::Vector2d(path_.back().pose.rotation() * Eigen::Vector2d(past, 0.0))
          : Eigen::Vector2d::Zero();
  return {to + ahead, i, 1.0};
}

double PurePursuitFollower::speed_for(double curvature, double remaining) const noexcept {
  double v = std::min(settings_.velocity, speed_ + settings_.acceleration * settings_.period.si());
  const double bend = std::abs(curvature);
  if (bend > 0.0) {
    v = std::min(v, std::sqrt(settings_.centripetal / bend));
  }
  // v² = 2 a s, less what the period that begins now covers.
  if (settings_.acceleration < std::numeric_limits<double>::infinity()) {
    const double lost = settings_.acceleration * settings_.period.si();
    v = std::min(
        v, std::sqrt(2.0 * settings_.acceleration * remaining + 0.25 * lost * lost) - 0.5 * lost);
  }
  return std::max(v, 0.0);
}

FollowerCommand PurePursuitFollower::calculate(const Pose2d& pose) noexcept {
  if (arrived_) {
    return {};
  }
  if (!detail::known(pose)) {
    // There is no motion that would be right without a pose.
    speed_ = 0.0;
    return {{}, FollowerStatus::no_pose};
  }
  const Eigen::Vector2d& position = pose.translation();
  advance(position);
  const Eigen::Vector2d& end = path_.back().pose.translation();
  const Eigen::Vector2d to_end = end - position;
  const std::size_t last = path_.size() - 1;
  const double end_is_ahead = to_end.dot(end - path_[last - 1].pose.translation()) /
                              (stations_[last] - stations_[last - 1]);
  const bool at_last = progress_ >= stations_.back() - settings_.tolerance;
  if (at_last &&
      (to_end.norm() <= settings_.tolerance ||
       (settings_.drive == PursuitDrive::on_arcs && end_is_ahead <= settings_.tolerance))) {
    arrived_ = true;
    speed_ = 0.0;
    curvature_ = 0.0;
    return {};
  }

  lookahead_ = std::clamp(settings_.lookahead_time * speed_, settings_.least_lookahead,
                          settings_.largest_lookahead);
  const Place place = at(progress_ + lookahead_);
  target_ = place.position;
  const Eigen::Vector2d in_robot = pose.rotation().inverse() * Eigen::Vector2d(target_ - position);
  const double distance = in_robot.norm();
  const double remaining = std::max(stations_.back() - progress_, to_end.norm());
  bool saturated = false;

  if (settings_.drive == PursuitDrive::in_any_direction) {
    curvature_ = 0.0;
    const double v = std::min(speed_for(path_[place.segment].curvature, remaining),
                              distance / settings_.period.si());
    const Rotation2d heading =
        path_[segment_].pose.rotation() *
        Rotation2d(
            ((progress_ - stations_[segment_]) / (stations_[segment_ + 1] - stations_[segment_])) *
            path_[segment_ + 1].pose.rotation().minus(path_[segment_].pose.rotation())(0));
    const double turn = heading.minus(pose.rotation())(0);
    const Eigen::Vector2d velocity =
        distance > 0.0 ? Eigen::Vector2d(in_robot * (v / distance)) : Eigen::Vector2d::Zero();
    const auto speeds = settings_.limits.in_any_direction(
        {velocity(0), velocity(1), settings_.heading_gain * turn}, saturated);
    speed_ = std::hypot(speeds.vx, speeds.vy);
    return {speeds, saturated ? FollowerStatus::saturated : FollowerStatus::tracking};
  }

  // The robot looks the way it drives.
  const double side = settings_.reversed ? -1.0 : 1.0;
  const double ahead = side * in_robot(0);
  const double left = side * in_robot(1);
  // κ = 2 sin α / d, and as tight as abeam for what is behind.
  curvature_ = !(distance > 0.0) ? 0.0
               : ahead >= 0.0    ? 2.0 * left / (distance * distance)
                                 : std::copysign(2.0 / distance, left);
  const double v = speed_for(curvature_, remaining);
  const auto speeds = settings_.limits.on_arc(side * v, v * curvature_, saturated);
  speed_ = std::abs(speeds.vx);
  // A slower curve is the plan, not a failure to keep it.
  return {speeds, saturated ? FollowerStatus::saturated : FollowerStatus::tracking};
}

}  // namespace flyball
