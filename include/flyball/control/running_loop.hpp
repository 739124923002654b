#pragma once

#include <vector>

#include <flyball/control/response_metrics.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// A regulator's loop as it runs: the plant, what is on its way through the delay, the observer and
/// the feedback. Limits are not in it.
struct RunningLoop {
  /// From an input that is added to the regulator's, u = -K x_hat + v, to the plant's outputs at
  /// the samples. The delay is the sensor's; in the actuator it acts alike, and outputs are later
  /// by it.
  DiscreteSystem<> system;
  Eigen::VectorXcd poles;      ///< Of the whole loop, slowest first.
  double time_constant = 0.0;  ///< s, of the slowest pole, -T/ln|z|; infinite if it does not decay.
};

/// Closes the loop of a regulator with a delay from the sample to the plant.
///
/// @param plant  The true plant, continuous. @param model  What the observer believes, discrete.
/// @param K  inputs x model states. @param K_e  Filter form, model states x outputs; empty for
/// feedback of the plant's states themselves.
/// @param delay  s, at most 250 periods; it need not be whole periods.
/// @errors ArgumentError for shapes, entries, period, delay, and a feedthrough where there is an
/// observer; those of `expm`.
[[nodiscard]] Expected<RunningLoop> running_loop(const ContinuousSystem<>& plant,
                                                 const DiscreteSystem<>& model, const MatrixRef& K,
                                                 const MatrixRef& K_e, Time delay);

/// What a loop does when its reference steps.
struct LoopStep {
  double final_value = 0.0;      ///< Where the output ends, of a step of one.
  ResponseMetrics metrics{};     ///< Against that final value, sampled each period.
  std::vector<double> time{};    ///< s, from the step on, each period.
  std::vector<double> values{};  ///< Of the output, as many.
};

/// The small-signal step of a loop's first output, until what is left of it is below 1e-9, for at
/// most 20 000 periods.
/// @param F  inputs x 1, what a step of one adds to the input, such as K r + B⁺ (I - A) r.
/// @errors ArgumentError for F, out_of_range for a loop that is not stable; those of
/// `response_metrics` where the step leads nowhere.
[[nodiscard]] Expected<LoopStep> step_of(const RunningLoop& loop, const MatrixRef& F);

/// A regulator that knows the inputs on their way: `regulator` with them as further states, so that
/// it acts on where the plant will be when its input arrives. With a true model the loop has the
/// poles that it has without delay, and poles at 0.
struct PredictingRegulator {
  DiscreteSystem<> model;  ///< [x; u_{k-1}; …], see `discretize_with_input_delay`.
  Eigen::MatrixXd K;       ///< K [Φ Γ], where Φ x + Γ u_before is the state after the delay.
  Eigen::MatrixXd K_e;     ///< [K_e; 0]: the inputs are known.
};

/// @param plant  The model, continuous. @param K, K_e  Designed for no delay. @param delay  s.
/// @errors As `discretize_with_input_delay`; ArgumentError for the shapes of K and K_e.
/// Source: Åström and Wittenmark, "Computer-Controlled Systems", 3rd ed., section 4.5.
[[nodiscard]] Expected<PredictingRegulator> predicting_regulator(const ContinuousSystem<>& plant,
                                                                 Time period, const MatrixRef& K,
                                                                 const MatrixRef& K_e, Time delay);

}  // namespace flyball
