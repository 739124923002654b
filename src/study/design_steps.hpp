#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/control/margins.hpp>
#include <flyball/control/running_loop.hpp>
#include <flyball/study/design.hpp>

/// The steps of a design, in the order in which `design` takes them.
namespace flyball::study {

/// The continuous linear model: Theorems 6.9.1, 6.10.1, 6.11.1, or 14.3.2 when kA is not known.
struct LinearModel {
  Eigen::MatrixXd A, B, C;    ///< Continuous.
  DiscreteSystem<> discrete;  ///< Zero-order hold.
  std::vector<Coordinate> states;
};
[[nodiscard]] Expected<LinearModel> linear_model(const PlantDescription& plant, double period);

/// What is done without kA.
[[nodiscard]] Diagnostic unknown_kA(const PlantDescription& plant);

/// A mechanism that may be the true one.
struct PossiblePlant {
  double kA = 0.0;  ///< V·s²/unit
  ContinuousSystem<> system;
};
/// The model's own; without kA those from none (the model) to the upper bound.
[[nodiscard]] Expected<std::vector<PossiblePlant>> possible_plants(const LinearModel& model,
                                                                   const PlantDescription& plant);

/// Standard deviation of one reading: as given, or what the resolution and the mechanism suggest.
[[nodiscard]] double measurement_std(const DesignJob& job);

/// Largest acceptable errors to begin with when the person named none.
[[nodiscard]] std::vector<double> default_tolerances(const PlantDescription& plant,
                                                     std::size_t states);

/// Feedback, observer and margins for one choice of tolerances.
struct LoopDesign {
  std::vector<double> tolerances;
  Eigen::MatrixXd Q, R, K, K_delayed, kalman_gain, inversion;
  bool predicts = false;  ///< The delay is predicted over; K_delayed is K.
  /// As it runs: of the model, or where it predicts with the inputs on their way as states.
  PredictingRegulator regulator;
  Eigen::VectorXcd poles, estimator_poles;
  StabilityMargins margins;  ///< The worst over the possible plants.
  std::vector<RobustnessPoint> robustness;
  bool stable = false;           ///< Whether the loop on the model is.
  bool robust = true;            ///< Whether all points are stable.
  double worst_overshoot = 0.0;  ///< Of them.
  bool whole_periods = false;    ///< The delay had to be rounded to whole periods.
};
/// Whether the job's loop predicts over its delay; over none there is nothing to predict.
[[nodiscard]] bool predicts_delay(const DesignJob& job);

/// Feedback, its delay compensated or predicted over, and observer, not judged.
[[nodiscard]] Expected<LoopDesign> feedback_of(const LinearModel& model, const DesignJob& job,
                                               const std::vector<double>& tolerances);
/// The whole.
[[nodiscard]] Expected<LoopDesign> design_loop(const LinearModel& model, const DesignJob& job,
                                               const std::vector<double>& tolerances);

/// "0.02 for position (m), 0.4 for velocity (m/s)"
[[nodiscard]] std::string tolerances_text(const LinearModel& model,
                                          const std::vector<double>& tolerances);

/// Gain margins of at least 2, phase margin of at least 45°, a disk margin of at least 0.5, and
/// stable over the whole grid; a loop that predicts also overshoots by a quarter at most in it.
[[nodiscard]] bool is_comfortable(const LoopDesign& loop);

/// Of the tolerances that leave comfortable margins those of the stiffest loop.
[[nodiscard]] Expected<LoopDesign> search_tolerances(const LinearModel& model, const DesignJob& job,
                                                     std::vector<double>& tolerances);

/// The poles and the step of the loop as it runs.
[[nodiscard]] Expected<LoopBehavior> behavior_of(const LoopDesign& loop, const LinearModel& model,
                                                 const DesignJob& job);

/// The loop opened at the plant input, on the model, from a thousandth of Nyquist's frequency to
/// it.
[[nodiscard]] Expected<std::vector<FrequencyPoint>> frequency_response(const LoopDesign& loop,
                                                                       const LinearModel& model,
                                                                       const DesignJob& job);

/// Warns where the delay costs more than half of the loop's speed, by its slowest eigenvalue or its
/// step, or all of its feedback, and tells what would be faster.
[[nodiscard]] Expected<void> tell_cost_of_delay(const LoopDesign& loop, const LoopBehavior& runs,
                                                bool feedback, const LinearModel& model,
                                                const DesignJob& job, bool chosen,
                                                std::vector<Diagnostic>& diagnostics);

/// Proofs for all mechanisms that the grid is a sample of and, of identified gains, for their 95 %
/// set.
[[nodiscard]] Expected<std::vector<PlantProof>> proofs_of(const LoopDesign& loop,
                                                          const DesignJob& job);

/// Why the gain makes no difference anywhere below Nyquist; empty where it does.
[[nodiscard]] Expected<std::string> why_no_feedback(const LoopDesign& loop,
                                                    const LinearModel& model, const DesignJob& job);

/// The fastest trapezoid over a distance that needs no more volts than there are.
[[nodiscard]] Expected<FastestMotion> fastest_motion(const DesignJob& job);

/// Of the loops that run on motor controllers (SPARK, Phoenix 6), s.
inline constexpr double on_board_period = 1e-3;

/// Gains for those loops: of the stiffest LQR gain of that period, compensated for the job's delay,
/// with which a PID on the sensor's value keeps a gain margin of 2, a phase margin of 45° and stays
/// stable over ±20 % of inertia and gain. None without a kA, since what happens within a
/// millisecond hangs on it, where the job's own period is no longer, or where no gain keeps those
/// margins.
[[nodiscard]] std::vector<PasteGains> on_board_gains(const DesignJob& job);

/// The gains in the units of other tools.
[[nodiscard]] std::vector<PasteGains> paste_gains(const PlantDescription& plant,
                                                  const Eigen::MatrixXd& K);

}  // namespace flyball::study
