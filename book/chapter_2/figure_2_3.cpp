#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/planning/generate_trapezoid_profile.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 2.3: a PD controller lifts an elevator by 3 m along a trapezoid profile (section 2.2).
/// With the velocity as the second state, a state feedback's two gains are K_p and K_d.
FigureResult figure_2_3() {
  // Theorem 6.9.1 with two CIM motors on a 42:12 and a 40:14 reduction, sampled each 5 ms.
  const auto elevator = mechanisms::elevator({.motor = mechanisms::cim(2),
                                              .gearing = 42.0 / 12.0 * 40.0 / 14.0,
                                              .mass = 6.803886_kg,
                                              .drum_radius = 0.02762679089_m})
                            .value();
  const auto plant = discretize(elevator, 5_ms).value();

  // The gains are chosen by what is tolerable: 2 cm, 0.4 m/s, 12 V.
  const auto regulator = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  const double K_p = regulator.K(0);
  const double K_d = regulator.K(1);

  // The setpoint: 0.5 m/s after 0.5 s, until 3 m.
  const TimeSeries profile = generate_trapezoid_profile(0.5, 0.5_s, 5_ms, 3.0).value();
  const Eigen::MatrixXd r = profile_reference(profile);

  // u = K_p (r - x) + K_d (dr/dt - dx/dt), of the true state and without feedforward: it lags.
  const auto loop = simulate_linear({.plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                                     .K = regulator.K,
                                     .K_e = std::nullopt,
                                     .plant_inversion = false,
                                     .u_min = Eigen::VectorXd::Constant(1, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(1, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(2)},
                                    r)
                        .value();

  FigureResult figure{.id = "2.3", .title = "PD controller on an elevator"};
  figure.columns = {
      {"time", "s", values(loop.time)},           {"reference_position", "m", values(r.row(0))},
      {"position", "m", values(loop.x.row(0))},   {"reference_velocity", "m/s", values(r.row(1))},
      {"velocity", "m/s", values(loop.x.row(1))}, {"voltage", "V", values(loop.u.row(0))}};
  figure.numbers = {{"K_p", "V/m", K_p}, {"K_d", "V/(m/s)", K_d}};
  figure.picture = response_plot(
      figure,
      {{"Position (m)", "position", "Output (Kp = " + format_number(K_p, 5) + " V/m)", "Setpoint"},
       {"Velocity (m/s)", "velocity", "Output (Kd = " + format_number(K_d, 4) + " V/(m/s))",
        "Setpoint"},
       {"Voltage (V)", "voltage", "Input"}});
  return figure;
}

}  // namespace flyball::book
