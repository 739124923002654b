#include <flyball/recording/trajectory_file.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>
#include <flyball/io/json_text.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "recording/finish_trajectory.hpp"
#include "recording/json_objects.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;
using nlohmann::json;
using recording::number_of;
using recording::ObjectPlaces;

/// What a sample says, before it is known in which frame its velocity is.
struct Read {
  MotionSample sample{};
  double speed = 0.0;  ///< Along the path, of the older layouts.
  double curvature = 0.0;
  std::optional<double> holonomic{};       ///< rad, the way the robot looks.
  std::optional<double> holonomic_rate{};  ///< rad/s
  std::optional<Vector2d> velocity{};      ///< As written, of the newer layout.
  std::optional<Vector2d> acceleration{};  ///< The same, in the velocity's frame.
};

/// "trajectory.json:3:17".
std::string place_in(const std::string& source, const Place& place) {
  // Samples of waypoints stand in no line.
  return place.line == 0 ? source : fmt::format("{}:{}:{}", source, place.line, place.column);
}

Expected<Pose2d> pose_of(const json& sample, const std::string& where) {
  const auto pose = sample.find("pose");
  const auto missing = [&](std::string_view what) {
    return refusal(TrajectoryFileError::wrong_sample, where, std::string(what))
        .got("missing")
        .expected("a pose {\"translation\": {\"x\", \"y\"}, \"rotation\": {\"radians\"}}");
  };
  if (pose == sample.end() || !pose->is_object()) {
    return missing("the sample's pose");
  }
  const auto translation = pose->find("translation");
  const auto rotation = pose->find("rotation");
  if (translation == pose->end() || !translation->is_object()) {
    return missing("pose.translation");
  }
  if (rotation == pose->end() || !rotation->is_object()) {
    return missing("pose.rotation");
  }
  FLYBALL_TRY(const double x, number_of(*translation, "x", "pose.translation.x", where));
  FLYBALL_TRY(const double y, number_of(*translation, "y", "pose.translation.y", where));
  const char* const key = rotation->contains("radians") ? "radians" : "value";
  FLYBALL_TRY(const double angle, number_of(*rotation, key, "pose.rotation.radians", where));
  return Pose2d(x, y, angle);
}

Expected<Read> sample_of(const json& sample, const std::string& where) {
  if (!sample.is_object()) {
    return refusal(TrajectoryFileError::wrong_sample, where, "the sample")
        .got("no object")
        .expected("{\"time\": …, \"pose\": …, \"velocity\": …}");
  }
  constexpr double degree = std::numbers::pi / 180.0;
  Read read;
  FLYBALL_TRY(read.sample.time, number_of(sample, "time", "time", where));
  FLYBALL_TRY(read.sample.pose, pose_of(sample, where));
  const auto velocity = sample.find("velocity");
  if (velocity != sample.end() && velocity->is_object()) {
    FLYBALL_TRY(const double vx, number_of(*velocity, "vx", "velocity.vx", where));
    FLYBALL_TRY(const double vy, number_of(*velocity, "vy", "velocity.vy", where));
    FLYBALL_TRY(read.sample.omega, number_of(*velocity, "omega", "velocity.omega", where));
    read.velocity = Vector2d(vx, vy);
    const auto acceleration = sample.find("acceleration");
    if (acceleration != sample.end() && acceleration->is_object()) {
      FLYBALL_TRY(const double ax, number_of(*acceleration, "ax", "acceleration.ax", where));
      FLYBALL_TRY(const double ay, number_of(*acceleration, "ay", "acceleration.ay", where));
      read.acceleration = Vector2d(ax, ay);
    }
    return read;
  }
  FLYBALL_TRY(read.speed, number_of(sample, "velocity", "velocity", where));
  FLYBALL_TRY(read.curvature, number_of(sample, "curvature", "curvature", where, 0.0));
  FLYBALL_TRY(const double along, number_of(sample, "acceleration", "acceleration", where, 0.0));
  const Vector2d forward(read.sample.pose.rotation().cos(), read.sample.pose.rotation().sin());
  read.sample.velocity = read.speed * forward;
  const Vector2d left(-forward(1), forward(0));
  read.sample.acceleration = along * forward + read.speed * read.speed * read.curvature * left;
  read.sample.omega = read.speed * read.curvature;
  if (sample.contains("holonomicRotation")) {
    FLYBALL_TRY(const double looks,
                number_of(sample, "holonomicRotation", "holonomicRotation", where));
    FLYBALL_TRY(const double rate, number_of(sample, "holonomicAngularVelocity",
                                             "holonomicAngularVelocity", where, 0.0));
    read.holonomic = degree * looks;
    read.holonomic_rate = degree * rate;
  }
  return read;
}

