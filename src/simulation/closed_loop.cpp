#include <flyball/simulation/closed_loop.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <string>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_simulate_closed_loop = "simulate_closed_loop";

Index size_of(const std::vector<Coordinate>& coordinates) {
  return static_cast<Index>(coordinates.size());
}

const std::vector<Coordinate>& referred(const ModelDescription& plant, const ClosedLoop& loop) {
  return loop.reference_of == ReferenceOf::states ? plant.states : plant.outputs;
}

Expected<void> check_count(std::size_t count, std::size_t most, std::string_view name,
                           std::string_view of) {
  return count <= most ? Expected<void>{}
                       : refusal(ArgumentError::wrong_shape, in_simulate_closed_loop, name)
                             .got(detail::format("{}", count))
                             .expected(detail::format("at most one for each {}, {}", of, most));
}

Expected<void> check_actuator(const ActuatorModel& actuator, const Coordinate& input) {
  if (!(actuator.min < actuator.max)) {
    return refusal(ArgumentError::out_of_range, in_simulate_closed_loop,
                   "the lower limit of " + input.name)
        .got(format_number(actuator.min))
        .expected("below the upper, which is " + format_number(actuator.max));
  }
  return Checks(in_simulate_closed_loop)
      .not_negative(actuator.delay.si(), "the delay of " + input.name, "s")
      .not_negative(actuator.noise, "the noise of " + input.name, input.unit);
}

Expected<void> check_loop(const ModelDescription& plant, const ClosedLoop& loop) {
  const MatrixXd& r = loop.reference;
  FLYBALL_CHECK(check_count(loop.sensors.size(), plant.outputs.size(), "sensors", "output"));
  FLYBALL_CHECK(check_count(loop.actuators.size(), plant.inputs.size(), "actuators", "input"));
  FLYBALL_CHECK(Checks(in_simulate_closed_loop)
                    .positive(loop.period.si(), "period", "s")
                    .positive(loop.record_step.si(), "record_step", "s"));
  if (r.cols() == 0) {
    return refusal(ArgumentError::empty, in_simulate_closed_loop, "the reference")
        .got("empty")
        .expected("one column a period");
  }
  if (r.rows() > 0) {
    const bool states = loop.reference_of == ReferenceOf::states;
    FLYBALL_CHECK(Checks(in_simulate_closed_loop)
                      .shape(r, size_of(referred(plant, loop)), r.cols(), "the reference",
                             states ? "states x periods" : "outputs x periods")
                      .finite(r, "the reference"));
  }
  for (std::size_t i = 0; i < loop.actuators.size(); ++i) {
    FLYBALL_CHECK(check_actuator(loop.actuators[i], plant.inputs[i]));
  }
  return {};
}

Expected<void> check_command(const LoopCommand& command, const ModelDescription& plant,
                             double time) {
  const auto refuse = [&](ArgumentError code, std::string about, std::string got,
                          std::string expected) {
    return refusal(code, in_simulate_closed_loop, about)
        .got(std::move(got) + detail::format(" at t = {} s", format_number(time)))
        .expected(std::move(expected))
        .with("t", time);
  };
  const Index m = size_of(plant.inputs);
  const Index n = size_of(plant.states);
  if (command.u.size() != m) {
    return refuse(ArgumentError::wrong_shape, "the controller's answer",
                  detail::format("{} values", command.u.size()),
                  detail::format("one for each input, {}", m));
  }
  if (command.x_hat.size() != 0 && command.x_hat.size() != n) {
    return refuse(ArgumentError::wrong_shape, "the controller's estimate",
                  detail::format("{} values", command.x_hat.size()),
                  detail::format("one for each state, {}, or none", n));
  }
  for (Index i = 0; i < m; ++i) {
    if (!std::isfinite(command.u(i))) {
      return refuse(ArgumentError::not_finite,
                    "the controller's " + plant.inputs[static_cast<std::size_t>(i)].name,
                    format_number(command.u(i)), "a finite number");
    }
  }
  return {};
}

/// The inputs on their way to the plant.
class Actuators {
 public:
  Actuators(std::vector<ActuatorModel> models, Index inputs, Random& random)
      : models_(std::move(models)),
        on_the_way_(static_cast<std::size_t>(inputs)),
        random_(random),
        applied_(VectorXd::Zero(inputs)) {
    models_.resize(on_the_way_.size());
  }

