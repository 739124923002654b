#include <flyball/simulation/characterization.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/friction.hpp>
#include <flyball/mechanisms/gravity.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {
namespace {

using identification::Recording;
using identification::TestKind;
using identification::TestRun;
using mechanisms::MechanismKind;

constexpr std::string_view in_record_characterization = "record_characterization";
constexpr double step = 0.25e-3;        // s, gravity and friction are constant over it
constexpr double sensor_memory = 0.5;   // s of rest before the first row that sensors may look at
constexpr double max_duration = 120.0;  // s, of one test

Expected<void> check_options(const CharacterizationOptions& options) {
  const bool travels = !controls_velocity(options.mechanism);
  return Checks(in_record_characterization)
      .not_negative(options.kS, "kS", "V")
      .positive(options.kV, "kV")
      .positive(options.kA, "kA")
      .finite(options.kG, "kG")
      .finite(options.angle_offset, "angle_offset")
      .within(options.friction_variation, 0.0, 0.99, "friction_variation")
      .within(options.breakaway, 1.0, 100.0, "breakaway")
      .positive(options.ramp_rate, "ramp_rate", "V/s")
      .positive(options.step_voltage, "step_voltage", "V")
      .within(options.ramp_limit, 0.0, options.ramp_rate * max_duration, "ramp_limit")
      .within(options.step_duration, 0.0, max_duration, "step_duration")
      .within(options.rest_before, 0.0, 10.0, "rest_before")
      .within(options.coast_after, 0.0, 10.0, "coast_after")
      .within(options.row_period, 1e-3, 1.0, "row_period")
      .within(options.row_jitter, 0.0, options.row_period / 4.0, "row_jitter")
      .within(options.sensor_refresh, 0.0, 1.0, "sensor_refresh")
      .within(options.sensor_delay, 0.0, sensor_memory / 2.0, "sensor_delay")
      .not_negative(options.resolution, "resolution")
      .within(options.velocity_window, 0.0, sensor_memory / 2.0, "velocity_window")
      .not_negative(options.velocity_noise.value_or(0.0), "velocity_noise")
      .not_negative(options.voltage_noise, "voltage_noise", "V")
      .finite(options.defects.spring, "defects.spring")
      .not_negative(options.defects.drag, "defects.drag")
      .within(options.defects.friction_asymmetry, -0.99, 0.99, "defects.friction_asymmetry")
      .within(options.defects.sag, 0.0, 1.0, "defects.sag")
      .not_negative(options.defects.backlash, "defects.backlash")
      .finite(options.defects.slip, "defects.slip")
      .within(options.defects.position_delay, 0.0, sensor_memory / 4.0, "defects.position_delay")
      .within(options.defects.velocity_delay, 0.0, sensor_memory / 4.0, "defects.velocity_delay")
      .also([&]() -> Expected<void> {
        if (options.defects.headroom > 0.0) {
          return {};
        }
        return refusal(ArgumentError::not_positive, in_record_characterization, "defects.headroom")
            .got(detail::format("{} V", options.defects.headroom));
      })
      .also([&] {
        return travels
                   ? check_positive(
                         options.travel_high - options.travel_low - 2.0 * options.travel_margin,
                         in_record_characterization, "travel_high - travel_low - 2 travel_margin")
                   : Expected<void>{};
      });
}

/// kA v̇ = V − kS sgn(v) − kV v − gravity between hard stops, with the session's defects. The motor
/// and the load are one body unless backlash parts them.
class Truth {
 public:
  Truth(const CharacterizationOptions& options, double position)
      : options_(options), load_{position, 0.0}, motor_{position, 0.0} {}

  [[nodiscard]] double position() const { return load_.position; }
  /// Where the encoder is.
  [[nodiscard]] double shown() const {
    return options_.defects.backlash > 0.0 ? motor_.position : load_.position;
  }
  void hold() { load_.velocity = motor_.velocity = 0.0; }

  /// Advances by a step with friction and gravity frozen.
  void advance(double voltage) {
    const bool parted = options_.defects.backlash > 0.0 && !touches(voltage);
    const double applied = applied_voltage(voltage, parted ? motor_.velocity : load_.velocity);
    if (parted) {
      // The motor runs free, the load under what pulls at it.
      motor_ = motion(motor_share, friction_here(motor_.velocity, applied) * motor_share)
                   .step(motor_, applied, step);
      const double load_force = -opposed();
      const double friction = friction_here(load_.velocity, load_force) * (1.0 - motor_share);
      const bool sticks = load_.velocity == 0.0 && std::abs(load_force) <= friction;
      if (!sticks) {
        const double sign = load_.velocity != 0.0 ? load_.velocity : load_force;
        load_.velocity += step * (load_force - std::copysign(friction, sign)) /
                          (options_.kA * (1.0 - motor_share));
        load_.position += step * load_.velocity;
      }
      stop_at_ends();
      collide();
    } else {
      load_ = motion(1.0, friction_here(load_.velocity, applied - opposed()))
                  .step(load_, applied - opposed(), step);
      stop_at_ends();
      motor_ = {load_.position + side_ * 0.5 * options_.defects.backlash, load_.velocity};
    }
  }

