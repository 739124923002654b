#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/planning/generate_trapezoid_profile.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.9: a single-jointed arm follows a trapezoid profile to 1.04 rad (section 6.11.4). The
/// figure leaves gravity out; its feedforward is 6.11.3.
FigureResult figure_6_9() {
  // Theorem 6.11.1: x = [angle, angular velocity], u = voltage. The arm is a uniform rod that turns
  // about its end, J = m l²/3.
  const Mass mass = 2.2675_kg;
  const Length length = 1.2192_m;
  const auto arm = mechanisms::arm({.motor = mechanisms::cim(),
                                    .gearing = 1.0 / 2.0,
                                    .moment_of_inertia = MomentOfInertia(mass.si() * length.si() *
                                                                         length.si() / 3.0),
                                    .mass = mass,
                                    .center_of_mass = Length(length.si() / 2.0)})
                       .value();
  const Time period = 5_ms;
  const auto plant = discretize(arm, period).value();

  // Errors of 1° and 5°/s are worth 12 V.
  const auto regulator = lqr(plant, bryson({0.01745, 0.08726}), bryson({12.0})).value();

  const auto model_noise = standard_deviations({0.01745, 0.1745329}).value();
  const auto encoder_noise = standard_deviations({0.01}).value();
  const auto estimator = kalman_gain(plant, discretize(arm.A, ProcessDensity{model_noise}, period),
                                     discretize(MeasurementDensity{encoder_noise}, period))
                             .value();

  const auto inversion = linear_plant_inversion(plant).value();

  // 0.5 rad/s after 0.5 s, until 1.04 rad.
  const TimeSeries profile = generate_trapezoid_profile(0.5, 0.5_s, period, 1.04).value();
  const Eigen::MatrixXd r = profile_reference(profile);

  const auto loop = simulate_linear({.plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                                     .K = regulator.K,
                                     .K_e = estimator.K,
                                     .plant_inversion = true,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(2)},
                                    r)
                        .value();

  FigureResult figure{.id = "6.9", .title = "Single-jointed arm response"};
  figure.columns = {{"time", "s", values(loop.time)},
                    {"reference_angle", "rad", values(r.row(0))},
                    {"angle", "rad", values(loop.x_hat.row(0))},
                    {"reference_velocity", "rad/s", values(r.row(1))},
                    {"velocity", "rad/s", values(loop.x_hat.row(1))},
                    {"voltage", "V", values(loop.u.row(0))}};
  figure.numbers = {{"K_p", "V/rad", regulator.K(0)},
                    {"K_d", "V/(rad/s)", regulator.K(1)},
                    {"K_e_1", "", estimator.K(0)},
                    {"K_e_2", "1/s", estimator.K(1)},
                    {"B_pinv_1", "V/rad", inversion.B_pinv()(0)},
                    {"B_pinv_2", "V/(rad/s)", inversion.B_pinv()(1)}};
  figure.picture = response_plot(figure, {{"Angle (rad)", "angle"},
                                          {"Angular velocity (rad/s)", "velocity"},
                                          {"Voltage (V)", "voltage", "Input"}});
  return figure;
}

}  // namespace flyball::book
