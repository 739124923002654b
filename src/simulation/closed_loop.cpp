#include <flyball/simulation/closed_loop.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <string>

#include <flyball/control/lqg.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view where = "simulate";

Eigen::VectorXd scalar(double value) {
  return Eigen::VectorXd::Constant(1, value);
}

// The reference or the truth in the coordinates of the model's states.
Eigen::VectorXd states_of(mechanisms::MechanismKind kind, Eigen::Index n, double position,
                          double velocity) {
  if (kind == mechanisms::MechanismKind::flywheel) {
    return scalar(velocity);
  }
  return n == 1 ? scalar(position) : Eigen::VectorXd(Eigen::Vector2d(position, velocity));
}

Expected<void> check_job(const ClosedLoopJob& job) {
  const RegulatorDesign& regulator = job.regulator;
  const Eigen::Index n = regulator.plant.A.rows();
  const bool flywheel = regulator.kind == mechanisms::MechanismKind::flywheel;
  if (n != 1 && (flywheel || n != 2)) {
    return tl::unexpected(Error(ArgumentError::wrong_shape)
                              .in(std::string(where))
                              .about("the regulator's plant")
                              .got(detail::format("of {} states", n))
                              .expected(flywheel ? "of one state, the velocity"
                                                 : "of one state, the position, or of two, "
                                                   "position and velocity"));
  }
  if (job.reference.empty()) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in(std::string(where))
                              .about("the reference")
                              .got("empty")
                              .expected("one row a period"));
  }
  for (std::size_t k = 0; k < job.reference.size(); ++k) {
    const std::string row = detail::format("reference {}", k);
    FLYBALL_CHECK(Checks(where)
                      .finite(job.reference[k].position, row)
                      .finite(job.reference[k].velocity, row));
  }
  const Battery& battery = job.truth.battery;
  return Checks(where)
      .positive(regulator.max_voltage, "max_voltage", "V")
      .positive(regulator.nominal_voltage, "nominal_voltage", "V")
      .finite(job.initial.position, "initial position")
      .finite(job.initial.velocity, "initial velocity")
      .positive(battery.open_circuit_voltage, "open_circuit_voltage", "V")
      .not_negative(battery.resistance, "battery resistance", "Ohm")
      .finite(battery.other_current, "other_current")
      .also([&] {
        return std::isinf(job.truth.motor_resistance)
                   ? Expected<void>{}
                   : check_positive(job.truth.motor_resistance, where, "motor_resistance", "Ohm");
      })
      .not_negative(job.truth.actuation_delay.si(), "actuation_delay", "s")
      .not_negative(regulator.measurement_delay.si(), "measurement_delay", "s")
      .not_negative(job.truth.voltage_noise, "voltage_noise", "V");
}

// The motor behind its controller and battery.
class Drive {
 public:
  Drive(const PlantTruth& truth, double nominal_voltage)
      : truth_(truth), nominal_voltage_(nominal_voltage) {}

  void set(double command, double noise) noexcept {
    duty_ = std::clamp(command / nominal_voltage_, -1.0, 1.0);
    noise_ = noise;
  }
  [[nodiscard]] double rail(double velocity) const noexcept {
    return truth_.battery.rail_voltage(duty_, truth_.gains.kV * velocity, truth_.motor_resistance);
  }
  [[nodiscard]] double motor_voltage(double velocity) const noexcept {
    return duty_ * rail(velocity) + noise_;
  }
  [[nodiscard]] double battery_current(double velocity) const noexcept {
    return duty_ * (duty_ * rail(velocity) - truth_.gains.kV * velocity) / truth_.motor_resistance +
           truth_.battery.other_current;
  }

 private:
  const PlantTruth& truth_;
  double nominal_voltage_;
  double duty_ = 0.0;
  double noise_ = 0.0;
};

struct Command {
  double time;
  double value;
  double noise;
};

struct Columns {
  std::vector<double> time, reference_position, reference_velocity, position, velocity, measurement,
      estimated_position, estimated_velocity, voltage, command, motor_voltage, rail_voltage,
      current;

  [[nodiscard]] Expected<TimeSeries> take(mechanisms::MechanismKind kind, bool has_position,
                                          bool has_velocity) {
    const std::string unit(mechanisms::position_unit(kind));
    const std::string rate = unit + "/s";
    const bool flywheel = kind == mechanisms::MechanismKind::flywheel;
    TimeSeries series(std::move(time));
    Expected<void> added{};
    const auto add = [&](const char* name, const std::string& of, std::vector<double>& values) {
      if (added) {
        added = series.add(name, of, std::move(values));
      }
    };
    add("reference_position", unit, reference_position);
    add("reference_velocity", rate, reference_velocity);
    add("position", unit, position);
    add("velocity", rate, velocity);
    add("measurement", flywheel ? rate : unit, measurement);
    if (has_position) {
      add("estimated_position", unit, estimated_position);
    }
    if (has_velocity) {
      add("estimated_velocity", rate, estimated_velocity);
    }
    add("voltage", "V", voltage);
    add("command", "V", command);
    add("motor_voltage", "V", motor_voltage);
    add("rail_voltage", "V", rail_voltage);
    add("current", "A", current);
    return added.map([&] { return std::move(series); });
  }
};

}  // namespace