/// Of velocities that do not say whose frame they are in: the one in which the poses move.
void take_frame(const std::vector<Read>& all, RobotTrajectory& result) {
  double robot = 0.0;
  double field = 0.0;
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    const MotionSample& a = all[i].sample;
    const MotionSample& b = all[i + 1].sample;
    const Vector2d moved = b.pose.translation() - a.pose.translation();
    const double half = 0.5 * (b.time - a.time);
    const Vector2d as_field = half * (*all[i].velocity + *all[i + 1].velocity);
    const Vector2d as_robot =
        half * (a.pose.rotation() * *all[i].velocity + b.pose.rotation() * *all[i + 1].velocity);
    field += (moved - as_field).squaredNorm();
    robot += (moved - as_robot).squaredNorm();
  }
  const bool is_robot = robot <= field;
  for (std::size_t i = 0; i < all.size(); ++i) {
    MotionSample& sample = result.samples[i];
    const auto in_field = [&](const Vector2d& v) {
      return is_robot ? Vector2d(sample.pose.rotation() * v) : v;
    };
    sample.velocity = in_field(*all[i].velocity);
    if (all[i].acceleration) {
      sample.acceleration = in_field(*all[i].acceleration);
    }
    result.holonomic =
        result.holonomic || std::abs(sample.velocity(1) * sample.pose.rotation().cos() -
                                     sample.velocity(0) * sample.pose.rotation().sin()) > 0.05;
  }
}

/// PathPlanner gives the robot's heading in degrees beside the path's in radians.
void take_headings(const std::vector<Read>& all, RobotTrajectory& result) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    MotionSample& sample = result.samples[i];
    sample.pose = Pose2d(sample.pose.x(), sample.pose.y(), *all[i].holonomic);
    sample.omega = *all[i].holonomic_rate;
    result.holonomic =
        result.holonomic || std::abs(std::remainder(*all[i].holonomic - all[i].sample.pose.angle(),
                                                    2.0 * std::numbers::pi)) > 0.05;
  }
  if (!result.holonomic) {  // it looks where it goes: the path's own turning
    for (std::size_t i = 0; i < all.size(); ++i) {
      result.samples[i].pose = all[i].sample.pose;
      result.samples[i].omega = all[i].sample.omega;
    }
  }
}

/// A sample again at its time, as tools write it where two pieces of a path meet; they have it a
/// point's spacing away.
bool is_same(const MotionSample& a, const MotionSample& b) {
  constexpr double near = 0.05;  // m
  return a.time == b.time && (a.pose.translation() - b.pose.translation()).norm() < near;
}

/// What the samples tell of the motion against where their poses are: a trajectory whose lengths,
/// times or signs contradict each other can be read, but not followed.
void compare_with_poses(RobotTrajectory& trajectory) {
  constexpr double share = 0.5;
  constexpr double least = 0.1;         // m
  constexpr double least_turned = 0.2;  // rad
  double moved = 0.0;
  double told = 0.0;
  double apart = 0.0;
  double turned = 0.0;
  double told_turned = 0.0;
  double turned_apart = 0.0;
  for (std::size_t i = 1; i < trajectory.samples.size(); ++i) {
    const MotionSample& a = trajectory.samples[i - 1];
    const MotionSample& b = trajectory.samples[i];
    const double half = 0.5 * (b.time - a.time);
    const Vector2d way = b.pose.translation() - a.pose.translation();
    const Vector2d by_velocity = half * (a.velocity + b.velocity);
    moved += way.norm();
    told += by_velocity.norm();
    apart += (way - by_velocity).norm();
    const double by_rate = half * (a.omega + b.omega);
    const double angle = std::remainder(b.pose.angle() - a.pose.angle(), 2.0 * std::numbers::pi);
    turned += std::abs(angle);
    told_turned += std::abs(by_rate);
    turned_apart += std::abs(std::remainder(angle - by_rate, 2.0 * std::numbers::pi));
  }
  if (!(apart <= least + share * std::max(moved, told))) {
    warn(trajectory.diagnostics, "poses_disagree",
         "the poses move {:.3g} m and the velocities tell of {:.3g} m, {:.3g} m apart from sample "
         "to sample: a length's unit, a sign, the times or one pose is wrong; generate the "
         "trajectory again",
         moved, told, apart);
  } else if (!(turned_apart <= least_turned + share * std::max(turned, told_turned))) {
    warn(trajectory.diagnostics, "headings_disagree",
         "the poses turn by {:.3g} rad and the curvature or the turning rate tells of {:.3g} rad, "
         "{:.3g} rad apart from sample to sample: an angle's unit or a sign is wrong; generate the "
         "trajectory again",
         turned, told_turned, turned_apart);
  }
}

