#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/simulation/linear_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

mechanisms::Elevator case_study_elevator() {
  return mechanisms::elevator({.motor = mechanisms::cim(2),
                               .gearing = 42.0 / 12.0 * 40.0 / 14.0,
                               .mass = 6.803886_kg,
                               .drum_radius = 0.02762679089_m})
      .value();
}

mechanisms::Flywheel case_study_flywheel() {
  return mechanisms::flywheel({.motor = mechanisms::vex_775pro(),
                               .gearing = 12.0 / 18.0,
                               .moment_of_inertia = 0.00032_kg_m2})
      .value();
}

FigureResult mechanism_case_study(const MechanismCaseStudy& study, const Eigen::MatrixXd& r) {
  // Theorem 7.3.1: the controller runs each 5 ms and holds its voltage between.
  const Time period = 5_ms;
  const auto plant = discretize(study.model, period).value();

  // Theorem 7.7.1 with Bryson's rule.
  const auto regulator = lqr(plant, bryson(study.tolerances), bryson({12.0})).value();

  // Theorem 9.6.3 at steady state. The book gives the noises as continuous ones, so that they are
  // discretised, too (7.8, 7.9).
  const auto model_noise = standard_deviations(study.model_noise).value();
  const auto encoder_noise = standard_deviations({study.encoder_noise}).value();
  const auto estimator =
      kalman_gain(plant, discretize(study.model.A, ProcessDensity{model_noise}, period),
                  discretize(MeasurementDensity{encoder_noise}, period))
          .value();

  // Theorem 7.8.1: the voltage that would take the plant from one reference to the next.
  const auto inversion = linear_plant_inversion(plant).value();

  const auto loop = simulate_linear({.plant = plant,
                                     .K = regulator.K,
                                     .K_e = estimator.K,
                                     .plant_inversion = true,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(plant.A.rows())},
                                    r)
                        .value();

  FigureResult figure{.id = study.id, .title = study.title};
  figure.columns = {{"time", "s", values(loop.time)}};
  auto panels = add_states(figure, study.states, r, loop.x_hat);
  figure.columns.push_back({"voltage", "V", values(loop.u.row(0))});
  panels.push_back({"Voltage (V)", "voltage", "Input"});
  figure.picture = response_plot(figure, panels);

  const auto count = study.states.size();
  const auto index = [&](std::size_t i) { return count == 1 ? "" : "_" + std::to_string(i + 1); };
  for (std::size_t i = 0; i < count; ++i) {
    figure.numbers.push_back({gain_name(study.states, i), gain_unit(study.states[i]),
                              regulator.K(static_cast<Eigen::Index>(i))});
  }
  for (std::size_t i = 0; i < count; ++i) {
    figure.numbers.push_back(
        {"K_e" + index(i), i == 0 ? "" : "1/s", estimator.K(static_cast<Eigen::Index>(i))});
  }
  for (std::size_t i = 0; i < count; ++i) {
    figure.numbers.push_back({"B_pinv" + index(i), gain_unit(study.states[i]),
                              inversion.B_pinv()(static_cast<Eigen::Index>(i))});
  }
  return figure;
}

}  // namespace flyball::book
