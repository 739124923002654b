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
    return refusal(ArgumentError::out_of_range, where, "breakaway")
        .got(format_number(breakaway))
        .expected("at least 1: static over sliding friction");
  }
  return MechanismPlant(kind, gains, breakaway);
}

double MechanismPlant::acceleration(const MechanismState& state, double voltage) const noexcept {
  const double drive = voltage - gains_.gravity_voltage(kind_, state.position);
  const int s = friction_.direction(state.velocity, drive);
  if (s == 0 || gains_.kA == 0.0) {
    return 0.0;
  }
  return (drive - s * gains_.kS - gains_.kV * state.velocity) / gains_.kA;
}

MechanismState MechanismPlant::step(const MechanismState& state, double voltage,
                                    double duration) const noexcept {
  if (!(duration > 0.0)) {
    return state;
  }
  if (kind_ != mechanisms::MechanismKind::arm || gains_.kG == 0.0) {
    return motion_.step(state, voltage - gains_.gravity_voltage(kind_, state.position), duration);
  }
  constexpr double most_steps = 1e7;
  const double steps = std::min(std::ceil(duration / arm_step), most_steps);
  const double h = duration / steps;
  MechanismState now = state;
  for (double i = 0.0; i < steps; ++i) {
    const double drive = voltage - gains_.gravity_voltage(kind_, now.position);
    if (friction_.direction(now.velocity, drive) == 0) {
      return now;
    }
    const MechanismState middle = motion_.step(now, drive, 0.5 * h);
    now = motion_.step(now, voltage - gains_.gravity_voltage(kind_, middle.position), h);
  }
  return now;
}

}  // namespace flyball
