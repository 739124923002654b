#include <flyball/control/lqr.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>
#include <flyball/simulation/linear_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 2.3: a PD controller lifts an elevator by 3 m along a trapezoid profile (section 2.2).
/// With the velocity as the second state, a state feedback's two gains are K_p and K_d.
FigureResult figure_2_3() {
  const auto plant = discretize(case_study_elevator(), 5_ms).value();

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
  figure.columns = {{"time", "s", values(loop.time)}};
  auto panels = add_states(figure, {{"position", "m", "Position"}, {"velocity", "m/s", "Velocity"}},
                           r, loop.x);
  figure.columns.push_back({"voltage", "V", values(loop.u.row(0))});
  figure.numbers = {{"K_p", "V/m", K_p}, {"K_d", "V/(m/s)", K_d}};
  panels[0].label = "Output (Kp = " + format_number(K_p, 5) + " V/m)";
  panels[1].label = "Output (Kd = " + format_number(K_d, 4) + " V/(m/s))";
  panels[0].reference_label = panels[1].reference_label = "Setpoint";
  panels.push_back({"Voltage (V)", "voltage", "Input"});
  figure.picture = response_plot(figure, panels);
  return figure;
}

}  // namespace flyball::book
