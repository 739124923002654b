#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/drive_pursuit.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;
using mechanisms::ChassisSpeeds;

constexpr double moving = 0.02;  // m/s

Error wrong(const DriveJob& job, std::string got) {
  return Error(ProjectError::wrong_value).in(job.path).about("drive.follower").got(std::move(got));
}

}  // namespace

double PursuedPath::time_at(double station) const noexcept {
  const auto after = std::upper_bound(stations.begin(), stations.end(), station);
  if (after == stations.begin()) {
    return times.front();
  }
  if (after == stations.end()) {
    return times.back();
  }
  const auto i = static_cast<std::size_t>(after - stations.begin());
  const double share = (station - stations[i - 1]) / (stations[i] - stations[i - 1]);
  return times[i - 1] + share * (times[i] - times[i - 1]);
}

Expected<PursuedPath> pursued_path(const DriveJob& job) {
  const bool on_arcs = job.robot.kind == DriveKind::differential;
  PursuedPath path;
  constexpr double apart = 1e-3;  // m, of neighbours that are two points
  bool forward = false;
  Vector2d way = Vector2d::Zero();
  for (const MotionSample& sample : job.trajectory.samples) {
    const double v = sample.velocity.norm();
    const double gone =
        path.points.empty()
            ? apart
            : (sample.pose.translation() - path.points.back().pose.translation()).norm();
    if (on_arcs && v > moving) {
      (sample.forward() > 0.0 ? forward : path.backs) = true;
    }
    if (gone < apart) {
      continue;
    }
    const Vector2d now = v > moving ? Vector2d(sample.velocity / v) : way;
    // Of the way, whatever the robot looks at.
    const double bend = path.points.empty() || way.isZero() || now.isZero()
                            ? 0.0
                            : std::atan2(way(0) * now(1) - way(1) * now(0), way.dot(now)) / gone;
    path.points.push_back({sample.pose, bend});
    path.stations.push_back(path.stations.empty() ? 0.0 : path.stations.back() + gone);
    path.times.push_back(sample.time);
    way = now;
  }
  if (forward && path.backs) {
    return tl::unexpected(
        wrong(job, "\"pure pursuit\", of a trajectory that goes both forward and back")
            .expected("one that goes one way: it knows a path, not where to turn")
            .hint("ramsete, ltv unicycle and ltv drive follow the trajectory's times"));
  }
  if (path.points.size() < 2) {
    return tl::unexpected(wrong(job, "\"pure pursuit\", of a trajectory that goes nowhere")
                              .expected("a way of a millimetre or more"));
  }
  if (path.backs) {
    for (PathPoint& point : path.points) {
      point.pose = point.pose * Pose2d(0.0, 0.0, std::numbers::pi);
    }
  }
  return path;
}

PurePursuitSettings pure_pursuit_settings(const DriveJob& job, const PursuedPath& path) {
  constexpr double least_acceleration = 0.5;  // m/s²
  constexpr double least_bend = 1.0;          // m/s²
  PurePursuitSettings settings{.period = Time(job.period)};
  settings.acceleration = least_acceleration;
  settings.centripetal = least_bend;
  const auto& samples = job.trajectory.samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double v = samples[i].velocity.norm();
    settings.velocity = std::max(settings.velocity, v);
    if (i > 0) {
      const double dt = samples[i].time - samples[i - 1].time;
      settings.acceleration =
          std::max(settings.acceleration, std::abs(v - samples[i - 1].velocity.norm()) / dt);
    }
  }
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    const double v = job.trajectory.at(path.times[i]).velocity.norm();
    settings.centripetal =
        std::max(settings.centripetal, v * v * std::abs(path.points[i].curvature));
  }
  settings.least_lookahead = job.least_lookahead;
  settings.largest_lookahead = std::max(settings.largest_lookahead, job.least_lookahead);
  settings.lookahead_time = job.lookahead_time;
  if (job.robot.kind == DriveKind::differential) {
    settings.reversed = path.backs;
    settings.limits.wheel_velocity = job.robot.free_speed(job.max_voltage);
    settings.limits.trackwidth = job.robot.trackwidth;
  } else {
    settings.drive = PursuitDrive::in_any_direction;
    settings.limits.velocity = job.robot.free_speed(job.max_voltage);
  }
  return settings;
}

Expected<Pursuit> Pursuit::create(const DriveJob& job) {
  FLYBALL_TRY(auto path, pursued_path(job));
  const PurePursuitSettings settings = pure_pursuit_settings(job, path);
  FLYBALL_TRY(auto follower, PurePursuitFollower::create(path.points, settings));
  return Pursuit(std::move(follower), std::move(path), settings.acceleration * job.period);
}

Pursuit::Asked Pursuit::step(const Pose2d& pose) noexcept {
  const FollowerCommand command = follower_.calculate(pose);
  const ChassisSpeeds& now = command.speeds;
  const double v = std::hypot(now.vx, now.vy);
  // It knows no times: the speed is taken to go on changing as it did.
  const double gain = std::clamp(v - before_, -most_gain_, most_gain_);
  before_ = v;
  const double factor = v > moving ? std::max(0.0, v + gain) / v : 1.0;
  return {.now = now,
          .next = {factor * now.vx, factor * now.vy, factor * now.omega},
          .saturated = command.status == FollowerStatus::saturated,
          .arrived = follower_.arrived(),
          .clock = follower_.arrived() ? path_.times.back() : path_.time_at(follower_.progress())};
}

}  // namespace flyball::study