  void send(double time, const VectorXd& u) {
    for (std::size_t i = 0; i < models_.size(); ++i) {
      const ActuatorModel& model = models_[i];
      const double noise = model.noise > 0.0 ? random_.normal(0.0, model.noise) : 0.0;
      on_the_way_[i].push_back(
          {time + model.delay.si(),
           std::clamp(u(static_cast<Index>(i)), model.min, model.max) + noise});
    }
  }

  /// When the next input changes, s; infinite if none is on its way.
  [[nodiscard]] double next_change() const {
    double next = std::numeric_limits<double>::infinity();
    for (const auto& queue : on_the_way_) {
      next = queue.empty() ? next : std::min(next, queue.front().time);
    }
    return next;
  }

  /// What changes at or before a time.
  void change(double time) {
    for (std::size_t i = 0; i < on_the_way_.size(); ++i) {
      while (!on_the_way_[i].empty() && on_the_way_[i].front().time <= time) {
        applied_(static_cast<Index>(i)) = on_the_way_[i].front().value;
        on_the_way_[i].pop_front();
      }
    }
  }

  [[nodiscard]] const VectorXd& applied() const noexcept { return applied_; }

  /// Whether a command is at a limit or beyond.
  [[nodiscard]] bool saturates(Index i, double command) const {
    const ActuatorModel& model = models_[static_cast<std::size_t>(i)];
    return command <= model.min || command >= model.max;
  }

 private:
  struct Change {
    double time;
    double value;
  };

  std::vector<ActuatorModel> models_;
  std::vector<std::deque<Change>> on_the_way_;
  Random& random_;
  VectorXd applied_;
};

/// One column a period of everything that is recorded.
struct Record {
  Record(const ModelDescription& plant, Index periods)
      : x(size_of(plant.states), periods),
        x_hat(size_of(plant.states), 0),
        y(size_of(plant.outputs), periods),
        measured(y.rows(), periods),
        commanded(size_of(plant.inputs), periods),
        applied(commanded.rows(), periods) {}

  MatrixXd x, x_hat, y, measured, commanded, applied;
};

Expected<TimeSeries> series_of(const Record& record, const ModelDescription& plant,
                               const ClosedLoop& loop) {
  const Index periods = loop.reference.cols();
  std::vector<double> time(static_cast<std::size_t>(periods));
  for (std::size_t k = 0; k < time.size(); ++k) {
    time[k] = static_cast<double>(k) * loop.period.si();
  }
  TimeSeries series(std::move(time));
  const auto add = [&](std::string_view prefix, const MatrixXd& rows,
                       const std::vector<Coordinate>& coordinates) -> Expected<void> {
    for (Index i = 0; rows.cols() > 0 && i < rows.rows(); ++i) {
      const Coordinate& coordinate = coordinates[static_cast<std::size_t>(i)];
      std::vector<double> values(static_cast<std::size_t>(periods));
      VectorXd::Map(values.data(), periods) = rows.row(i);
      FLYBALL_CHECK(
          series.add(std::string(prefix) + coordinate.name, coordinate.unit, std::move(values)));
    }
    return {};
  };
  FLYBALL_CHECK(add("reference_", loop.reference, referred(plant, loop)));
  FLYBALL_CHECK(add("", record.x, plant.states));
  FLYBALL_CHECK(add("output_", record.y, plant.outputs));
  FLYBALL_CHECK(add("measured_", record.measured, plant.outputs));
  FLYBALL_CHECK(add("estimated_", record.x_hat, plant.states));
  FLYBALL_CHECK(add("commanded_", record.commanded, plant.inputs));
  FLYBALL_CHECK(add("applied_", record.applied, plant.inputs));
  return series;
}

std::vector<TrackingError> tracking_of(const Record& record, const ModelDescription& plant,
                                       const ClosedLoop& loop) {
  const MatrixXd& truth = loop.reference_of == ReferenceOf::states ? record.x : record.y;
  std::vector<TrackingError> all(static_cast<std::size_t>(loop.reference.rows()));
  for (std::size_t i = 0; i < all.size(); ++i) {
    double squares = 0.0;
    for (Index k = 0; k < loop.reference.cols(); ++k) {
      double error = loop.reference(static_cast<Index>(i), k) - truth(static_cast<Index>(i), k);
      if (referred(plant, loop)[i].is_angle) {
        error = angle_difference(error, 0.0);
      }
      squares += error * error;
      all[i].max = std::max(all[i].max, std::abs(error));
      all[i].final = error;
    }
    all[i].rms = std::sqrt(squares / static_cast<double>(loop.reference.cols()));
  }
  return all;
}

}  // namespace

