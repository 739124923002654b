#include <algorithm>

#include <flyball/control/lqr.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

/// A flywheel goes up to 9000 rpm and down again under proportional and integral feedback
/// (Definition 2.3.1).
/// @param K_i  V/rad; 0: proportional alone.
FigureResult flywheel_pi(std::string id, std::string title, double K_i) {
  const Time period = 5_ms;
  const auto plant = discretize(case_study_flywheel(), period).value();

  // A proportional gain by what is tolerable: 200 rad/s, 12 V.
  const double K_p = lqr(plant, bryson({200.0}), bryson({12.0})).value().K(0);

  const AngularVelocity speed = 9000_rpm;
  const Eigen::MatrixXd r = pulse_reference(speed.si(), 1, period);
  std::vector<double> time;
  std::vector<double> velocity;
  std::vector<double> voltage;
  double x = 0.0;
  double u = 0.0;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < r.cols(); ++k) {
    x = plant.A(0) * x + plant.B(0) * u;
    const double error = r(0, k) - x;
    // u = K_p e + K_i ∫ e dt (2.3); the integral is kept to what 12 V can use.
    if (K_i > 0.0) {
      sum = std::clamp(sum + error * period.si(), -12.0 / K_i, 12.0 / K_i);
    }
    u = std::clamp(K_p * error + K_i * sum, -12.0, 12.0);
    time.push_back(static_cast<double>(k) * period.si());
    velocity.push_back(x);
    voltage.push_back(u);
  }

  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  figure.columns = {{"time", "s", time},
                    {"reference_velocity", "rad/s", values(r.row(0))},
                    {"velocity", "rad/s", velocity},
                    {"voltage", "V", voltage}};
  figure.numbers = {{"K_p", "V/(rad/s)", K_p}};
  if (K_i > 0.0) {
    figure.numbers.push_back({"K_i", "V/rad", K_i});
  }
  figure.picture =
      response_plot(figure, {{"Angular velocity (rad/s)", "velocity", "Output", "Setpoint"},
                             {"Voltage (V)", "voltage", "Input"}});
  return figure;
}

}  // namespace

/// Figure 2.5: proportional feedback alone leaves an error where holding the speed takes a voltage.
FigureResult figure_2_5() {
  FigureResult figure =
      flywheel_pi("2.5", "P controller on a flywheel with steady-state error", 0.0);
  // The area of the error, which an integral would sum up, to 3 s.
  const auto until = std::ranges::upper_bound(figure.columns[0].values, 3.0);
  const auto rows = until - figure.columns[0].values.begin();
  const auto first = [&](std::size_t column) {
    const auto& all = figure.columns[column].values;
    return std::vector<double>(all.begin(), all.begin() + rows);
  };
  std::get<Plot>(figure.picture)
      .panels[0]
      .bands.push_back({.label = "Error", .x = first(0), .low = first(2), .high = first(1)});
  return figure;
}

/// Figure 2.6: a small integral gain removes it slowly.
FigureResult figure_2_6() {
  return flywheel_pi("2.6", "PI controller on a flywheel without overshoot", 0.01);
}

/// Figure 2.7: a larger one overshoots.
FigureResult figure_2_7() {
  return flywheel_pi("2.7", "PI controller on a flywheel with overshoot", 0.2);
}

}  // namespace flyball::book
