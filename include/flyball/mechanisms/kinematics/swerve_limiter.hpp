#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/drivetrain/robot_body.hpp>
#include <flyball/mechanisms/kinematics/chassis_accelerations.hpp>
#include <flyball/mechanisms/kinematics/saturation.hpp>
#include <flyball/mechanisms/power/motor_supply.hpp>

namespace flyball::mechanisms {

/// What a swerve drive's modules can do in a period.
struct SwerveLimits {
  Velocity max_speed{};          ///< Of a module, along the ground.
  AngularVelocity steer_rate{};  ///< Of a module.
  /// Of the robot over the field, its turn on an arc included; left out, only forces limit it.
  Acceleration acceleration{std::numeric_limits<double>::infinity()};
  AngularAcceleration angular_acceleration{std::numeric_limits<double>::infinity()};
};

/// The forces behind a swerve drive: its inertia, its grip and what its drive motors can push.
struct SwerveForces {
  RobotBody body{};
  DcMotor motor{};  ///< Of one module's wheel.
  double gearing = 1.0;
  Length wheel_radius{};
  double stator_limit = std::numeric_limits<double>::infinity();  ///< A, a module.
  double supply_limit = std::numeric_limits<double>::infinity();  ///< A, a module.
  Voltage rail{12.0};     ///< What the controllers have at least.
  double friction = 1.1;  ///< μ of the tires.
};

namespace detail {

/// A module's drive in plain numbers: the largest force along its wheel at a speed.
class WheelForce {
 public:
  WheelForce() = default;
  /// @param gearing_over_radius  G/r, 1/m. @param Kt  N m/A. @param rail  V.
  WheelForce(const MotorTerminal& motor, double gearing_over_radius, double Kt,
             double rail) noexcept
      : motor_(motor), gearing_over_radius_(gearing_over_radius), Kt_(Kt), rail_(rail) {}

  /// N, towards `direction` (±1) at a speed along the ground (m/s). Of a wheel at its motor's free
  /// speed and beyond it, which others drag along, a twentieth of that at rest: what stands in for
  /// nothing, so that a robot which was pushed there does not stay there.
  [[nodiscard]] double most(double speed, double direction) const noexcept {
    const double force = at(speed, direction);
    const double least = 0.05 * at(0.0, 1.0);
    return force > least ? force : least;
  }

 private:
  [[nodiscard]] double at(double speed, double direction) const noexcept {
    const double emf = direction * gearing_over_radius_ * speed / motor_.Kv;
    const double volts = allowed_voltage(motor_, emf, rail_, rail_);
    return gearing_over_radius_ * Kt_ * (volts - emf) / motor_.R;
  }

  MotorTerminal motor_{};
  double gearing_over_radius_ = 1.0;
  double Kt_ = 0.0;
  double rail_ = 12.0;
};

/// The limits in plain numbers, checked.
struct LimiterNumbers {
  double max_speed = 0.0;
  double steer_rate = 0.0;
  double acceleration = 0.0;
  double angular_acceleration = 0.0;
  double dt = 0.0;
  bool has_forces = false;
  double mass = 0.0;
  double inertia = 0.0;
  double grip = std::numeric_limits<double>::infinity();  ///< μ g, m/s²
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  WheelForce wheel{};
};
/// @errors As `swerve_limiter`.
[[nodiscard]] Expected<LimiterNumbers> check_limiter(const SwerveLimits& limits,
                                                     const SwerveForces* forces, Time period);

}  // namespace detail

/// What a swerve drive is told for one period.
template <std::size_t N>
struct SwerveSetpoint {
  ChassisSpeeds speeds{};                    ///< To hold over the period; the modules agree to it.
  std::array<SwerveModule, N> modules{};     ///< m/s, forward or backward, and directions.
  std::array<SwerveModuleRates, N> rates{};  ///< On the way there: for feedforwards.
  double scale = 1.0;     ///< Of the wanted motion, at which no module is too fast (`saturated`).
  double progress = 1.0;  ///< s: of the way from the last speeds to those; 1: reached.
};

/// Goes from the modules' last states to a wanted motion as fast as they can follow, and never asks
/// for what they cannot: each period
///
///  1. slows the wanted motion down until no module is faster than it can be (`saturated`), and an
///     arc until its centripetal acceleration |ω| |v| is allowed,
///  2. goes the largest part s of the way from the last twist to that, ξ = ξ_0 + s (ξ_1 - ξ_0), for
///     which every module turns no more than steer_rate · dt (forward or backward), and the
///     acceleration over the field, a = dv/dt + ω × v, with what it needs of each module, the
///     forces of least squares with m a = Σ f_i and J α = Σ r_i × f_i, is within the limits: along
///     its wheel what its motor's currents and voltage give, in all what its tire holds,
///  3. lets modules that stand turn to where they are needed; a robot at rest waits for them.
///
/// All modules always agree to one motion of the robot, which goes straight from the last to the
/// wanted one: a motion whose size alone changes keeps its direction. Steering comes first: modules
/// that cannot turn fast enough keep the robot on its arc, whatever that accelerates. Six tenths of
/// each limit are always the change's: on the way from one tight arc to another they come on top of
/// what the arc between takes.
/// Run-time object: noexcept, allocation-free, bounded (4N + 1 candidates of N modules).
/// Made by `swerve_limiter`.
template <std::size_t N>
class SwerveLimiter {
 public:
  using Modules = std::array<SwerveModule, N>;

