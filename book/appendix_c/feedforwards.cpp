#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/steady_state_feedforward.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/motor_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

/// The motor at 10 kHz, its regulator, and the feedforwards of the constant reference.
struct Study {
  DiscreteSystem<2, 1, 1> plant = discretize(case_study_motor(), 0.1_ms).value();
  Eigen::MatrixXd Q = bryson({20.0, 40.0}).value();
  Eigen::MatrixXd R = bryson({12.0}).value();
  Eigen::RowVector2d K = lqr(plant, Q, R).value().K;
  Eigen::Vector2d r = case_study_reference();

  /// (BᵀQB + R)⁻¹BᵀQ (r - A r) (Theorem C.1.1).
  [[nodiscard]] double weighted(const Eigen::MatrixXd& effort) const {
    return qr_weighted_inversion(plant, Q, effort).value().calculate(r, r)(0);
  }
  [[nodiscard]] double inverted() const {
    return linear_plant_inversion(plant).value().calculate(r, r)(0);
  }
  /// N_u N_x⁺ r (Theorem C.2.1): of r = (ω, 0) what a constant input can hold.
  [[nodiscard]] double steady_state() const {
    return steady_state_feedforward(plant).value().calculate(r)(0);
  }
  [[nodiscard]] FigureResult figure(std::string id, std::string title,
                                    std::vector<CaseStudy> controllers) const {
    FigureResult result = case_study(std::move(id), std::move(title), plant, controllers);
    result.numbers = {{"K_1", "V/(rad/s)", K(0)}, {"K_2", "V/A", K(1)}};
    for (const CaseStudy& controller : controllers) {
      if (controller.u_ff != 0.0) {
        result.numbers.push_back({"u_ff_" + controller.name, "V", controller.u_ff});
      }
    }
    return result;
  }
};

}  // namespace

/// Figure C.1: plant inversion that weighs its effort does not reach the reference (section C.1).
FigureResult figure_C_1() {
  const Study study;
  FigureResult figure = study.figure(
      "C.1", "Second-order CIM motor response with plant inversion, weighted and not",
      {{"plant_inversion", "Plant inversion", study.K, study.inverted()},
       {"qr_weighted", "Plant inversion (Q and R cost)", study.K, study.weighted(study.R)}});
  const Eigen::MatrixXd K_ff = qr_weighted_gain(study.plant.B, study.Q, study.R).value();
  figure.numbers.push_back({"K_ff_1_qr_weighted", "V/(rad/s)", K_ff(0)});
  figure.numbers.push_back({"K_ff_2_qr_weighted", "V/A", K_ff(1)});
  return figure;
}

/// Figure C.2: none, steady-state and QR-weighted feedforward (section C.2).
FigureResult figure_C_2() {
  const Study study;
  return study.figure(
      "C.2", "Second-order CIM motor response with various feedforwards",
      {{"no_feedforward", "No feedforward", study.K, 0.0},
       {"steady_state", "Steady-state feedforward", study.K, study.steady_state()},
       {"qr_weighted", "Plant inversion (Q and R cost)", study.K, study.weighted(study.R)}});
}

/// Figure C.3: the effort's weight left out, plant inversion reaches the reference.
FigureResult figure_C_3() {
  const Study study;
  return study.figure(
      "C.3", "Second-order CIM motor response with plant inversions",
      {{"qr_weighted", "Plant inversion (Q and R cost)", study.K, study.weighted(study.R)},
       {"q_weighted", "Plant inversion (Q cost only)", study.K,
        study.weighted(Eigen::MatrixXd::Zero(1, 1))}});
}

}  // namespace flyball::book
