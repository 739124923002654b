#pragma once

#include <optional>
#include <vector>

#include <flyball/control/margins.hpp>
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
[[nodiscard]] Diagnostic unknown_kA(mechanisms::MechanismKind kind);

/// Standard deviation of one reading: as given, or what the resolution and the mechanism suggest.
[[nodiscard]] double measurement_std(const DesignJob& job);

/// Largest acceptable errors to begin with when the person named none.
[[nodiscard]] std::vector<double> default_tolerances(const PlantDescription& plant,
                                                     std::size_t states);

/// Feedback, observer and margins for one choice of tolerances.
struct LoopDesign {
  Eigen::MatrixXd Q, R, K, K_delayed, kalman_gain, inversion;
  Eigen::VectorXcd poles, estimator_poles;
  StabilityMargins margins;
  RobustnessGrid robustness;
  bool whole_periods = false;  ///< The delay had to be rounded to whole periods.
};
[[nodiscard]] Expected<LoopDesign> design_loop(const LinearModel& model, const DesignJob& job,
                                               const std::vector<double>& tolerances);

/// Gain margins of at least 2, phase margin of at least 45°, a disk margin of at least 0.5, and
/// stable over the whole grid.
[[nodiscard]] bool is_comfortable(const LoopDesign& loop);

/// The fastest trapezoid over a distance that needs no more volts than there are.
[[nodiscard]] Expected<FastestMotion> fastest_motion(const DesignJob& job);

/// The gains in the units of other tools.
[[nodiscard]] std::vector<PasteGains> paste_gains(const PlantDescription& plant,
                                                  const Eigen::MatrixXd& K);

}  // namespace flyball::study