  /// Of numbers that are known to be good; `swerve_limiter` checks them.
  SwerveLimiter(const SwerveKinematics<N>& kinematics, const detail::LimiterNumbers& numbers,
                const Eigen::Matrix<double, 2 * static_cast<int>(N), 3>& forces) noexcept
      : kinematics_(kinematics), numbers_(numbers), forces_(forces) {}

  /// Starts from modules as they are, at rest or moving.
  void reset(const Modules& modules) noexcept {
    last_.modules = signals(modules);
    last_.speeds = kinematics_.chassis(last_.modules);
    last_.rates = {};
    last_.scale = last_.progress = 1.0;
  }
  /// What was told last.
  [[nodiscard]] const SwerveSetpoint<N>& last() const noexcept { return last_; }

  /// The next period's, from the last one's: of modules that reach what they are told.
  /// @param wanted  In the robot's frame at the period's beginning. @param frame  What it keeps.
  const SwerveSetpoint<N>& update(const ChassisSpeeds& wanted,
                                  HeldFrame frame = HeldFrame::robot) noexcept {
    const SaturatedMotion motion =
        saturated(kinematics_, wanted, frame, numbers_.dt, numbers_.max_speed);
    const ChassisSpeeds goal = frame == HeldFrame::robot ? cornered(motion.twist) : motion.twist;
    const double most_turn = numbers_.steer_rate * numbers_.dt;
    std::array<Way, N> ways;
    bool waits = false;
    const bool rests = at_rest();
    for (std::size_t i = 0; i < N; ++i) {
      const Eigen::Vector2d& r = kinematics_.positions()[i];
      const ChassisSpeeds from = last_.speeds.at(r);
      const ChassisSpeeds to = goal.at(r);
      ways[i] = {{from.vx, from.vy}, {to.vx - from.vx, to.vy - from.vy}};
      if (rests && std::hypot(to.vx, to.vy) > slow) {
        const SwerveModule there =
            shortest_turn({1.0, Rotation2d::from_direction(to.vx, to.vy)}, last_.modules[i].angle);
        waits = waits || std::abs(turn(last_.modules[i].angle, there.angle)) > most_turn;
      }
    }
    if (waits) {
      last_.speeds = {};  // of what was slow
    }
    const double progress = waits ? 0.0 : largest(ways, most_turn, pushed(goal));
    take(goal, progress, most_turn);
    last_.scale = motion.scale;
    last_.progress = progress;
    return last_;
  }
  /// The same from where the modules were measured to be.
  const SwerveSetpoint<N>& update(const ChassisSpeeds& wanted, HeldFrame frame,
                                  const Modules& reached) noexcept {
    reset(reached);
    return update(wanted, frame);
  }

 private:
  /// m/s, below which a module stands and may point anywhere.
  static constexpr double slow = 1e-3;

  /// A module's velocity on the way: from + s change, m/s.
  struct Way {
    Eigen::Vector2d from = Eigen::Vector2d::Zero();
    Eigen::Vector2d change = Eigen::Vector2d::Zero();
    [[nodiscard]] Eigen::Vector2d at(double s) const noexcept { return from + s * change; }
  };

