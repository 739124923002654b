#include <flyball/study/drive.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/progress.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/gravity.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/drive_law.hpp"
#include "study/drive_plant.hpp"
#include "study/drive_wheel.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using mechanisms::ChassisSpeeds;

constexpr std::string_view in_drive = "drive";
constexpr double gone = 1.0;  ///< m, from the reference: lost.

/// Poses over time, for who gets them late.
class PoseHistory {
 public:
  explicit PoseHistory(double latency) : latency_(latency) {}

  void add(double t, const Pose2d& pose) {
    poses_.push_back({t, pose});
    while (poses_.size() > 2 && poses_[1].first <= t - latency_) {
      poses_.pop_front();
    }
  }
  /// The pose of a latency ago; before the start that of the start.
  [[nodiscard]] Pose2d late(double t) const {
    const double wanted = t - latency_;
    for (std::size_t i = 1; i < poses_.size(); ++i) {
      const auto& [t_a, a] = poses_[i - 1];
      const auto& [t_b, b] = poses_[i];
      if (wanted <= t_b) {
        return a.interpolate(b, std::clamp((wanted - t_a) / (t_b - t_a), 0.0, 1.0));
      }
    }
    return poses_.back().second;
  }

 private:
  double latency_;
  std::deque<std::pair<double, Pose2d>> poses_;
};

/// The directions in which swerve modules set off.
std::array<double, 4> first_directions(const DriveJob& job) {
  std::array<double, 4> angles{};
  constexpr double moving = 0.05;  // m/s
  for (const MotionSample& sample : job.trajectory.samples) {
    const ChassisSpeeds speeds = tracking_point(sample).speeds;
    if (std::hypot(speeds.vx, speeds.vy) + 0.5 * std::abs(speeds.omega) < moving) {
      continue;
    }
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const ChassisSpeeds there = speeds.at(job.robot.modules[i]);
      angles[i] = std::atan2(there.vy, there.vx);
    }
    break;
  }
  return angles;
}

/// Where it starts: beside its reference, moving as that does.
VectorXd first_state(const DriveJob& job, const DrivePlant& plant) {
  const MotionSample& first = job.trajectory.samples.front();
  const DisturbanceSection& off = job.disturbance;
  const Pose2d pose = first.pose * Pose2d(off.ahead.si(), off.left.si(), off.turned.si());
  return plant.state_of(pose, tracking_point(first).speeds, first_directions(job));
}

DriveInfluence influence_at(const DisturbanceSection& off, double t) {
  DriveInfluence influence;
  const auto during = [&](Time from, Time length) {
    return t >= from.si() && t < from.si() + length.si();
  };
  if (during(off.push_from, off.push_for)) {
    influence.force = off.push.si() * Vector2d(std::cos(off.push_direction.si()),
                                               std::sin(off.push_direction.si()));
  }
  if (during(off.slip_from, off.slip_for)) {
    influence.grip = off.slip_grip;
  }
  return influence;
}

/// The robot as it is, where the job's is what its follower knows.
DriveRobot true_robot(const DriveJob& job) {
  DriveRobot robot = job.robot;
  robot.mass *= job.disturbance.mass_factor;
  robot.moment_of_inertia *= job.disturbance.mass_factor;
  return robot;
}

/// What the motors are asked for in truth, of the voltages that the law gives.
VectorXd disturbed(const DriveJob& job, const VectorXd& volts) {
  const DisturbanceSection& off = job.disturbance;
  VectorXd given = off.strength_factor * volts;
  const bool sides = job.robot.kind == DriveKind::differential;
  for (Index k = 0; k < (sides ? 2 : 4); ++k) {
    given(k) *= k % 2 == 0 ? off.left_factor : 1.0;
  }
  if (job.robot.kind == DriveKind::swerve) {
    given.tail<4>() = volts.tail<4>();  // what steers is not weaker
  }
  return given;
}

