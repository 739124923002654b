#include <flyball/simulation/mechanism_plant.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball {

Expected<MechanismPlant> MechanismPlant::create(mechanisms::MechanismKind kind,
                                                const mechanisms::FeedforwardGains& gains,
                                                double breakaway) {
  constexpr std::string_view where = "MechanismPlant";
  FLYBALL_CHECK(Checks(where)
                    .positive(gains.kV, "kV")
                    .not_negative(gains.kA, "kA")
                    .not_negative(gains.kS, "kS", "V")
                    .finite(gains.kG, "kG")
                    .finite(gains.angle_offset, "angle_offset")
                    .finite(breakaway, "breakaway"));
  if (breakaway < 1.0) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(where))
                              .about("breakaway")
                              .got(format_number(breakaway))
                              .expected("at least 1: static over sliding friction"));
  }
  return MechanismPlant(kind, gains, breakaway);
}

int MechanismPlant::direction(double velocity, double drive) const noexcept {
  if (velocity != 0.0) {
    return velocity > 0.0 ? 1 : -1;
  }
  if (std::abs(drive) <= breakaway_ * gains_.kS) {
    return 0;
  }
  return drive > 0.0 ? 1 : -1;
}

double MechanismPlant::acceleration(const MechanismState& state, double voltage) const noexcept {
  const double drive = voltage - gains_.gravity_voltage(kind_, state.position);
  const int s = direction(state.velocity, drive);
  if (s == 0 || gains_.kA == 0.0) {
    return 0.0;
  }
  return (drive - s * gains_.kS - gains_.kV * state.velocity) / gains_.kA;
}

MechanismState MechanismPlant::step_constant(MechanismState state, double drive,
                                             double duration) const noexcept {
  // A motion ends at most once in a step: from rest it can only gain speed.
  double left = duration;
  for (int motions = 0; motions < 3 && left > 0.0; ++motions) {
    const int s = direction(state.velocity, drive);
    if (s == 0) {
      return state;
    }
    const double v_end = (drive - s * gains_.kS) / gains_.kV;
    if (gains_.kA == 0.0) {
      if (s * v_end <= 0.0) {
        state.velocity = 0.0;
        continue;
      }
      return {state.position + v_end * left, v_end};
    }
    // v(t) = v_end + (v - v_end) e^{-λt} is zero at e^{λt} = 1 - v/v_end.
    const double lambda = gains_.kV / gains_.kA;
    const bool stops = s * v_end < 0.0;
    const double t_zero = stops ? std::log1p(-state.velocity / v_end) / lambda : left;
    const double t = std::min(t_zero, left);
    const double lost = -std::expm1(-lambda * t);
    const double excess = state.velocity - v_end;
    state.position += v_end * t + excess * lost / lambda;
    state.velocity = stops && t_zero <= left ? 0.0 : state.velocity - excess * lost;
    left -= t;
  }
  return state;
}

MechanismState MechanismPlant::step(const MechanismState& state, double voltage,
                                    double duration) const noexcept {
  if (!(duration > 0.0)) {
    return state;
  }
  if (kind_ != mechanisms::MechanismKind::arm || gains_.kG == 0.0) {
    return step_constant(state, voltage - gains_.gravity_voltage(kind_, state.position), duration);
  }
  constexpr double most_steps = 1e7;
  const double steps = std::min(std::ceil(duration / arm_step), most_steps);
  const double h = duration / steps;
  MechanismState now = state;
  for (double i = 0.0; i < steps; ++i) {
    const double drive = voltage - gains_.gravity_voltage(kind_, now.position);
    if (direction(now.velocity, drive) == 0) {
      return now;
    }
    const MechanismState middle = step_constant(now, drive, 0.5 * h);
    now = step_constant(now, voltage - gains_.gravity_voltage(kind_, middle.position), h);
  }
  return now;
}

}  // namespace flyball
