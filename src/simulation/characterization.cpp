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

#include "core/try.hpp"

namespace flyball {
namespace {

using identification::Recording;
using identification::TestKind;
using identification::TestRun;
using mechanisms::MechanismKind;

constexpr std::string_view where = "record_characterization";
constexpr double step = 0.25e-3;        // s, gravity and friction are constant over it
constexpr double sensor_memory = 0.5;   // s of rest before the first row that sensors may look at
constexpr double max_duration = 120.0;  // s, of one test

Expected<void> check_options(const CharacterizationOptions& options) {
  const bool travels = options.mechanism != MechanismKind::flywheel;
  return Checks(where)
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
      .also([&] {
        return travels ? check_positive(
                             options.travel_high - options.travel_low - 2.0 * options.travel_margin,
                             where, "travel_high - travel_low - 2 travel_margin")
                       : Expected<void>{};
      });
}

/// kA v̇ = V − kS sgn(v) − kV v − gravity between hard stops.
class Truth {
 public:
  Truth(const CharacterizationOptions& options, double position)
      : options_(options), state_{position, 0.0} {}

  [[nodiscard]] double position() const { return state_.position; }
  void hold() { state_.velocity = 0.0; }

  /// Advances by a step with friction and gravity frozen.
  void advance(double voltage) {
    const double drive =
        voltage - mechanisms::gravity_voltage(options_.mechanism, options_.kG, position(), 0.0);
    const mechanisms::Friction friction{friction_here(), options_.breakaway};
    state_ =
        mechanisms::FrictionMotion(options_.kV, options_.kA, friction).step(state_, drive, step);
    if (options_.mechanism != MechanismKind::flywheel) {
      const double stopped = std::clamp(position(), options_.travel_low, options_.travel_high);
      if (stopped != position()) {
        state_ = {stopped, 0.0};
      }
    }
  }

 private:
  [[nodiscard]] double friction_here() const {
    const double length = options_.mechanism == MechanismKind::flywheel
                              ? 2.0 * std::numbers::pi
                              : 0.5 * (options_.travel_high - options_.travel_low);
    return options_.kS * (1.0 + options_.friction_variation *
                                    std::sin(2.0 * std::numbers::pi * position() / length));
  }

  const CharacterizationOptions& options_;
  mechanisms::MechanismState state_;
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
  const bool travels = options.mechanism != MechanismKind::flywheel;
  const double start = travels ? (sign > 0.0 ? options.travel_low : options.travel_high) : 0.0;
  const double end = sign > 0.0 ? options.travel_high - options.travel_margin
                                : options.travel_low + options.travel_margin;
  const double duration = ramp ? options.ramp_limit / options.ramp_rate : options.step_duration;

  Truth mechanism(options, start);
  Applied applied{{}, {}, History(start)};
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
      applied.history.append(mechanism.position());
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
      const double instant = latest - options.sensor_delay;
      position = applied.history.at(instant) - true_zero;
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