  [[nodiscard]] static double turn(const Rotation2d& from, const Rotation2d& to) noexcept {
    return std::atan2(from.cos() * to.sin() - from.sin() * to.cos(),
                      from.cos() * to.cos() + from.sin() * to.sin());
  }
  [[nodiscard]] static Modules signals(Modules modules) noexcept {
    for (SwerveModule& module : modules) {
      module.speed = flyball::detail::signal_or_zero(module.speed);
      if (!(std::abs(module.angle.cos()) <= 1.5 && std::abs(module.angle.sin()) <= 1.5)) {
        module.angle = Rotation2d();
      }
    }
    return modules;
  }
  [[nodiscard]] bool at_rest() const noexcept {
    for (const Eigen::Vector2d& r : kinematics_.positions()) {
      const ChassisSpeeds there = last_.speeds.at(r);
      if (std::hypot(there.vx, there.vy) > slow) {
        return false;
      }
    }
    return true;
  }
  /// The same arc, no faster than its centripetal acceleration |ω| |v| allows.
  [[nodiscard]] ChassisSpeeds cornered(const ChassisSpeeds& twist) const noexcept {
    // The rest of the grip is for getting on to it: 0.8² + 0.6² = 1.
    const double most = std::min(numbers_.acceleration, 0.8 * numbers_.grip);
    const double needed = std::abs(twist.omega) * std::hypot(twist.vx, twist.vy);
    if (!(needed > most)) {
      return twist;
    }
    const double by = std::sqrt(most / needed);
    return {by * twist.vx, by * twist.vy, by * twist.omega};
  }
  /// The largest s in [0, most] with |a + s b| <= limit; where there is none, the s that is nearest
  /// to it.
  template <int Size>
  [[nodiscard]] static double within(const Eigen::Vector<double, Size>& a,
                                     const Eigen::Vector<double, Size>& b, double limit,
                                     double most) noexcept {
    if (!(limit < largest_signal) || (a + most * b).squaredNorm() <= limit * limit) {
      return most;
    }
    const double square = b.squaredNorm();
    if (!(square > 0.0)) {
      return most;  // s changes nothing
    }
    const double middle = -a.dot(b) / square;
    const double root = middle * middle - (a.squaredNorm() - limit * limit) / square;
    return std::clamp(root > 0.0 ? middle + std::sqrt(root) : middle, 0.0, most);
  }
  /// The s at which |s b| is six tenths of the limit, at most `least`.
  template <int Size>
  [[nodiscard]] static double change_alone(const Eigen::Vector<double, Size>& b, double limit,
                                           double least) noexcept {
    const double size = b.norm();
    return size * least > 0.6 * limit ? 0.6 * limit / size : least;
  }
  /// The largest s that accelerations, motors and grip allow. Six tenths of each are for the change
  /// alone: an arc that takes all there is would be held for ever otherwise.
  [[nodiscard]] double pushed(const ChassisSpeeds& goal) const noexcept {
    const double dt = numbers_.dt;
    // a(s) = a_0 + s a_1 of the centre of mass: the arc's at s = 0; at s = 1 the goal's and the
    // change to it.
    const ChassisSpeeds from = last_.speeds.at(numbers_.center);
    const ChassisSpeeds to = goal.at(numbers_.center);
    const Eigen::Vector2d a_0(-from.omega * from.vy, from.omega * from.vx);
    const Eigen::Vector2d change((to.vx - from.vx) / dt, (to.vy - from.vy) / dt);
    const Eigen::Vector2d a_1 = change + Eigen::Vector2d(-to.omega * to.vy, to.omega * to.vx) - a_0;
    const double alpha = (to.omega - from.omega) / dt;
    double s = within<2>(a_0, a_1, numbers_.acceleration, 1.0);
    double least = change_alone<2>(change, numbers_.acceleration, 1.0);
    if (numbers_.has_forces) {
      using Forces = Eigen::Vector<double, 2 * static_cast<int>(N)>;
      const double m = numbers_.mass;
      const double J = numbers_.inertia;
      const Forces f_0 = forces_ * Eigen::Vector3d(m * a_0(0), m * a_0(1), 0.0);
      const Forces f_1 = forces_ * Eigen::Vector3d(m * a_1(0), m * a_1(1), J * alpha);
      const Forces f_change = forces_ * Eigen::Vector3d(m * change(0), m * change(1), J * alpha);
      const double hold = numbers_.grip * m / static_cast<double>(N);
      for (std::size_t i = 0; i < N; ++i) {
        const SwerveModule& module = last_.modules[i];
        const Eigen::Vector2d direction(module.angle.cos(), module.angle.sin());
        const auto at = 2 * static_cast<Eigen::Index>(i);
        const Eigen::Vector2d g_0 = f_0.template segment<2>(at);
        const Eigen::Vector2d g_1 = f_1.template segment<2>(at);
        const Eigen::Vector2d g_change = f_change.template segment<2>(at);
        s = within<2>(g_0, g_1, hold, s);
        least = change_alone<2>(g_change, hold, least);
        using Along = Eigen::Vector<double, 1>;
        const Along along_0(g_0.dot(direction));
        const Along along_1(g_1.dot(direction));
        const double along = along_0(0) + s * along_1(0);
        const double most = numbers_.wheel.most(module.speed, along < 0.0 ? -1.0 : 1.0);
        s = within<1>(along_0, along_1, most, s);
        least = change_alone<1>(Along(g_change.dot(direction)), most, least);
      }
    }
    s = std::max(s, least);
    if (std::abs(alpha) * s > numbers_.angular_acceleration) {
      s = numbers_.angular_acceleration / std::abs(alpha);
    }
    return s;
  }
  /// Whether every module can turn to its direction at s.
  [[nodiscard]] bool steerable(const std::array<Way, N>& ways, double s,
                               double tangent) const noexcept {
    for (std::size_t i = 0; i < N; ++i) {
      const Eigen::Vector2d v = ways[i].at(s);
      const Rotation2d& angle = last_.modules[i].angle;
      const double along = std::abs(v(0) * angle.cos() + v(1) * angle.sin());
      const double across = std::abs(v(1) * angle.cos() - v(0) * angle.sin());
      // A hair of tolerance: the candidates lie on the borders.
      if (across > tangent * along * (1.0 + 1e-12) + 1e-12 && v.squaredNorm() > slow * slow) {
        return false;
      }
    }
    return true;
  }
  /// The largest s in [0, most] to which the modules can steer. Candidates are `most` and where a
  /// module's velocity crosses the border of what it can turn to: v × d(φ ± turn) = 0.
  [[nodiscard]] double largest(const std::array<Way, N>& ways, double most_turn,
                               double most) const noexcept {
    if (most_turn >= 1.57079632679489661923) {
      return most;
    }
    const double tangent = std::tan(most_turn);
    if (steerable(ways, most, tangent)) {
      return most;
    }
    double best = 0.0;
    const auto consider = [&](double s) {
      if (s > best && s < most && steerable(ways, s, tangent)) {
        best = s;
      }
    };
    for (std::size_t i = 0; i < N; ++i) {
      const Way& way = ways[i];
      const Rotation2d& angle = last_.modules[i].angle;
      for (const double side : {-tangent, tangent}) {
        const Eigen::Vector2d border(angle.cos() - side * angle.sin(),
                                     angle.sin() + side * angle.cos());
        const double slope = way.change(1) * border(0) - way.change(0) * border(1);
        if (slope != 0.0) {
          consider((way.from(0) * border(1) - way.from(1) * border(0)) / slope);
        }
      }
      // Where it gets slow, it may turn: |from + s change|² = (0.9 slow)², clear of the border.
      const double a = way.change.squaredNorm();
      const double b = way.from.dot(way.change);
      const double root = b * b - a * (way.from.squaredNorm() - 0.81 * slow * slow);
      if (a > 0.0 && root > 0.0) {
        consider((-b + std::sqrt(root)) / a);
        consider((-b - std::sqrt(root)) / a);
      }
    }
    return best;
  }
  /// The setpoint at s, its modules turned the shorter way; those that stand turn on towards where
  /// they will be needed.
  void take(const ChassisSpeeds& goal, double s, double most_turn) noexcept {
    const ChassisSpeeds from = last_.speeds;
    const Eigen::Vector3d speeds = from.vector() + s * (goal.vector() - from.vector());
    const double dt = numbers_.dt;
    last_.speeds = s >= 1.0 ? goal : ChassisSpeeds::from(speeds);
    for (std::size_t i = 0; i < N; ++i) {
      const Eigen::Vector2d& r = kinematics_.positions()[i];
      const ChassisSpeeds there = last_.speeds.at(r);
      const SwerveModule before = last_.modules[i];
      SwerveModule& module = last_.modules[i];
      const double speed = std::hypot(there.vx, there.vy);
      if (speed > slow) {
        module = shortest_turn({speed, Rotation2d::from_unit(there.vx / speed, there.vy / speed)},
                               before.angle);
        double turned = turn(before.angle, module.angle);
        if (std::abs(turned) > most_turn * (1.0 + 1e-9)) {
          // Modules that were measured to contradict each other come together first.
          turned = std::clamp(turned, -most_turn, most_turn);
          module.angle = before.angle * Rotation2d(turned);
          module.speed = there.vx * module.angle.cos() + there.vy * module.angle.sin();
        }
        last_.rates[i].steer_rate = turned / dt;
      } else {
        // It stands, and turns to where its velocity will leave the slow ones on the way to the
        // goal; what is left of its speed goes along the direction it has.
        const ChassisSpeeds later = goal.at(r);
        double turned = 0.0;
        if (std::hypot(later.vx, later.vy) > slow) {
          const Eigen::Vector2d v(there.vx, there.vy);
          const Eigen::Vector2d change(later.vx - there.vx, later.vy - there.vy);
          const double a = change.squaredNorm();
          const double b = v.dot(change);
          const double on = (std::sqrt(b * b + a * (slow * slow - v.squaredNorm())) - b) / a;
          const Eigen::Vector2d leaving = v + on * change;
          const SwerveModule needed = shortest_turn(
              {1.0, Rotation2d::from_direction(leaving(0), leaving(1))}, before.angle);
          turned = std::clamp(turn(before.angle, needed.angle), -most_turn, most_turn);
          module.angle = before.angle * Rotation2d(turned);
        }
        module.speed = there.vx * module.angle.cos() + there.vy * module.angle.sin();
        last_.rates[i].steer_rate = turned / dt;
      }
      last_.rates[i].acceleration = (module.speed - before.speed) / dt;
    }
  }

