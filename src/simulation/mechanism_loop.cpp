#include <flyball/simulation/mechanism_loop.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/simulation/closed_loop.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_simulate_mechanism = "simulate_mechanism";

Expected<void> check_loop(const MechanismLoop& loop) {
  if (loop.reference.empty()) {
    return refusal(ArgumentError::empty, in_simulate_mechanism, "the reference")
        .got("empty")
        .expected("one row a period");
  }
  for (std::size_t k = 0; k < loop.reference.size(); ++k) {
    const std::string row = detail::format("reference {}", k);
    FLYBALL_CHECK(Checks(in_simulate_mechanism)
                      .finite(loop.reference[k].position, row)
                      .finite(loop.reference[k].velocity, row));
  }
  const MechanismTruth& truth = loop.truth;
  return Checks(in_simulate_mechanism)
      .finite(loop.initial.position, "initial position")
      .finite(loop.initial.velocity, "initial velocity")
      .positive(truth.battery.open_circuit_voltage, "open_circuit_voltage", "V")
      .not_negative(truth.battery.resistance, "battery resistance", "Ohm")
      .finite(truth.battery.other_current, "other_current")
      .also([&] {
        return std::isinf(truth.motor_resistance)
                   ? Expected<void>{}
                   : check_positive(truth.motor_resistance, in_simulate_mechanism,
                                    "motor_resistance", "Ohm");
      })
      .not_negative(truth.actuation_delay.si(), "actuation_delay", "s")
      .not_negative(truth.voltage_noise, "voltage_noise", "V");
}

/// The mechanism with its motor, behind its motor controller and battery. States: position and
/// velocity. Inputs: the command and a voltage that is added at the motor. Outputs: what is
/// measured, and the rail.
class PoweredMechanism final : public SimulatedPlant {
 public:
  PoweredMechanism(const MechanismPlant& mechanism, const MechanismTruth& truth,
                   double nominal_voltage, const MechanismState& initial)
      : mechanism_(mechanism),
        truth_(truth),
        nominal_voltage_(nominal_voltage),
        state_(Eigen::Vector2d(initial.position, initial.velocity)) {
    const std::string unit(mechanisms::position_unit(mechanism.kind()));
    const Coordinate position{.name = "position", .unit = unit};
    const Coordinate velocity{.name = "velocity", .unit = unit + "/s"};
    description_.states = {position, velocity};
    description_.inputs = {{.name = "command", .unit = "V"}, {.name = "disturbance", .unit = "V"}};
    description_.outputs = {measures_velocity() ? velocity : position,
                            {.name = "rail_voltage", .unit = "V"}};
  }

  [[nodiscard]] const ModelDescription& description() const noexcept override {
    return description_;
  }
  [[nodiscard]] const VectorXd& state() const noexcept override { return state_; }

  void output(const VectorIn& u, VectorOut y) override {
    y(0) = measures_velocity() ? state_(1) : state_(0);
    y(1) = rail(duty(u));
  }

  [[nodiscard]] Expected<void> advance(double, const VectorIn& u, double duration) override {
    const double D = duty(u);
    const double voltage = D * rail(D) + u(1);
    const double back_emf = truth_.gains.kV * state_(1);
    volt_seconds_ += voltage * duration;
    coulombs_ +=
        (D * (D * rail(D) - back_emf) / truth_.motor_resistance + truth_.battery.other_current) *
        duration;
    peak_voltage_ = std::max(peak_voltage_, std::abs(voltage));
    const MechanismState next = mechanism_.step({state_(0), state_(1)}, voltage, duration);
    state_ << next.position, next.velocity;
    return {};
  }

  /// The integrals since the last call, V s and A s.
  [[nodiscard]] Eigen::Vector2d take_integrals() {
    return {std::exchange(volt_seconds_, 0.0), std::exchange(coulombs_, 0.0)};
  }
  [[nodiscard]] double peak_voltage() const noexcept { return peak_voltage_; }

 private:
  [[nodiscard]] bool measures_velocity() const noexcept {
    return controls_velocity(mechanism_.kind());
  }
  [[nodiscard]] double duty(const VectorIn& u) const noexcept {
    return std::clamp(u(0) / nominal_voltage_, -1.0, 1.0);
  }
  [[nodiscard]] double rail(double duty) const noexcept {
    return truth_.battery.rail_voltage(duty, truth_.gains.kV * state_(1), truth_.motor_resistance);
  }

  ModelDescription description_{};
  MechanismPlant mechanism_;
  const MechanismTruth& truth_;
  double nominal_voltage_;
  VectorXd state_;
  double volt_seconds_ = 0.0;
  double coulombs_ = 0.0;
  double peak_voltage_ = 0.0;
};

