#pragma once

#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// What a motor on a limited voltage can do: V = kS sgn(v) + kG + kV v + kA a, |V| <= voltage. The
/// units of position are those of kV and kA.
struct MotorMotionLimits {
  double kV = 0.0;       ///< V per velocity, > 0.
  double kA = 0.0;       ///< V per acceleration, > 0.
  double voltage = 0.0;  ///< V, > 0.
  double kS = 0.0;       ///< V, friction, >= 0.
  /// V that gravity takes, up positive; of an arm the worst, cos(angle) = ±1 being the user's sign.
  double kG = 0.0;
  /// V that drive the largest current through a motor that stands, I R; the limit of its torque.
  /// Infinite: none but the voltage.
  double current_voltage = std::numeric_limits<double>::infinity();
  /// Of both directions; infinite: the speed at which the voltage is used up.
  double velocity = std::numeric_limits<double>::infinity();

  /// The largest acceleration at a velocity; in the direction of the velocity it falls to zero at
  /// the top speed. At rest friction is against the motion that is asked for.
  [[nodiscard]] double most(double v) const noexcept;
  /// The smallest, < 0.
  [[nodiscard]] double least(double v) const noexcept;
};

/// The fastest motion between two states that a motor's torque-speed curve, its current limit,
/// friction and gravity allow: full voltage (or current), cruise at the velocity limit, full
/// voltage backwards. The velocity approaches the top speed exponentially.
///
/// Other than a trapezoid it accelerates hard where the motor can, so that it arrives earlier with
/// the same motor, and never asks for a voltage that is not there. Without a velocity limit it
/// cruises a billionth below the top speed. Run-time object: noexcept, allocation-free, bounded (at
/// most 100 iterations, about a microsecond), finite: a motor that gravity and friction hold (or to
/// which they leave less than 1e-30 V), or numbers that are not finite or beyond 1e30, give a
/// profile that is at the goal from the start.
/// Source: book, sections 6.10 (kV, kA) and 15.1.4; the maximum principle for x'' = a(v, ±V).
class ExponentialProfile {
 public:
  /// A motion from one state to another.
  ExponentialProfile(const MotorMotionLimits& motor, const MotionState& start,
                     const MotionState& goal) noexcept;

  /// The fastest change to a velocity, wherever it ends (`goal`): at full effort. A velocity beyond
  /// the limits is cut to them.
  [[nodiscard]] static ExponentialProfile to_velocity(const MotorMotionLimits& motor,
                                                      const MotionState& start,
                                                      double velocity) noexcept;
  /// Where it ends, and how fast.
  [[nodiscard]] const MotionState& goal() const noexcept { return goal_; }

  [[nodiscard]] double total_time() const noexcept { return end_; }
  /// s, from t to the end.
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return t > 0.0 ? (t < end_ ? end_ - t : 0.0) : end_;
  }
  /// @param t  s; before the start the start, after the end the goal, moving on with its velocity.
  [[nodiscard]] MotionState sample(double t) const noexcept;
  /// Velocity and the accelerations at rest; the motor's own limits are `motor()`.
  [[nodiscard]] MotionLimits limits() const noexcept;
  [[nodiscard]] const MotorMotionLimits& motor() const noexcept { return motor_; }
  /// Its parts, each of one law of the acceleration.
  [[nodiscard]] int pieces() const noexcept { return count_; }
  /// When a part begins, s. @param i  0..pieces()-1.
  [[nodiscard]] double piece_begin(int i) const noexcept { return pieces_[i].begin; }
  /// Never: braking is easier than accelerating.
  [[nodiscard]] bool reversible() const noexcept { return false; }
  /// The motion from another state on, within the same limits.
  [[nodiscard]] ExponentialProfile replanned(const MotionState& state,
                                             const MotionState& goal) const noexcept {
    return {motor_, state, goal};
  }

 private:
  /// x'' = rate (end - v), or a constant acceleration if the rate is zero.
  struct Piece {
    double begin = 0.0;
    double position = 0.0;
    double velocity = 0.0;
    double rate = 0.0;
    double target = 0.0;  ///< The velocity that it goes to, or the acceleration.
  };

  void add_change(double from, double to) noexcept;
  void add(double duration, double rate, double target) noexcept;

  MotorMotionLimits motor_;
  MotionState goal_{};
  double end_ = 0.0;
  double position_ = 0.0;  ///< While it is built.
  double velocity_ = 0.0;
  int count_ = 0;
  Piece pieces_[8];
};

static_assert(MotionProfile<ExponentialProfile>);

}  // namespace flyball