/// Integrates over a period, across the instants at which an influence begins or ends.
/// @param x  The state, and behind it the energy from the battery, J.
Expected<VectorXd> advance(const DriveJob& job, const DrivePlant& plant, VectorXd x,
                           const VectorXd& volts, double from, double to) {
  std::vector<double> instants{from, to};
  const DisturbanceSection& off = job.disturbance;
  for (const double t : {off.push_from.si(), off.push_from.si() + off.push_for.si(),
                         off.slip_from.si(), off.slip_from.si() + off.slip_for.si()}) {
    if (t > from + 1e-9 && t < to - 1e-9) {
      instants.push_back(t);
    }
  }
  std::sort(instants.begin(), instants.end());
  const Index n = plant.states();
  const IntegrationOptions options{
      .relative_tolerance = job.accuracy, .absolute_tolerance = job.accuracy, .max_steps = 200'000};
  for (std::size_t i = 0; i + 1 < instants.size(); ++i) {
    const DriveInfluence influence = influence_at(off, 0.5 * (instants[i] + instants[i + 1]));
    const auto rate = [&](double, const VectorXd& at) {
      VectorXd dx(n + 1);
      plant.derivative(at.head(n), volts, influence, dx.head(n));
      const DriveFlow flow = plant.flow(at.head(n), volts);
      dx(n) = flow.rail * flow.battery_current;
      return dx;
    };
    FLYBALL_TRY(const auto solution, integrate(rate, instants[i], x, instants[i + 1], options));
    x = VectorXd(solution.final_state());
  }
  return x;
}

/// Rows of the record, column by column.
class Record {
 public:
  void begin(double t) {
    time_.push_back(t);
    column_ = 0;
  }
  void add(const std::string& name, const std::string& unit, double value) {
    if (time_.size() == 1) {
      columns_.push_back({name, unit, {}});
    }
    columns_[column_++].values.push_back(value);
  }
  [[nodiscard]] Expected<TimeSeries> series() && {
    TimeSeries series(std::move(time_));
    for (auto& column : columns_) {
      FLYBALL_CHECK(series.add(column.name, column.unit, std::move(column.values)));
    }
    return series;
  }

 private:
  std::vector<double> time_;
  std::vector<TimeSeries::Column> columns_;
  std::size_t column_ = 0;
};

std::vector<std::string> motor_names(DriveKind kind) {
  if (kind == DriveKind::differential) {
    return {"left", "right"};
  }
  std::vector<std::string> names{"front_left", "front_right", "back_left", "back_right"};
  if (kind == DriveKind::swerve) {
    for (int i = 0; i < 4; ++i) {
      names.push_back(names[static_cast<std::size_t>(i)] + "_steer");
    }
  }
  return names;
}

/// (along, across, heading) of the way that the reference goes.
Eigen::Vector3d error_of(const Pose2d& pose, const MotionSample& r) {
  const double speed = r.velocity.norm();
  constexpr double moving = 0.02;  // m/s
  const Vector2d way = speed > moving ? Vector2d(r.velocity / speed)
                                      : Vector2d(r.pose.rotation().cos(), r.pose.rotation().sin());
  const Vector2d off = pose.translation() - r.pose.translation();
  return {off.dot(way), way(0) * off(1) - way(1) * off(0),
          (r.pose.rotation().inverse() * pose.rotation()).angle()};
}

void take_errors(TrackingErrors& errors, const Eigen::Vector3d& e) {
  errors.largest_along = std::max(errors.largest_along, std::abs(e(0)));
  errors.largest_across = std::max(errors.largest_across, std::abs(e(1)));
  errors.largest_heading = std::max(errors.largest_heading, std::abs(e(2)));
  errors.final_along = e(0);
  errors.final_across = e(1);
  errors.final_heading = e(2);
}

/// m, the trackwidth, or twice the farthest module's distance from the middle.
double reach_of(const DriveRobot& robot) {
  if (robot.kind == DriveKind::differential) {
    return robot.trackwidth;
  }
  double reach = 0.0;
  for (const Vector2d& module : robot.modules) {
    reach = std::max(reach, 2.0 * module.norm());
  }
  return reach;
}

/// m/s², that the motors give a robot at a speed, straight on.
double motor_acceleration(const DriveJob& job, double v) {
  const DriveRobot& robot = job.robot;
  const mechanisms::DcMotor& motor = robot.motor;
  const int shafts = robot.kind == DriveKind::differential ? 2 : 4;
  const double back_emf = robot.gearing * v / (motor.Kv * robot.wheel_radius);
  const double current =
      std::min({robot.stator_limit, (job.max_voltage - back_emf) / motor.R,
                robot.supply_limit * job.max_voltage / std::max(back_emf, 1e-3 * job.max_voltage)});
  return shafts * robot.gearing * motor.Kt * (current - motor.free_current) /
         (robot.wheel_radius * rolling_mass(robot, shafts));
}

/// What the trajectory leaves of the drivetrain, where that is little.
void tell_reserve(const DriveJob& job, std::vector<Diagnostic>& diagnostics) {
  const auto& samples = job.trajectory.samples;
  const double top = job.robot.free_speed(job.max_voltage);
  const double reach = reach_of(job.robot);
  double share = 0.0;
  double share_at = 0.0;
  double asked = 0.0;
  double given = 0.0;
  double asked_at = 0.0;
  double sideways = 0.0;
  double sideways_at = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double v = samples[i].velocity.norm();
    const double fastest = (v + 0.5 * reach * std::abs(samples[i].omega)) / top;
    if (fastest > share) {
      share = fastest;
      share_at = samples[i].time;
    }
    if (i == 0) {
      continue;
    }
    const double dt = samples[i].time - samples[i - 1].time;
    const double before = samples[i - 1].velocity.norm();
    const double gain = (v - before) / dt;
    const double most = motor_acceleration(job, 0.5 * (v + before));
    if (gain > 0.0 && gain * std::max(given, 0.0) >= asked * std::max(most, 0.0)) {
      asked = gain;
      given = most;
      asked_at = samples[i].time;
    }
    const double all = (samples[i].velocity - samples[i - 1].velocity).norm() / dt;
    if (all > sideways) {
      sideways = all;
      sideways_at = samples[i].time;
    }
  }
  constexpr double hardly = 0.9;
  if (share > hardly) {
    warn(
        diagnostics, "no_reserve",
        "at {} s the trajectory takes a wheel to {} of the {} m/s that it turns without load: "
        "hardly a volt is left to accelerate and to correct; a velocity of {} there leaves a fifth",
        format_number(share_at, 4), text::percent(share, 3), format_number(top, 3),
        text::percent(0.8 / share, 2));
  }
  constexpr double more = 1.02;
  if (asked > more * given) {
    warn(diagnostics, "weak_motors",
         "at {} s the trajectory gains {} m/s², and the motors within their limits give {} m/s² at "
         "that speed: the robot falls behind; drive.max_acceleration makes it gain less",
         format_number(asked_at, 4), format_number(asked, 3),
         format_number(std::max(given, 0.0), 3));
  }
  const double held = job.robot.grip * mechanisms::standard_gravity;
  if (sideways > more * held) {
    warn(diagnostics, "little_grip",
         "at {} s the trajectory asks for {} m/s², and wheels of a grip of {} hold {} m/s²: they "
         "slip; lower drive.max_acceleration and drive.max_centripetal",
         format_number(sideways_at, 4), format_number(sideways, 3),
         format_number(job.robot.grip, 3), format_number(held, 3));
  }
}

