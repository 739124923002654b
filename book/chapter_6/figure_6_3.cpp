#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.3: an elevator is sent up by five feet and down again (section 6.9.4). Gravity is not
/// part of the linear model; a constant voltage holds it (6.9.3).
FigureResult figure_6_3() {
  // Theorem 6.9.1: x = [position, velocity], u = voltage.
  const auto elevator = mechanisms::elevator({.motor = mechanisms::cim(2),
                                              .gearing = 42.0 / 12.0 * 40.0 / 14.0,
                                              .mass = 6.803886_kg,
                                              .drum_radius = 0.02762679089_m})
                            .value();
  // Theorem 7.3.1: the controller runs each 5 ms and holds its voltage between.
  const Time period = 5_ms;
  const auto plant = discretize(elevator, period).value();

  // Theorem 7.7.1 with Bryson's rule: errors of 2 cm and 0.4 m/s are worth 12 V.
  const auto regulator = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();

  // Theorem 9.6.3 at steady state: how far the model drifts, and how well the encoder measures.
  // The book gives these as continuous noise, so that they are discretised, too (7.8, 7.9).
  const auto model_noise = standard_deviations({0.05, 1.0}).value();
  const auto encoder_noise = standard_deviations({0.0001}).value();
  const auto estimator =
      kalman_gain(plant, discretize(elevator.A, ProcessDensity{model_noise}, period),
                  discretize(MeasurementDensity{encoder_noise}, period))
          .value();

  // Theorem 7.8.1: the voltage that would take the plant from one reference to the next.
  const auto inversion = linear_plant_inversion(plant).value();

  const Eigen::MatrixXd r = pulse_reference(1.524, 2, period);
  const auto loop = simulate_linear({.plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                                     .K = regulator.K,
                                     .K_e = estimator.K,
                                     .plant_inversion = true,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(2)},
                                    r)
                        .value();

  FigureResult figure{.id = "6.3", .title = "Elevator response"};
  figure.columns = {{"time", "s", values(loop.time)},
                    {"reference_position", "m", values(r.row(0))},
                    {"position", "m", values(loop.x_hat.row(0))},
                    {"reference_velocity", "m/s", values(r.row(1))},
                    {"velocity", "m/s", values(loop.x_hat.row(1))},
                    {"voltage", "V", values(loop.u.row(0))}};
  figure.numbers = {{"K_p", "V/m", regulator.K(0)},
                    {"K_d", "V/(m/s)", regulator.K(1)},
                    {"K_e_1", "", estimator.K(0)},
                    {"K_e_2", "1/s", estimator.K(1)},
                    {"B_pinv_1", "V/m", inversion.B_pinv()(0)},
                    {"B_pinv_2", "V/(m/s)", inversion.B_pinv()(1)}};
  figure.picture = response_plot(figure, {{"Position (m)", "position"},
                                          {"Velocity (m/s)", "velocity"},
                                          {"Voltage (V)", "voltage", "Input"}});
  return figure;
}

}  // namespace flyball::book