  SwerveKinematics<N> kinematics_;
  detail::LimiterNumbers numbers_;
  Eigen::Matrix<double, 2 * static_cast<int>(N), 3> forces_;  ///< Of the wheels, of (F, M).
  SwerveSetpoint<N> last_{};
};

namespace detail {

/// The forces of least squares with Σ f_i = F and Σ (r_i - c) × f_i = M, as a 2N x 3 map of (F, M).
[[nodiscard]] Eigen::MatrixXd wheel_forces(std::span<const Eigen::Vector2d> positions,
                                           const Eigen::Vector2d& center);

template <std::size_t N>
[[nodiscard]] Expected<SwerveLimiter<N>> make_limiter(const SwerveKinematics<N>& kinematics,
                                                      const SwerveLimits& limits,
                                                      const SwerveForces* forces, Time period) {
  return check_limiter(limits, forces, period).map([&](const LimiterNumbers& numbers) {
    return SwerveLimiter<N>(kinematics, numbers,
                            wheel_forces(kinematics.positions(), numbers.center));
  });
}

}  // namespace detail

/// Limits by rates alone. @param period  Of the loop.
/// @errors ArgumentError::not_positive, not_finite for max_speed, steer_rate and the period, NaN or
///         not positive for the accelerations.
template <std::size_t N>
[[nodiscard]] Expected<SwerveLimiter<N>> swerve_limiter(const SwerveKinematics<N>& kinematics,
                                                        const SwerveLimits& limits, Time period) {
  return detail::make_limiter(kinematics, limits, nullptr, period);
}
/// Limits by rates, and by what motors, currents and tires can do. @errors As above, and as
/// `check_drive`; ArgumentError for the body, the friction and the current limits;
/// out_of_range for a max_speed above 0.98 of what the motors reach without load on the rail.
template <std::size_t N>
[[nodiscard]] Expected<SwerveLimiter<N>> swerve_limiter(const SwerveKinematics<N>& kinematics,
                                                        const SwerveLimits& limits,
                                                        const SwerveForces& forces, Time period) {
  return detail::make_limiter(kinematics, limits, &forces, period);
}

}  // namespace flyball::mechanisms