Expected<ClosedLoopResult> simulate(const ClosedLoopJob& job) {
  const RegulatorDesign& design = job.regulator;
  const PlantTruth& truth = job.truth;
  FLYBALL_TRY(auto regulator,
              Lqg<>::create(design.plant, design.K, design.K_e, scalar(-design.max_voltage),
                            scalar(design.max_voltage)));
  FLYBALL_CHECK(check_job(job));
  FLYBALL_TRY(auto plant, MechanismPlant::create(design.kind, truth.gains, truth.breakaway));
  FLYBALL_TRY(auto feedforward,
              SimpleFeedforward::create(design.kind, design.gains, design.plant.period));
  // Truths are recorded each millisecond or finer, for sensors and for the battery.
  const double T = design.plant.period.si();
  const auto records = static_cast<long long>(std::clamp(std::ceil(T / 1e-3), 1.0, 1e4));
  const double h = T / static_cast<double>(records);
  Random random(job.seed);
  FLYBALL_TRY(auto sensor, Sensor::create(truth.sensor, Time(h), random.split()));

  const bool flywheel = design.kind == mechanisms::MechanismKind::flywheel;
  const Eigen::Index n = design.plant.A.rows();
  const VoltageCompensation compensation(design.nominal_voltage);
  MechanismState state = job.initial;
  Drive drive(truth, design.nominal_voltage);
  std::deque<Command> on_the_way;
  Columns columns;
  ClosedLoopResult result;
  double squares = 0.0;
  std::size_t saturated = 0;

  regulator.reset(states_of(design.kind, n, state.position, state.velocity));
  sensor.record(flywheel ? state.velocity : state.position);
  for (std::size_t k = 0; k < job.reference.size(); ++k) {
    const MotionState& r = job.reference[k];
    const MotionState& r_next = job.reference[std::min(k + 1, job.reference.size() - 1)];
    const double time = static_cast<double>(k) * T;

    const double reading = sensor.read();
    const double rate = flywheel ? (r_next.velocity - r.velocity) / T : r.velocity;
    const double y = reading + design.measurement_delay.si() * rate;
    const double rail = drive.rail(state.velocity);
    const double direction = r.velocity != 0.0 ? r.velocity : r_next.velocity;
    const double extra = (design.feed_forward_gravity ? feedforward.gravity(r.position) : 0.0) +
                         (design.feed_forward_friction ? feedforward.friction(direction) : 0.0);
    const double available =
        design.compensate_voltage ? compensation.rail(rail) : design.nominal_voltage;
    const double u = regulator.step(states_of(design.kind, n, r.position, r.velocity),
                                    states_of(design.kind, n, r_next.position, r_next.velocity),
                                    scalar(y), scalar(extra), available)(0);
    const double command = design.compensate_voltage ? compensation.command(u, rail) : u;
    const double noise = truth.voltage_noise > 0.0 ? random.normal(0.0, truth.voltage_noise) : 0.0;
    on_the_way.push_back({time + truth.actuation_delay.si(), command, noise});

    const double error = flywheel ? r.velocity - state.velocity : r.position - state.position;
    squares += error * error;
    result.max_error = std::max(result.max_error, std::abs(error));
    result.final_error = error;
    saturated += std::abs(u) >= std::min(design.max_voltage, available) * (1.0 - 1e-12) ? 1 : 0;

    columns.time.push_back(time);
    columns.reference_position.push_back(r.position);
    columns.reference_velocity.push_back(r.velocity);
    columns.position.push_back(state.position);
    columns.velocity.push_back(state.velocity);
    columns.measurement.push_back(reading);
    columns.estimated_position.push_back(regulator.x_hat()(0));
    columns.estimated_velocity.push_back(regulator.x_hat()(n - 1));
    columns.voltage.push_back(u);
    columns.command.push_back(command);
    columns.rail_voltage.push_back(rail);

    double volt_seconds = 0.0;
    double coulombs = 0.0;
    const auto advance = [&](double duration) {
      const double voltage = drive.motor_voltage(state.velocity);
      volt_seconds += voltage * duration;
      coulombs += drive.battery_current(state.velocity) * duration;
      result.peak_voltage = std::max(result.peak_voltage, std::abs(voltage));
      state = plant.step(state, voltage, duration);
    };
    for (long long i = 0; i < records; ++i) {
      const double from = time + static_cast<double>(i) * h;
      double done = 0.0;
      constexpr double rounding = 1e-12;
      while (!on_the_way.empty() && on_the_way.front().time < from + h - rounding) {
        const double until = std::clamp(on_the_way.front().time - from, done, h);
        advance(until - done);
        done = until;
        drive.set(on_the_way.front().value, on_the_way.front().noise);
        on_the_way.pop_front();
      }
      advance(h - done);
      sensor.record(flywheel ? state.velocity : state.position);
    }
    columns.motor_voltage.push_back(volt_seconds / T);
    columns.current.push_back(coulombs / T);
  }

  const auto rows = static_cast<double>(job.reference.size());
  result.rms_error = std::sqrt(squares / rows);
  result.saturated_fraction = static_cast<double>(saturated) / rows;
  return columns.take(design.kind, !flywheel, flywheel || n == 2).map([&](TimeSeries series) {
    result.series = std::move(series);
    return std::move(result);
  });
}

}  // namespace flyball