/// What the closed loop does not record: the controller's answers and the means of the periods.
struct Columns {
  std::vector<double> estimated_position, estimated_velocity, voltage, motor_voltage, current;
};

Expected<TimeSeries> series_of(const TimeSeries& loop, const Columns& columns, bool flywheel,
                               bool has_velocity) {
  TimeSeries series(loop.time());
  const auto unit = [&](std::string_view name) {
    for (const TimeSeries::Column& column : loop.columns()) {
      if (column.name == name) {
        return column.unit;
      }
    }
    return std::string();
  };
  const auto take = [&](const std::string& name, const std::string& from) {
    return series.add(name, unit(from), *loop.find(from));
  };
  FLYBALL_CHECK(take("reference_position", "reference_position"));
  FLYBALL_CHECK(take("reference_velocity", "reference_velocity"));
  FLYBALL_CHECK(take("position", "position"));
  FLYBALL_CHECK(take("velocity", "velocity"));
  FLYBALL_CHECK(take("measurement", flywheel ? "measured_velocity" : "measured_position"));
  if (!flywheel) {
    FLYBALL_CHECK(series.add("estimated_position", unit("position"), columns.estimated_position));
  }
  if (has_velocity) {
    FLYBALL_CHECK(series.add("estimated_velocity", unit("velocity"), columns.estimated_velocity));
  }
  FLYBALL_CHECK(series.add("voltage", "V", columns.voltage));
  FLYBALL_CHECK(take("command", "commanded_command"));
  FLYBALL_CHECK(series.add("motor_voltage", "V", columns.motor_voltage));
  FLYBALL_CHECK(take("rail_voltage", "output_rail_voltage"));
  FLYBALL_CHECK(series.add("current", "A", columns.current));
  return series;
}

}  // namespace

Expected<MechanismResponse> simulate_mechanism(const MechanismLoop& loop) {
  const MechanismControllerDesign& design = loop.controller;
  const MechanismTruth& truth = loop.truth;
  FLYBALL_TRY(auto controller, MechanismController<>::create(design));
  FLYBALL_CHECK(check_loop(loop));
  FLYBALL_TRY(const auto mechanism,
              MechanismPlant::create(design.kind, truth.gains, truth.breakaway));
  PoweredMechanism plant(mechanism, truth, design.nominal_voltage, loop.initial);
  controller.reset({loop.initial.position, loop.initial.velocity});

  const auto rows = static_cast<Index>(loop.reference.size());
  ClosedLoop closed;
  closed.period = design.plant.period;
  closed.reference.resize(2, rows);
  for (Index k = 0; k < rows; ++k) {
    const MotionState& r = loop.reference[static_cast<std::size_t>(k)];
    closed.reference.col(k) << r.position, r.velocity;
  }
  closed.sensors = {truth.sensor};
  closed.actuators = {{.delay = truth.actuation_delay},
                      {.delay = truth.actuation_delay, .noise = truth.voltage_noise}};
  closed.seed = loop.seed;

  const double T = design.plant.period.si();
  Columns columns;
  std::size_t saturated = 0;
  const auto take_means = [&] {
    const Eigen::Vector2d integrals = plant.take_integrals();
    columns.motor_voltage.push_back(integrals(0) / T);
    columns.current.push_back(integrals(1) / T);
  };
  const auto law = [&](const LoopSample& sample) -> LoopCommand {
    if (sample.index > 0) {
      take_means();
    }
    const auto& next = loop.reference[std::min(sample.index + 1, loop.reference.size() - 1)];
    const double u =
        controller.update(sample.y(0), loop.reference[sample.index], next, sample.y(1));
    saturated += std::abs(u) >= controller.limit() * (1.0 - 1e-12) ? 1 : 0;
    columns.voltage.push_back(u);
    columns.estimated_position.push_back(controller.x_hat()(0));
    columns.estimated_velocity.push_back(controller.x_hat().tail(1)(0));
    return Eigen::Vector2d(controller.command(), 0.0);
  };
  FLYBALL_TRY(const auto result, simulate_closed_loop(plant, law, closed));
  take_means();

  const bool flywheel = controls_velocity(design.kind);
  FLYBALL_TRY(auto series,
              series_of(result.series, columns, flywheel, flywheel || design.plant.A.rows() == 2));
  const TrackingError& error = result.tracking[flywheel ? 1 : 0];
  return MechanismResponse{
      .series = std::move(series),
      .rms_error = error.rms,
      .max_error = error.max,
      .final_error = error.final,
      .peak_voltage = plant.peak_voltage(),
      .saturated_fraction = static_cast<double>(saturated) / static_cast<double>(rows)};
}

}  // namespace flyball
