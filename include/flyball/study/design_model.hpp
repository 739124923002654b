#pragma once

#include <flyball/control/margins.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/study/frequency_points.hpp>
#include <flyball/study/model_job.hpp>
#include <flyball/systems/equilibrium.hpp>

namespace flyball::study {

/// Where a model is linearised and held.
struct OperatingPoint {
  Eigen::VectorXd x, u;
  Eigen::VectorXd derivative;                 ///< f(x, u), n x 1.
  bool is_equilibrium = false;                ///< Whether that is nothing.
  std::optional<ModelEquilibrium> nearest{};  ///< An equilibrium near it, if it is none itself.
};

/// A job's point: as written or, where the job says so, the equilibrium near it.
/// @errors As `check_model` and, where it is asked for, `find_equilibrium`.
[[nodiscard]] Expected<OperatingPoint> operating_point(const ModelJob& job);

/// "not an equilibrium: omega changes by 3 rad/s²; near it is one at theta = 0 rad, …".
[[nodiscard]] std::string describe(const OperatingPoint& point, const ModelDescription& model);

/// The regulator of a model about a point.
struct ModelRegulator {
  OperatingPoint point;
  ContinuousSystem<> linear;      ///< Of small deviations, exact.
  DiscreteSystem<> plant;         ///< Zero-order hold.
  Eigen::MatrixXd Q, R;           ///< Weights (Bryson).
  Eigen::MatrixXd K;              ///< u = u* + K (r - x).
  Eigen::MatrixXd K_delayed;      ///< With the delay compensated (B.12); what is used.
  Eigen::VectorXcd poles{};       ///< Of A - B K: of the design, which knows no delay.
  Eigen::VectorXcd loop_poles{};  ///< Of the loop as it runs, with observer and delay, slowest
                                  ///< first; empty where they cannot be told.
  double time_constant = 0.0;     ///< s, of the slowest; infinite if the loop is not stable.
  bool observer = false;          ///< Whether the outputs are not the states.
  Eigen::MatrixXd kalman_gain{};  ///< Filter form (9.22), if there is an observer.
  Eigen::VectorXcd estimator_poles{};
  std::optional<StabilityMargins> margins{};  ///< Of a single input.
  /// Of the loop opened at each input in turn, with observer and delay, up to Nyquist's frequency;
  /// empty where there is no picture of it.
  std::vector<std::vector<FrequencyPoint>> frequency_responses{};
  std::vector<Diagnostic> diagnostics{};
};

/// Linearises, discretises, and designs LQR with Bryson's rule and, where the outputs are not the
/// states, a Kalman filter.
/// @errors ArgumentError for a point that is no equilibrium, for a model without input;
///         RiccatiError where there is no controller. With what was noticed before.
[[nodiscard]] ExpectedAll<ModelRegulator> regulate(const ModelJob& job);

}  // namespace flyball::study