Expected<void> check_times(const RobotTrajectory& trajectory) {
  const auto& samples = trajectory.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (!(samples[i].time > samples[i - 1].time)) {
      return refusal(TrajectoryFileError::time_order, place_in(trajectory.source, samples[i].place),
                     fmt::format("the time of sample {}", i + 1))
          .got(fmt::format("{} s after {} s", format_number(samples[i].time, 9),
                           format_number(samples[i - 1].time, 9)))
          .expected("later than the one before")
          .hint("take the sample out, or generate the trajectory again")
          .with("sample", static_cast<double>(i + 1));
    }
  }
  return {};
}

}  // namespace

ErrorInfo error_info(TrajectoryFileError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"not_json", "the file is not JSON", ErrorKind::misuse},
      {"not_a_trajectory", "the file is of something else", ErrorKind::misuse},
      {"wrong_sample", "a part of the file is missing, or cannot be", ErrorKind::misuse},
      {"time_order", "times repeat or go back", ErrorKind::misuse},
      {"too_few", "there are too few samples", ErrorKind::misuse},
      {"too_tight", "the drivetrain cannot follow it", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "trajectory_file", rows);
}

Expected<void> recording::check_samples(const RobotTrajectory& trajectory) {
  if (trajectory.samples.size() < 2) {
    return refusal(TrajectoryFileError::too_few, trajectory.source, "the trajectory")
        .got(fmt::format("of {} samples", trajectory.samples.size()))
        .expected("two samples or more");
  }
  constexpr double most = 1e6;  // in SI: far beyond any robot, and its squares are numbers
  for (std::size_t i = 0; i < trajectory.samples.size(); ++i) {
    const MotionSample& sample = trajectory.samples[i];
    for (const auto& [value, name, unit] :
         {std::tuple(sample.pose.translation().cwiseAbs().maxCoeff(), "place", "m"),
          {sample.velocity.cwiseAbs().maxCoeff(), "velocity", "m/s"},
          {std::abs(sample.omega), "turning rate", "rad/s"},
          {std::abs(sample.time), "time", "s"}}) {
      if (!(value <= most)) {
        return refusal(TrajectoryFileError::wrong_sample, place_in(trajectory.source, sample.place),
                       fmt::format("the {} of sample {}", name, i + 1))
            .got(fmt::format("{} {}", format_number(value), unit))
            .expected(fmt::format("at most 1e6 {}", unit))
            .with("sample", static_cast<double>(i + 1));
      }
    }
  }
  return check_times(trajectory);
}

void recording::settle(RobotTrajectory& trajectory) {
  if (const double first = trajectory.samples.front().time; first != 0.0) {
    for (MotionSample& sample : trajectory.samples) {
      sample.time -= first;
    }
    note(trajectory.diagnostics, "time_offset",
         "the trajectory begins at {:.6g} s, which counts as zero", first);
  }
  compare_with_poses(trajectory);
}

MotionSample RobotTrajectory::at(double t) const noexcept {
  if (!(t > samples.front().time)) {
    return samples.front();
  }
  if (t >= samples.back().time) {
    MotionSample last = samples.back();
    if (t > last.time) {
      last.velocity.setZero();
      last.acceleration.setZero();
      last.omega = 0.0;
    }
    return last;
  }
  const auto next =
      std::upper_bound(samples.begin(), samples.end(), t,
                       [](double time, const MotionSample& sample) { return time < sample.time; });
  const MotionSample& b = *next;
  const MotionSample& a = *std::prev(next);
  const double s = (t - a.time) / (b.time - a.time);
  MotionSample between = a;
  between.time = t;
  between.pose = a.pose.interpolate(b.pose, s);
  between.velocity = (1.0 - s) * a.velocity + s * b.velocity;
  between.omega = (1.0 - s) * a.omega + s * b.omega;
  between.acceleration = (1.0 - s) * a.acceleration + s * b.acceleration;
  return between;
}

