#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"
#include "study/design_steps.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

// Volts left for kV v + kA a, and what the battery's sag does to them.
struct VoltageBudget {
  double limit = 0.0;    // V, of the motor
  double holding = 0.0;  // V, friction and gravity at their worst
  double open = 0.0;     // V, of the battery, less the reserve
  double sag = 0.0;      // battery over motor resistance

  // The largest kA a at a velocity voltage kV v. The motor's current is (V - kV v)/R, so with the
  // full duty cycle that accelerates hardest the rail is V_open - R_battery (holding + kA a)/R.
  [[nodiscard]] double acceleration_volts(double velocity_volts) const {
    const double by_limit = limit - holding - velocity_volts;
    const double by_battery = (open - velocity_volts) / (1.0 + sag) - holding;
    return std::min(by_limit, by_battery);
  }
  // What a motor that stands still can be given under the sag of its own current.
  [[nodiscard]] double under_sag() const { return open / (1.0 + sag); }
  // The largest kV v at which anything is left.
  [[nodiscard]] double top_velocity_volts() const {
    return std::min(limit - holding, open - holding * (1.0 + sag));
  }
};

double travel_time(double distance, double v, double a) {
  return distance >= v * v / a ? distance / v + v / a : 2.0 * std::sqrt(distance / a);
}

}  // namespace

Expected<FastestMotion> fastest_motion(const DesignJob& job) {
  const PlantDescription& plant = job.plant;
  const mechanisms::FeedforwardGains& gains = plant.gains;
  const double maximum = job.controller.max_voltage;

  VoltageBudget budget;
  FastestMotion motion;
  motion.voltage_reserve = 0.1 * maximum;
  budget.limit = maximum - motion.voltage_reserve;
  budget.holding = gains.kS + std::abs(gains.kG);
  budget.open = job.battery.open_circuit_voltage - motion.voltage_reserve;
  budget.sag = plant.motor ? job.battery.resistance / plant.motor->R : 0.0;

  if (std::abs(gains.kG) >= maximum) {
    return refusal(DesignError::gravity_too_strong, "design", "kG")
        .got(fmt::format("{} V", format_number(gains.kG)))
        .expected(fmt::format("below the {} V that may be applied", format_number(maximum)))
        .hint("add motors, gear lower or counterbalance");
  }
  const double top = budget.top_velocity_volts();
  if (!(top > 0.0)) {
    if (budget.holding < budget.limit) {
      return refusal(DesignError::no_motion_possible, "design", "the battery")
          .got(fmt::format("left with {} V under its sag, less a tenth for feedback",
                           format_number(budget.under_sag())))
          .expected(
              fmt::format("above the {} V of friction and gravity", format_number(budget.holding)))
          .hint("lower battery.resistance or raise battery.open_circuit_voltage");
    }
    return refusal(DesignError::no_motion_possible, "design", "friction and gravity")
        .got(fmt::format("{} V together", format_number(budget.holding)))
        .expected(fmt::format("below {} V, so that a tenth is left for feedback",
                              format_number(budget.limit)))
        .hint("add motors, gear lower or counterbalance");
  }

  // Without a kA nothing tells the fastest acceleration. Its upper bound is safe; without that
  // either, a quarter of a second to top speed.
  const double kA = plant.kA_determined          ? gains.kA
                    : plant.kA_upper_bound > 0.0 ? plant.kA_upper_bound
                                                 : 0.25 * gains.kV;
  const auto acceleration_at = [&](double v) {
    return std::min(budget.acceleration_volts(gains.kV * v) / kA,
                    job.profile.max_acceleration.value_or(std::numeric_limits<double>::infinity()));
  };
  const double v_top = top / gains.kV;

  if (controls_velocity(plant.kind)) {
    const double goal = job.profile.goal.value_or(0.75 * v_top);
    if (std::abs(goal) >= v_top) {
      return refusal(DesignError::no_motion_possible, "design", "profile.goal")
          .got(fmt::format("{} {}/s", format_number(goal), plant.unit))
          .expected(
              fmt::format("below {} {}/s, the fastest within the voltage less a tenth for feedback",
                          format_number(v_top), plant.unit));
    }
    motion.goal = goal;
    motion.max_velocity = v_top;
    motion.max_acceleration = acceleration_at(std::abs(goal));
    motion.duration = std::abs(goal) / motion.max_acceleration;
    return motion;
  }

  const double goal = job.profile.goal.value_or(plant.unit == "m" ? 1.0 : 0.5 * std::numbers::pi);
  const double distance = std::abs(goal);
  motion.goal = goal;
  const double v_limit = std::min(v_top, job.profile.max_velocity.value_or(v_top));
  // Time is unimodal in the cruise velocity: faster cruising leaves fewer volts to accelerate.
  double low = 1e-3 * v_limit;
  double high = v_limit < v_top ? v_limit : (1.0 - 1e-3) * v_top;
  const auto time_of = [&](double v) { return travel_time(distance, v, acceleration_at(v)); };
  constexpr double golden = 0.6180339887498949;
  for (int i = 0; i < 80; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    if (time_of(a) <= time_of(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  motion.max_velocity = 0.5 * (low + high);
  motion.max_acceleration = acceleration_at(motion.max_velocity);
  motion.duration = distance > 0.0 ? time_of(motion.max_velocity) : 0.0;
  return motion;
}

std::vector<PasteGains> paste_gains(const PlantDescription& plant, const Eigen::MatrixXd& K) {
  const bool flywheel = controls_velocity(plant.kind);
  const mechanisms::FeedforwardGains& gains = plant.gains;
  const double kD = K.cols() > 1 ? K(0, 1) : 0.0;
  PasteGains si{.per = plant.unit,
                .kP = K(0, 0),
                .kD = kD,
                .kS = gains.kS,
                .kV = gains.kV,
                .kA = plant.kA_determined ? gains.kA : 0.0,
                .kG = gains.kG};
  std::vector<PasteGains> all{si};

  // A gain per another unit is the gain per SI unit times that unit's size in SI.
  const auto per = [&](std::string name, double position, double velocity) {
    PasteGains scaled = si;
    scaled.per = std::move(name);
    scaled.kP *= flywheel ? velocity : position;
    scaled.kD *= velocity;
    scaled.kV *= velocity;
    scaled.kA *= velocity;
    all.push_back(std::move(scaled));
  };
  double turn = 0.0;  // SI units a rotation of the output
  if (plant.unit == "rad") {
    turn = 2.0 * std::numbers::pi;
  } else if (plant.drum_radius > 0.0) {
    turn = 2.0 * std::numbers::pi * plant.drum_radius;
  }
  if (turn > 0.0) {
    per("rotation", turn, turn);
    per("RPM", turn, turn / 60.0);
  }
  return all;
}

}  // namespace flyball::study