Expected<void> check_job(const DriveJob& job) {
  const DisturbanceSection& off = job.disturbance;
  FLYBALL_CHECK(Checks(in_drive)
                    .positive(job.period, "controller.period", "s")
                    .positive(job.max_voltage, "controller.max_voltage", "V")
                    .positive(job.battery.open_circuit_voltage, "open_circuit_voltage", "V")
                    .not_negative(job.battery.resistance, "the battery's resistance", "Ω")
                    .not_negative(off.latency.si(), "latency", "s")
                    .positive(off.mass_factor, "mass_factor")
                    .positive(off.strength_factor, "strength_factor")
                    .positive(off.left_factor, "left_factor")
                    .positive(off.slip_grip, "slip_grip")
                    .not_negative(job.settle, "the time after the end", "s")
                    .within(job.accuracy, 1e-13, 1e-3, "accuracy"));
  if (job.trajectory.samples.size() < 2) {
    return refusal(ArgumentError::empty, in_drive, "the trajectory")
        .got(fmt::format("of {} samples", job.trajectory.samples.size()))
        .expected("two samples or more");
  }
  constexpr double longest = 600.0;
  const double duration = job.trajectory.duration();
  if (!(duration > 0.0 && duration <= longest) || (duration + job.settle) / job.period > 1e6) {
    return refusal(ArgumentError::out_of_range, in_drive, "the trajectory")
        .got(fmt::format("{} s long", format_number(duration)))
        .expected("at most 600 s, and a million periods");
  }
  return check_reach(job.trajectory, {.wheel_speed = job.robot.free_speed(job.max_voltage),
                                      .trackwidth = reach_of(job.robot),
                                      .sideways = job.robot.kind != DriveKind::differential});
}

}  // namespace

