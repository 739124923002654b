#pragma once

#include <string>
#include <vector>

#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>

#include "book/drawing.hpp"

/// The mechanisms of several figures, and the loop that sections 6.9.4, 6.10.3 and 6.11.4 close
/// around one.
namespace flyball::book {

/// Theorem 6.9.1 with two CIM motors on a 42:12 and a 40:14 reduction.
[[nodiscard]] mechanisms::Elevator case_study_elevator();

/// Theorem 6.10.1 with a 775pro motor; the 12:18 gear makes the wheel faster than its motor.
[[nodiscard]] mechanisms::Flywheel case_study_flywheel();

/// A mechanism's linear model, sized at run time.
template <int States>
[[nodiscard]] ContinuousSystem<> model_of(const mechanisms::Mechanism<States>& mechanism) {
  return {mechanism.A, mechanism.B, mechanism.C, mechanism.D};
}

/// A mechanism, and what its controller is designed for.
struct MechanismCaseStudy {
  std::string id;
  std::string title;
  ContinuousSystem<> model;
  std::vector<StateLabel> states;
  std::vector<double> tolerances;   ///< Errors of the states that are worth 12 V.
  std::vector<double> model_noise;  ///< How far the model drifts: σ of each state, continuous.
  double encoder_noise = 0.0;       ///< How well the encoder measures: σ, continuous.
};

/// LQR, Kalman filter at steady state and plant inversion, each 5 ms, within 12 V.
/// @param r  states x samples, the references.
[[nodiscard]] FigureResult mechanism_case_study(const MechanismCaseStudy& study,
                                                const Eigen::MatrixXd& r);

}  // namespace flyball::book
