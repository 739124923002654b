#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.5: a flywheel is spun up to 9000 rpm and stopped again (section 6.10.3).
FigureResult figure_6_5() {
  // Theorem 6.10.1: x = angular velocity, u = voltage. The 12:18 gear makes the wheel faster than
  // its motor.
  const auto flywheel = mechanisms::flywheel({.motor = mechanisms::vex_775pro(),
                                              .gearing = 12.0 / 18.0,
                                              .moment_of_inertia = 0.00032_kg_m2})
                            .value();
  const Time period = 5_ms;
  const auto plant = discretize(flywheel, period).value();

  // An error of 9.42 rad/s (90 rpm) is worth 12 V.
  const auto regulator = lqr(plant, bryson({9.42}), bryson({12.0})).value();

  const auto model_noise = standard_deviations({1.0}).value();
  const auto encoder_noise = standard_deviations({0.01}).value();
  const auto estimator =
      kalman_gain(plant, discretize(flywheel.A, ProcessDensity{model_noise}, period),
                  discretize(MeasurementDensity{encoder_noise}, period))
          .value();

  const auto inversion = linear_plant_inversion(plant).value();

  const AngularVelocity speed = 9000_rpm;
  const Eigen::MatrixXd r = pulse_reference(speed.si(), 1, period);
  const auto loop = simulate_linear({.plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                                     .K = regulator.K,
                                     .K_e = estimator.K,
                                     .plant_inversion = true,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(1)},
                                    r)
                        .value();

  FigureResult figure{.id = "6.5", .title = "Flywheel response"};
  figure.columns = {{"time", "s", values(loop.time)},
                    {"reference_velocity", "rad/s", values(r.row(0))},
                    {"velocity", "rad/s", values(loop.x_hat.row(0))},
                    {"voltage", "V", values(loop.u.row(0))}};
  figure.numbers = {{"K", "V/(rad/s)", regulator.K(0)},
                    {"K_e", "", estimator.K(0)},
                    {"B_pinv", "V/(rad/s)", inversion.B_pinv()(0)}};
  figure.picture = response_plot(
      figure, {{"Angular velocity (rad/s)", "velocity"}, {"Voltage (V)", "voltage", "Input"}});
  return figure;
}

}  // namespace flyball::book
