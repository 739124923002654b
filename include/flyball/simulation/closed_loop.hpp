#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/core/function_ref.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/simulation/plant.hpp>
#include <flyball/simulation/sensor.hpp>

namespace flyball {

/// What is between a command and a plant's input; the defaults make a perfect actuator.
struct ActuatorModel {
  double min = -std::numeric_limits<double>::infinity();  ///< In the input's unit.
  double max = std::numeric_limits<double>::infinity();
  Time delay{};        ///< From the sample to the change of the input, s.
  double noise = 0.0;  ///< Standard deviation of what is added for a period, after the limits.
};

/// What a controller is given at a sample.
struct LoopSample {
  double time = 0.0;              ///< s
  std::size_t index = 0;          ///< Periods since the start.
  const Eigen::VectorXd& y;       ///< p x 1, the outputs as the sensors read them.
  const Eigen::VectorXd& r;       ///< The reference now.
  const Eigen::VectorXd& r_next;  ///< One period later; the last one stays.
  const Eigen::VectorXd& x;       ///< n x 1, the truth, for feedback of the state itself.
};

/// What a controller answers: its inputs to the plant and, for the record, its estimate.
struct LoopCommand {
  /// @param inputs  m x 1. @param estimate  n x 1, or empty for none.
  template <class Derived>
  // NOLINTNEXTLINE(google-explicit-constructor): an answer is the inputs.
  LoopCommand(const Eigen::MatrixBase<Derived>& inputs, Eigen::VectorXd estimate = {})
      : u(inputs), x_hat(std::move(estimate)) {}

  Eigen::VectorXd u;      ///< m x 1.
  Eigen::VectorXd x_hat;  ///< n x 1, or empty for none.
};

/// A controller, once a period: anything that can be called, such as
/// `[&](const LoopSample& s) -> LoopCommand { return {K * (s.r - s.x)}; }`.
using ControlLaw = FunctionRef<LoopCommand(const LoopSample&)>;

/// What a reference's rows are references of, for the errors that a result states.
enum class ReferenceOf { states, outputs };

/// How a loop is closed.
struct ClosedLoop {
  Time period{};
  /// One column a period, as many as are simulated; its rows are the states' or the outputs'
  /// references, or there are none.
  Eigen::MatrixXd reference{};
  ReferenceOf reference_of = ReferenceOf::states;
  std::vector<SensorModel> sensors{};  ///< Of the first outputs; the others are read as they are.
  std::vector<ActuatorModel> actuators{};  ///< Of the first inputs; the others are perfect.
  /// s; truths are recorded at least that often, for sensors between samples, and the plant moves
  /// on in pieces of at most that.
  Time record_step{1e-3};
  std::uint64_t seed = 1;
};

/// How well a row of the reference was followed, in its unit, over all samples.
struct TrackingError {
  double rms = 0.0;
  double max = 0.0;    ///< Largest magnitude.
  double final = 0.0;  ///< Reference less truth at the last sample.
};

/// How an input was used.
struct InputUse {
  double peak = 0.0;                ///< Largest magnitude that was applied, in its unit.
  double saturated_fraction = 0.0;  ///< Share of the samples that asked for the limit or more.
};

/// What a closed loop did.
struct ClosedLoopResult {
  /// One row a period; columns, with the plant's units: "reference_NAME" of each row, each state,
  /// "output_NAME", "measured_NAME" of each output, "estimated_NAME" of each state if the
  /// controller told it, "commanded_NAME" (asked for) and "applied_NAME" (at the sample, which with
  /// a delay is still an earlier command) of each input.
  TimeSeries series{};
  std::vector<TrackingError> tracking{};  ///< One a row of the reference.
  std::vector<InputUse> inputs{};         ///< One an input.
};

/// Closes a sampled loop around a plant.
///
/// At each sample the sensors are read, the controller answers, and each input changes to its
/// answer, limited, after its delay, until when the earlier one is held; before the first it is
/// zero. Deterministic: the same loop gives the same numbers.
///
/// @param plant       Where it is; it is left where the simulation ends.
/// @param controller  Called once a period, in order.
/// @errors ArgumentError for a reference, sensors or actuators that do not fit the plant;
/// not_finite
///         and wrong_shape for an answer of the controller, naming input and time; what the plant
///         says.
/// Cost: that of the plant's steps, of which there are at least period/record_step a period.
[[nodiscard]] Expected<ClosedLoopResult> simulate_closed_loop(SimulatedPlant& plant,
                                                              ControlLaw controller,
                                                              const ClosedLoop& loop);

}  // namespace flyball