std::string_view to_string(DriveKind kind) {
  switch (kind) {
    case DriveKind::differential:
      return "differential";
    case DriveKind::swerve:
      return "swerve";
    case DriveKind::mecanum:
      return "mecanum";
  }
  return "";
}

std::string_view to_string(DriveFollower follower) {
  switch (follower) {
    case DriveFollower::ramsete:
      return "ramsete";
    case DriveFollower::ltv_unicycle:
      return "ltv unicycle";
    case DriveFollower::ltv_drive:
      return "ltv drive";
    case DriveFollower::holonomic:
      return "holonomic";
    case DriveFollower::pure_pursuit:
      return "pure pursuit";
  }
  return "";
}

ErrorInfo error_info(DriveError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"lost", "the robot lost its trajectory", ErrorKind::no_answer},
      {"not_arrived", "the robot did not arrive", ErrorKind::no_answer},
  };
  return detail::info_of(code, "drive", rows);
}

double DriveRobot::free_speed(double voltage) const noexcept {
  return motor.Kv * std::max(0.0, voltage - motor.free_current * motor.R) * wheel_radius / gearing;
}

int DriveRobot::motors() const noexcept {
  return kind == DriveKind::differential ? 2 : kind == DriveKind::swerve ? 8 : 4;
}

Expected<DriveResult> drive(const DriveJob& job) {
  FLYBALL_CHECK(check_job(job));
  FLYBALL_TRY(const auto plant, make_drive_plant(true_robot(job), job.battery));
  FLYBALL_TRY(const auto law, make_drive_law(job));
  DriveResult result{.job = job, .diagnostics = job.diagnostics};
  tell_reserve(job, result.diagnostics);
  result.duration = job.trajectory.duration();
  result.least_rail = std::numeric_limits<double>::infinity();
  const double T = job.period;
  const bool keeps_time = job.follower != DriveFollower::pure_pursuit;
  const double longest = (keeps_time ? 1.0 : 2.0) * result.duration + job.settle;
  const auto planned = static_cast<int>(std::ceil(longest / T - 1e-9));
  int periods = planned;
  const Index n = plant->states();
  VectorXd x(n + 1);
  x << first_state(job, *plant), 0.0;
  Random random(job.seed);
  PoseHistory history(job.disturbance.latency.si());
  const std::vector<std::string> motors = motor_names(job.robot.kind);
  const auto wheels = static_cast<std::size_t>(plant->wheel_speeds(x.head(n)).size());
  Record record;
  double square = 0.0;
  int saturated = 0;
  for (int k = 0; k <= periods; ++k) {
    const double t = k * T;
    if (k % 64 == 0) {
      tell_progress("drives the trajectory", static_cast<std::size_t>(k),
                    static_cast<std::size_t>(periods));
    }
    const VectorXd state = x.head(n);
    const Pose2d pose(state(0), state(1), state(2));
    history.add(t, pose);
    const Pose2d late = history.late(t);
    const double sigma = job.disturbance.position_noise.si();
    const DriveReading reading{
        .pose = sigma > 0.0 || job.disturbance.heading_noise.si() > 0.0
                    ? Pose2d(late.x() + sigma * random.normal(), late.y() + sigma * random.normal(),
                             late.angle() + job.disturbance.heading_noise.si() * random.normal())
                    : late,
        .wheels = plant->wheel_speeds(state),
        .module_angles = plant->module_angles(state),
        .module_rates = plant->module_rates(state)};
    MotionSample now = job.trajectory.at(t);
    const DriveOrder order = law->step(reading, now, job.trajectory.at(t + T));
    if (order.arrived && !result.arrival) {
      result.arrival = t;
      periods = std::min(planned, static_cast<int>(std::ceil((t + job.settle) / T - 1e-9)));
    }
    const VectorXd asked = disturbed(job, order.volts);
    const DriveFlow flow = plant->flow(state, asked);
    now = order.clock ? job.trajectory.at(*order.clock) : now;
    const Eigen::Vector3d e = error_of(pose, now);
    const double slip = plant->slip(state);
    take_errors(result.errors, e);
    square += e.head<2>().squaredNorm();
    saturated += order.saturated ? 1 : 0;
    result.least_rail = std::min(result.least_rail, flow.rail);
    result.peak_current = std::max(result.peak_current, flow.battery_current);
    result.largest_slip = std::max(result.largest_slip, slip);
    result.lost = result.lost || !(e.head<2>().norm() <= gone);

    record.begin(t);
    record.add("x", "m", pose.x());
    record.add("y", "m", pose.y());
    record.add("heading", "rad", state(2));
    record.add("reference_x", "m", now.pose.x());
    record.add("reference_y", "m", now.pose.y());
    record.add("reference_heading", "rad", now.pose.angle());
    record.add("error_along", "m", e(0));
    record.add("error_across", "m", e(1));
    record.add("error_heading", "rad", e(2));
    record.add("vx", "m/s", state(3));
    record.add("vy", "m/s", state(4));
    record.add("omega", "rad/s", state(5));
    record.add("wanted_vx", "m/s", order.speeds.vx);
    record.add("wanted_vy", "m/s", order.speeds.vy);
    record.add("wanted_omega", "rad/s", order.speeds.omega);
    for (std::size_t i = 0; i < wheels; ++i) {
      record.add(motors[i] + "_speed", "m/s", reading.wheels(static_cast<Index>(i)));
    }
    for (Index i = 0; i < reading.module_angles.size(); ++i) {
      record.add(motors[static_cast<std::size_t>(i)] + "_angle", "rad", reading.module_angles(i));
    }
    for (std::size_t i = 0; i < motors.size(); ++i) {
      record.add(motors[i] + "_voltage", "V", order.volts(static_cast<Index>(i)));
    }
    for (std::size_t i = 0; i < motors.size(); ++i) {
      record.add(motors[i] + "_current", "A", flow.current(static_cast<Index>(i)));
    }
    record.add("rail", "V", flow.rail);
    record.add("battery_current", "A", flow.battery_current);
    record.add("slip", "m/s", slip);
    record.add("saturated", "", order.saturated ? 1.0 : 0.0);
    record.add("energy", "J", x(n));
    if (k < periods) {
      FLYBALL_TRY(x, advance(job, *plant, std::move(x), asked, t, t + T));
    }
  }
  result.energy = x(n);
  result.saturated_share = static_cast<double>(saturated) / (periods + 1);
  result.errors.rms = std::sqrt(square / (periods + 1));
  FLYBALL_TRY(result.series, std::move(record).series());
  if (!keeps_time && !result.arrival) {
    warn(result.diagnostics, "not_arrived",
         "pure pursuit is not at the path's end after {} s, twice the trajectory's time and a "
         "second",
         format_number(longest, 4));
  }
  if (result.lost) {
    warn(result.diagnostics, "lost",
         "the robot was more than a metre from its reference; followers come back from errors of "
         "that size only by luck");
  }
  return result;
}

}  // namespace flyball::study