 private:
  static constexpr double motor_share = 0.25;  ///< Of inertia and friction, before the backlash.

  [[nodiscard]] mechanisms::FrictionMotion motion(double inertia, double friction) const {
    return {options_.kV, options_.kA * inertia, mechanisms::Friction{friction, options_.breakaway}};
  }
  [[nodiscard]] double applied_voltage(double voltage, double velocity) const {
    const SessionDefects& defects = options_.defects;
    const double back_emf = options_.kV * velocity;
    const double duty = voltage / 12.0;
    const double loss = defects.sag * duty * duty;
    const double sagged = (voltage + loss * back_emf) / (1.0 + loss);
    return std::clamp(sagged, back_emf - defects.headroom, back_emf + defects.headroom);
  }
  /// What acts against the load besides friction and damping.
  [[nodiscard]] double opposed() const {
    const double middle = controls_velocity(options_.mechanism)
                              ? 0.0
                              : 0.5 * (options_.travel_low + options_.travel_high);
    return mechanisms::gravity_voltage(options_.mechanism, options_.kG, position(), 0.0) +
           options_.defects.spring * (position() - middle) +
           options_.defects.drag * load_.velocity * std::abs(load_.velocity);
  }
  /// Hard stops at the ends of the travel.
  void stop_at_ends() {
    if (controls_velocity(options_.mechanism)) {
      return;
    }
    if (position() <= options_.travel_low) {
      load_ = {options_.travel_low, std::max(0.0, load_.velocity)};
    } else if (position() >= options_.travel_high) {
      load_ = {options_.travel_high, std::min(0.0, load_.velocity)};
    }
  }
  /// Whether the motor stays at the side of the gap that it is at: it pushes the load, or would
  /// fall behind it.
  [[nodiscard]] bool touches(double voltage) {
    const double gap = 0.5 * options_.defects.backlash;
    const double offset = motor_.position - load_.position;
    if (std::abs(offset) < gap * (1.0 - 1e-9)) {
      return false;
    }
    side_ = offset > 0.0 ? 1.0 : -1.0;
    const double motor_force =
        applied_voltage(voltage, motor_.velocity) - options_.kV * motor_.velocity;
    const double load_force = -opposed();
    const double sign = motor_.velocity != 0.0 ? motor_.velocity : motor_force + load_force;
    const double friction = sign == 0.0 ? 0.0 : std::copysign(friction_here(sign, sign), sign);
    const double motor = (motor_force - friction * motor_share) / motor_share;
    const double load = (load_force - friction * (1.0 - motor_share)) / (1.0 - motor_share);
    return side_ * (motor - load) >= 0.0 ||
           (motor_.velocity == 0.0 && std::abs(motor_force + load_force) <= std::abs(friction));
  }
  /// An inelastic impact where the motor runs into a side of the gap.
  void collide() {
    const double gap = 0.5 * options_.defects.backlash;
    const double offset = motor_.position - load_.position;
    if (std::abs(offset) < gap) {
      return;
    }
    side_ = offset > 0.0 ? 1.0 : -1.0;
    load_.velocity = motor_share * motor_.velocity + (1.0 - motor_share) * load_.velocity;
    motor_ = {load_.position + side_ * gap, load_.velocity};
  }

  [[nodiscard]] double friction_here(double velocity, double drive) const {
    const double length = controls_velocity(options_.mechanism)
                              ? 2.0 * std::numbers::pi
                              : 0.5 * (options_.travel_high - options_.travel_low);
    const double sign = velocity != 0.0 ? velocity : drive;
    return options_.kS * (1.0 + (sign < 0.0 ? -1.0 : 1.0) * options_.defects.friction_asymmetry) *
           (1.0 +
            options_.friction_variation * std::sin(2.0 * std::numbers::pi * position() / length));
  }

  const CharacterizationOptions& options_;
  mechanisms::MechanismState load_;
  mechanisms::MechanismState motor_;
  double side_ = 1.0;  ///< Of the gap, at which the motor touches the load.
};

/// The true position on a fine grid, at rest before time 0.
class History {
 public:
  explicit History(double position) : start_(position), positions_{position} {}
  void append(double position) { positions_.push_back(position); }

  [[nodiscard]] double at(double time) const {
    if (time <= 0.0) {
      return start_;
    }
    const double place = time / step;
    const auto index = std::min(static_cast<std::size_t>(place), positions_.size() - 1);
    const std::size_t next = std::min(index + 1, positions_.size() - 1);
    const double fraction = place - static_cast<double>(index);
    return positions_[index] + std::min(fraction, 1.0) * (positions_[next] - positions_[index]);
  }

