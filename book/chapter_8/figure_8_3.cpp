#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/differential_drive.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>
#include <flyball/simulation/linear_loop.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 8.3: the sides of a differential drive follow the velocity of a profile over 50 m
/// (section 8.7.1). The book's observer has no noise to filter: its estimate is the state.
FigureResult figure_8_3() {
  // Theorem 8.7.1: x = [vl, vr], u = [Vl, Vr]; two CIM motors a side.
  const auto drive = mechanisms::differential_drive({.motor = mechanisms::cim(2),
                                                     .left_gearing = 60.0 / 11.0,
                                                     .right_gearing = 60.0 / 11.0,
                                                     .mass = 52_kg,
                                                     .wheel_radius = 0.041275_m,
                                                     .trackwidth = 0.59055_m,
                                                     .moment_of_inertia = 6_kg_m2})
                         .value();
  const auto plant = discretize(drive, 5_ms).value();
  const auto regulator = lqr(plant, bryson({0.95, 0.95}), bryson({12.0, 12.0})).value();

  // 3.5 m/s after 1 s, both sides.
  const TimeSeries profile = generate_trapezoid_profile(3.5, 1_s, 5_ms, 50.0).value();
  const Eigen::MatrixXd r = profile_reference(profile).row(1).replicate(2, 1);

  const auto loop = simulate_linear({.plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                                     .K = regulator.K,
                                     .u_min = Eigen::VectorXd::Constant(2, -12.0),
                                     .u_max = Eigen::VectorXd::Constant(2, 12.0),
                                     .x0 = Eigen::VectorXd::Zero(2)},
                                    r)
                        .value();

  FigureResult figure{.id = "8.3", .title = "Drivetrain response"};
  figure.columns = {{"time", "s", values(loop.time)}};
  auto panels = add_states(
      figure,
      {{"left_velocity", "m/s", "Left velocity"}, {"right_velocity", "m/s", "Right velocity"}}, r,
      loop.x);
  figure.columns.push_back({"left_voltage", "V", values(loop.u.row(0))});
  figure.columns.push_back({"right_voltage", "V", values(loop.u.row(1))});
  panels.push_back({"Left voltage (V)", "left_voltage", "Input"});
  panels.push_back({"Right voltage (V)", "right_voltage", "Input"});
  figure.picture = response_plot(figure, panels);
  figure.numbers = {{"K_11", "V/(m/s)", regulator.K(0, 0)}, {"K_12", "V/(m/s)", regulator.K(0, 1)}};
  return figure;
}

}  // namespace flyball::book
