#pragma once

#include <optional>

#include <flyball/systems/system.hpp>

namespace flyball {

/// What limits make of a feedback at one error.
struct SaturationAnalysis {
  Eigen::VectorXd u;          ///< m, K e + u_ff: what the controller asks for.
  Eigen::VectorXd u_limited;  ///< m, what the actuators give.
  /// m, k_max/k of section 3.2: the factor by which each input's feedback is in effect reduced; 1
  /// where it is not limited. Zero where the feedforward alone is at the limit; negative where the
  /// limit turns the feedback around.
  Eigen::VectorXd gain_fraction;
  Eigen::MatrixXd effective_K;  ///< m x n, diag(gain_fraction) K.
  /// n, the largest error of each state alone (the others zero) that no input's limit cuts, of
  /// either sign; infinite where the feedback does not use that state.
  Eigen::VectorXd largest_error;
};

/// Actuator saturation of u = K e + u_ff within u_min … u_max: while it lasts, the controller acts
/// as one with a smaller gain, k_max (r - x) = u_max.
/// @param K  m x n. @param error  r - x, n x 1. @param u_min, u_max  m x 1, may be infinite,
/// u_min < u_max. @param u_ff  m x 1.
/// @errors ArgumentError for shapes, entries and limits.
/// Source: book, section 3.2.
[[nodiscard]] Expected<SaturationAnalysis> analyze_saturation(const MatrixRef& K,
                                                              const Eigen::VectorXd& error,
                                                              const Eigen::VectorXd& u_min,
                                                              const Eigen::VectorXd& u_max,
                                                              const Eigen::VectorXd& u_ff);

/// How long limits hold up the way to a reference.
struct SaturatedStep {
  double saturated_time = 0.0;  ///< s, during which an input is at its limit.
  double last_saturated = 0.0;  ///< s, after which none is any more.
  /// s until every state is within 2 % of its step of the reference for good; nothing if not within
  /// the time simulated.
  std::optional<double> settling_time;
  /// The same without limits: what the linear design promises.
  std::optional<double> linear_settling_time;
  /// m, the input that holds the reference (least squares); beyond the limits it cannot be held.
  Eigen::VectorXd holding_input;
  bool reference_can_be_held = false;
};

/// Simulates u = clamp(K (r - x) + u_ss) from x = 0, u_ss the holding input, for `steps` periods.
/// @param plant  Discrete. @param K  m x n. @param r  n x 1. @param steps  1 … 10⁷.
/// @errors ArgumentError for shapes, entries and limits.
/// Source: book, section 3.2.
[[nodiscard]] Expected<SaturatedStep> saturation_of_step(const DiscreteSystem<>& plant,
                                                         const MatrixRef& K,
                                                         const Eigen::VectorXd& r,
                                                         const Eigen::VectorXd& u_min,
                                                         const Eigen::VectorXd& u_max, int steps);

}  // namespace flyball
