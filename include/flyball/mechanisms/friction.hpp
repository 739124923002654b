#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace flyball::mechanisms {

/// Coulomb friction against a velocity: level · sgn(velocity), zero at rest, over generic scalars.
/// @param level  V (or N, N m), not negative: kS. @param velocity  Its sign is what counts.
template <class Level, class Velocity>
[[nodiscard]] std::common_type_t<Level, Velocity> friction_voltage(const Level& level,
                                                                   const Velocity& velocity) {
  using Scalar = std::common_type_t<Level, Velocity>;
  return velocity > 0.0 ? Scalar(level) : velocity < 0.0 ? Scalar(-level) : Scalar(0.0);
}

/// Coulomb friction that sticks: at rest it holds whatever does not exceed breakaway · sliding.
struct Friction {
  double sliding = 0.0;    ///< V: kS.
  double breakaway = 1.0;  ///< Static over sliding friction, >= 1.

  /// The way a mechanism moves or sets off: -1, 0 (it sticks) or 1.
  /// @param drive  V, what pushes it besides friction and damping.
  [[nodiscard]] int direction(double velocity, double drive) const noexcept {
    if (velocity != 0.0) {
      return velocity > 0.0 ? 1 : -1;
    }
    if (std::abs(drive) <= breakaway * sliding) {
      return 0;
    }
    return drive > 0.0 ? 1 : -1;
  }
};

/// Where a mechanism of one degree of freedom is.
struct MechanismState {
  double position = 0.0;  ///< m or rad
  double velocity = 0.0;  ///< m/s or rad/s
};

/// kA dv/dt = drive - kV v - friction under a constant drive, solved exactly, with the instants at
/// which it stops, sticks and turns: exponential pieces of one direction each.
class FrictionMotion {
 public:
  /// @param kV  V·s/unit, > 0. @param kA  V·s²/unit; 0 follows the drive at once.
  FrictionMotion(double kV, double kA, const Friction& friction) noexcept
      : kV_(kV), kA_(kA), lambda_(kV / kA), friction_(friction) {}

  /// A motion in one direction: v(t) = v_end + (v - v_end) e^{-λt} for `duration` seconds.
  struct Piece {
    int direction = 0;      ///< -1, 0 (sticks: the velocity stays zero) or 1.
    double v_end = 0.0;     ///< (drive - direction kS)/kV
    double duration = 0.0;  ///< s
    bool stops = false;     ///< Whether the velocity is zero at its end.
  };
  /// What comes next, for at most `left` seconds.
  [[nodiscard]] Piece piece(double velocity, double drive, double left) const noexcept {
    const int s = friction_.direction(velocity, drive);
    if (s == 0) {
      return {0, 0.0, left, false};
    }
    const double v_end = (drive - s * friction_.sliding) / kV_;
    if (!(s * v_end < 0.0)) {
      return {s, v_end, left, false};
    }
    // v(t) = v_end + (v - v_end) e^{-λt} is zero at e^{λt} = 1 - v/v_end.
    const double t_zero = std::log1p(-velocity / v_end) / lambda_;
    return {s, v_end, std::min(t_zero, left), t_zero <= left};
  }

  /// The state after `duration` seconds.
  [[nodiscard]] MechanismState step(MechanismState state, double drive,
                                    double duration) const noexcept {
    // A motion ends at most once in a step: from rest it can only gain speed.
    double left = duration;
    for (int motions = 0; motions < 3 && left > 0.0; ++motions) {
      const Piece next = piece(state.velocity, drive, left);
      if (next.direction == 0) {
        return state;
      }
      if (kA_ == 0.0) {
        if (next.direction * next.v_end <= 0.0) {
          state.velocity = 0.0;
          continue;
        }
        return {state.position + next.v_end * left, next.v_end};
      }
      const double lost = -std::expm1(-lambda_ * next.duration);
      const double excess = state.velocity - next.v_end;
      state.position += next.v_end * next.duration + excess * lost / lambda_;
      state.velocity = next.stops ? 0.0 : state.velocity - excess * lost;
      left -= next.duration;
    }
    return state;
  }

 private:
  double kV_;
  double kA_;
  double lambda_;  ///< 1/s
  Friction friction_;
};

}  // namespace flyball::mechanisms