 private:
  double start_;
  std::vector<double> positions_;
};

struct Applied {
  std::vector<double> time;
  std::vector<double> voltage;
  History history;
};

/// Drives one test and keeps what was truly applied and where the mechanism truly was.
Applied drive(const CharacterizationOptions& options, TestKind kind, Random random) {
  const double sign = identification::is_forward(kind) ? 1.0 : -1.0;
  const bool ramp = identification::is_quasistatic(kind);
  const bool travels = !controls_velocity(options.mechanism);
  const double start = travels ? (sign > 0.0 ? options.travel_low : options.travel_high) : 0.0;
  const double end = sign > 0.0 ? options.travel_high - options.travel_margin
                                : options.travel_low + options.travel_margin;
  const double duration = ramp ? options.ramp_limit / options.ramp_rate : options.step_duration;

  Truth mechanism(options, start);
  Applied applied{{}, {}, History(mechanism.shown())};
  double cut = -1.0;
  long steps = 0;
  for (long row = 0;; ++row) {
    const double nominal = static_cast<double>(row) * options.row_period;
    const double time =
        std::max(static_cast<double>(steps) * step,
                 std::round((nominal + options.row_jitter * random.normal()) / step) * step);
    for (; static_cast<double>(steps) * step < time - step / 2.0; ++steps) {
      if (nominal <= options.rest_before) {
        mechanism.hold();
      } else {
        mechanism.advance(applied.voltage.back());
      }
      applied.history.append(mechanism.shown());
    }
    const double driven = time - options.rest_before;
    const bool arrived = travels && sign * (mechanism.position() - end) >= 0.0;
    if (cut < 0.0 && (driven > duration || arrived)) {
      cut = time;
    }
    if (cut >= 0.0 && time > cut + options.coast_after) {
      return applied;
    }
    double voltage = 0.0;
    if (cut < 0.0 && driven >= 0.0) {
      voltage = sign * (ramp ? options.ramp_rate * driven : options.step_voltage);
    }
    applied.time.push_back(time);
    applied.voltage.push_back(voltage);
  }
}

/// What an encoder lost by slipping at a third and two thirds of a test.
double slipped(double slip, double share) {
  return slip * ((share > 1.0 / 3.0 ? 1.0 : 0.0) + (share > 2.0 / 3.0 ? 1.0 : 0.0));
}

TestRun record(const CharacterizationOptions& options, TestKind kind, Random random) {
  const Applied applied = drive(options, kind, random.split());
  Random voltage_noise = random.split();
  Random velocity_noise = random.split();
  const double refresh_phase = random.uniform() * options.sensor_refresh;
  const double velocity_std = options.velocity_noise.value_or(
      0.005 * std::abs(options.step_voltage - options.kS) / options.kV);
  const double true_zero = options.mechanism == MechanismKind::arm ? options.angle_offset : 0.0;

  TestRun run;
  run.kind = kind;
  double refreshed = -1.0;
  double position = 0.0;
  double velocity = 0.0;
  for (std::size_t row = 0; row < applied.time.size(); ++row) {
    const double time = applied.time[row];
    double latest = time;
    if (options.sensor_refresh > 0.0) {
      latest = std::floor((time - refresh_phase) / options.sensor_refresh + 1e-9) *
                   options.sensor_refresh +
               refresh_phase;
    }
    const bool fresh = row == 0 || latest > refreshed + 1e-9;
    if (fresh) {
      refreshed = latest;
      const SessionDefects& defects = options.defects;
      const double instant = latest - options.sensor_delay - defects.velocity_delay;
      position = applied.history.at(latest - options.sensor_delay - defects.position_delay) -
                 true_zero + slipped(defects.slip, latest / applied.time.back());
      if (row == 0 && defects.stale_first_row) {
        position = 0.0;
      }
      if (options.resolution > 0.0) {
        position = std::floor(position / options.resolution) * options.resolution;
      }
      const double window = std::max(options.velocity_window, step);
      velocity = (applied.history.at(instant) - applied.history.at(instant - window)) / window;
      velocity += options.noise_per_row ? 0.0 : velocity_std * velocity_noise.normal();
    }
    run.time.push_back(time);
    run.voltage.push_back(applied.voltage[row] + options.voltage_noise * voltage_noise.normal());
    run.position.push_back(position);
    run.velocity.push_back(velocity +
                           (options.noise_per_row ? velocity_std * velocity_noise.normal() : 0.0));
  }
  return run;
}

}  // namespace

Expected<Recording> record_characterization(const CharacterizationOptions& options) {
  FLYBALL_CHECK(check_options(options));
  Recording recording;
  recording.mechanism = options.mechanism;
  recording.unit = std::string(mechanisms::position_unit(options.mechanism));
  Random random(options.seed);
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    recording.runs.push_back(record(options, kind, random.split()));
  }
  return recording;
}

}  // namespace flyball