Expected<ClosedLoopResult> simulate_closed_loop(SimulatedPlant& plant, ControlLaw controller,
                                                const ClosedLoop& loop) {
  const ModelDescription& description = plant.description();
  FLYBALL_CHECK(check_loop(description, loop));
  const double T = loop.period.si();
  const auto records =
      static_cast<long long>(std::clamp(std::ceil(T / loop.record_step.si()), 1.0, 1e4));
  const double h = T / static_cast<double>(records);
  Random random(loop.seed);
  std::vector<Sensor> sensors;
  for (const SensorModel& model : loop.sensors) {
    FLYBALL_TRY(auto sensor, Sensor::create(model, Time(h), random.split()));
    sensors.push_back(std::move(sensor));
  }
  Actuators actuators(loop.actuators, size_of(description.inputs), random);

  VectorXd y(size_of(description.outputs));
  const auto measure = [&] {
    plant.output(actuators.applied(), y);
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      sensors[i].record(y(static_cast<Index>(i)));
    }
  };

  const Index periods = loop.reference.cols();
  Record record(description, periods);
  ClosedLoopResult result;
  result.inputs.resize(description.inputs.size());
  VectorXd saturated = VectorXd::Zero(size_of(description.inputs));
  const auto advance = [&](double time, double duration) {
    for (std::size_t i = 0; i < result.inputs.size(); ++i) {
      const double size = std::abs(actuators.applied()(static_cast<Index>(i)));
      result.inputs[i].peak = std::max(result.inputs[i].peak, size);
    }
    return plant.advance(time, actuators.applied(), duration);
  };

  measure();
  VectorXd measured(y.size());
  for (Index k = 0; k < periods; ++k) {
    const double time = static_cast<double>(k) * T;
    plant.output(actuators.applied(), y);
    FLYBALL_CHECK(detail::check_answer("output", description.outputs, y, plant.state(),
                                       actuators.applied(), in_simulate_closed_loop, time));
    measured = y;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      measured(static_cast<Index>(i)) = sensors[i].read();
    }
    const VectorXd r = loop.reference.col(k);
    const VectorXd r_next = loop.reference.col(std::min(k + 1, periods - 1));
    const LoopCommand command =
        controller({time, static_cast<std::size_t>(k), measured, r, r_next, plant.state()});
    FLYBALL_CHECK(check_command(command, description, time));

    record.x.col(k) = plant.state();
    record.y.col(k) = y;
    record.measured.col(k) = measured;
    record.commanded.col(k) = command.u;
    record.applied.col(k) = actuators.applied();
    if (command.x_hat.size() > 0) {
      if (record.x_hat.cols() == 0) {
        record.x_hat.setConstant(command.x_hat.size(), periods,
                                 std::numeric_limits<double>::quiet_NaN());
      }
      record.x_hat.col(k) = command.x_hat;
    }
    for (Index i = 0; i < command.u.size(); ++i) {
      saturated(i) += actuators.saturates(i, command.u(i)) ? 1.0 : 0.0;
    }
    actuators.send(time, command.u);

    for (long long i = 0; i < records; ++i) {
      const double from = time + static_cast<double>(i) * h;
      double done = 0.0;
      constexpr double rounding = 1e-12;
      for (double change = actuators.next_change(); change < from + h - rounding;
           change = actuators.next_change()) {
        const double until = std::clamp(change - from, done, h);
        if (until - done > rounding) {  // else it is at the end of a step, up to rounding
          FLYBALL_CHECK(advance(from + done, until - done));
          done = until;
        }
        actuators.change(change);
      }
      FLYBALL_CHECK(advance(from + done, h - done));
      measure();
    }
  }
  for (std::size_t i = 0; i < result.inputs.size(); ++i) {
    result.inputs[i].saturated_fraction =
        saturated(static_cast<Index>(i)) / static_cast<double>(periods);
  }
  result.tracking = tracking_of(record, description, loop);
  FLYBALL_TRY(auto series, series_of(record, description, loop));
  result.series = std::move(series);
  return result;
}

}  // namespace flyball