Expected<RobotTrajectory> parse_trajectory(std::string_view text, const std::string& source) {
  FLYBALL_TRY(const json file, recording::json_of(text, source));
  const bool is_list = file.is_array();
  const auto listed = is_list ? file.end() : file.find("samples");
  if (!is_list && (listed == file.end() || !listed->is_array())) {
    const bool choreo = file.is_object() && file.contains("trajectory");
    return refusal(TrajectoryFileError::not_a_trajectory, source, "the JSON")
        .got(choreo ? "a Choreo trajectory" : "without a list of samples")
        .expected("a WPILib trajectory: a list of {time, velocity, acceleration, curvature, pose}")
        .hint(choreo ? "give its points as waypoints" : "");
  }
  const json& list = is_list ? file : *listed;
  const ObjectPlaces places(text, is_list ? 1 : 2, is_list ? "" : "samples");
  RobotTrajectory result{.source = source};
  std::vector<Read> all;
  std::size_t index = 0;
  std::size_t repeated = 0;
  for (const json& element : list) {
    const Place place = places.of(index);
    FLYBALL_TRY(Read read, sample_of(element, place_in(source, place)));
    read.sample.place = place;
    if (!all.empty() && read.velocity.has_value() != all.front().velocity.has_value()) {
      return refusal(TrajectoryFileError::wrong_sample, place_in(source, place), "velocity")
          .got("of another layout than in the first sample")
          .expected("a number in all samples, or an object in all");
    }
    ++index;
    if (!all.empty() && is_same(all.back().sample, read.sample)) {
      ++repeated;
      continue;
    }
    result.samples.push_back(read.sample);
    all.push_back(std::move(read));
  }
  if (repeated > 0) {
    note(result.diagnostics, "repeated_samples",
         "{} of the trajectory's {} samples {} the time of the one before, within 5 cm of it, and "
         "{} left "
         "out",
         repeated, index, repeated == 1 ? "repeats" : "repeat", repeated == 1 ? "is" : "are");
  }
  FLYBALL_CHECK(recording::check_samples(result));
  if (all.front().velocity) {
    take_frame(all, result);
    if (!std::all_of(all.begin(), all.end(), [](const Read& read) { return read.acceleration; })) {
      recording::differentiate_velocities(result);
    }
  } else if (std::all_of(all.begin(), all.end(), [](const Read& read) { return read.holonomic; })) {
    take_headings(all, result);
  }
  recording::settle(result);
  return result;
}

Expected<RobotTrajectory> read_trajectory(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path));
  return parse_trajectory(text, path);
}

Expected<void> check_reach(const RobotTrajectory& trajectory, const DrivetrainReach& reach) {
  constexpr double sideways_share = 0.0872;  // sin 5°
  constexpr double sideways_least = 0.05;    // m/s
  const double half = 0.5 * reach.trackwidth;
  for (std::size_t i = 0; i < trajectory.samples.size(); ++i) {
    const MotionSample& sample = trajectory.samples[i];
    const double v = sample.velocity.norm();
    const double fastest = v + half * std::abs(sample.omega);
    const std::string where = place_in(trajectory.source, sample.place);
    const std::string which =
        fmt::format("sample {} (t = {} s)", i + 1, format_number(sample.time, 5));
    const double across = std::abs(sample.velocity(1) * sample.pose.rotation().cos() -
                                   sample.velocity(0) * sample.pose.rotation().sin());
    if (!reach.sideways && across > std::max(sideways_least, sideways_share * v)) {
      return refusal(TrajectoryFileError::too_tight, where, which)
          .got(fmt::format("moving sideways at {} m/s", format_number(across, 3)))
          .expected("along the robot's heading: this drivetrain does not move sideways")
          .hint(
              "follow it with type = \"swerve\" or \"mecanum\", or plan it for a differential "
              "drive")
          .with("sample", static_cast<double>(i + 1));
    }
    constexpr double rounding = 1e-3;  // of what planned it, and of modules that turn
    if (fastest > (1.0 + rounding) * reach.wheel_speed) {
      const double curvature = v > 1e-9 ? std::abs(sample.omega) / v : 0.0;
      const double possible = reach.wheel_speed / (1.0 + half * curvature);
      return refusal(TrajectoryFileError::too_tight, where, which)
          .got(curvature > 0.0
                   ? fmt::format("at {} m/s with a curvature of {} 1/m, which takes a wheel to {} "
                                 "m/s",
                                 format_number(v, 4), format_number(curvature, 4),
                                 format_number(fastest, 4))
                   : fmt::format("at {} m/s", format_number(fastest, 4)))
          .expected(fmt::format("within the {} m/s of this drivetrain's wheels",
                                format_number(reach.wheel_speed, 4)))
          .hint(fmt::format("lower the velocity there to {} m/s, or make the path wider",
                            format_number(std::floor(1000.0 * possible) / 1000.0, 4)))
          .with("sample", static_cast<double>(i + 1))
          .with("wheel_speed", fastest);
    }
    if (i > 0) {
      // Half as much again as the wheels can, and more than two pieces of a path may be apart.
      constexpr double margin = 1.5;
      constexpr double least_jump = 0.1;  // m
      const MotionSample& before = trajectory.samples[i - 1];
      const double jump = (sample.pose.translation() - before.pose.translation()).norm();
      const double possible = reach.wheel_speed * (sample.time - before.time);
      if (!(jump <= std::max(least_jump, margin * possible))) {
        return refusal(TrajectoryFileError::too_tight, where, which)
            .got(fmt::format("{} m from the sample before it, {} s earlier", format_number(jump, 4),
                             format_number(sample.time - before.time, 4)))
            .expected(fmt::format("within the {} m that this drivetrain's wheels go meanwhile",
                                  format_number(possible, 4)))
            .hint("mend its pose or its time, or generate the trajectory again")
            .with("sample", static_cast<double>(i + 1));
      }
    }
  }
  return {};
}

}  // namespace flyball
