#include <algorithm>
#include <deque>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/latency.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

/// What one of the figures is about.
struct DelayStudy {
  std::string id;
  std::string title;
  DiscreteSystem<> plant;
  Eigen::MatrixXd K;  ///< Designed as if there were no delay.
  Time delay;
  double height = 0.0;  ///< Of the step in the first state.
  bool compensated = false;
  std::vector<StateLabel> states;
};

/// A loop whose input reaches the plant later, by a whole number of periods. The recorded voltage
/// is the one that arrives.
FigureResult delayed_loop(const DelayStudy& study) {
  const auto& [A, B, C, D, period] = study.plant;
  // (B.12): K (A - BK)^(L/T)
  const Eigen::MatrixXd K =
      study.compensated ? compensate_latency(study.K, A, B, period, study.delay).value() : study.K;
  const auto inversion = linear_plant_inversion(study.plant).value();

  const Eigen::MatrixXd r = pulse_reference(study.height, A.rows(), period);
  const auto delay_steps = static_cast<std::size_t>(study.delay.si() / period.si() + 0.5);
  std::deque<double> on_its_way(delay_steps, 0.0);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(A.rows());
  double u = 0.0;
  Eigen::MatrixXd states(A.rows(), r.cols());
  std::vector<double> time;
  std::vector<double> voltage;
  for (Eigen::Index k = 0; k < r.cols(); ++k) {
    x = A * x + B * u;
    const Eigen::VectorXd r_now = r.col(k);
    const Eigen::VectorXd r_next = r.col(std::min(k + 1, r.cols() - 1));
    const double wanted = inversion.calculate(r_now, r_next)(0) + (K * (r_now - x))(0);
    on_its_way.push_back(std::clamp(wanted, -12.0, 12.0));
    u = on_its_way.front();
    on_its_way.pop_front();
    states.col(k) = x;
    time.push_back(static_cast<double>(k) * period.si());
    voltage.push_back(u);
  }

  FigureResult figure{.id = study.id, .title = study.title};
  figure.columns.push_back({"time", "s", time});
  auto panels = add_states(figure, study.states, r, states);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::string gain = gain_name(study.states, i);
    const std::string unit = gain_unit(study.states[i]);
    const double value = K(static_cast<Eigen::Index>(i));
    figure.numbers.push_back({gain, unit, value});
    panels[i].label = "State (" + gain + " = " + format_number(value, 5) + " " + unit + ")";
  }
  figure.columns.push_back({"voltage", "V", voltage});
  panels.push_back({"Voltage (V)", "voltage", "Input, as it arrives"});
  figure.picture = response_plot(figure, panels);
  return figure;
}

FigureResult elevator_delay(std::string id, std::string title, bool compensated) {
  const auto plant = discretize(case_study_elevator(), 5_ms).value();
  return delayed_loop({.id = std::move(id),
                       .title = std::move(title),
                       .plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                       .K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K,
                       .delay = 50_ms,
                       .height = 1.524,
                       .compensated = compensated,
                       .states = {{"position", "m", "Position"}, {"velocity", "m/s", "Velocity"}}});
}

/// A mechanism from identified gains, dv/dt = -kV/kA v + 1/kA u (Theorem 14.3.1).
FigureResult velocity_delay(std::string id, std::string title, double kV, double kA,
                            double tolerance, double voltage, Time delay, double height,
                            bool compensated, std::string unit, std::string label) {
  const auto mechanism = mechanisms::flywheel({.kV = kV, .kA = kA}).value();
  const auto plant = discretize(mechanism, 1_ms).value();
  return delayed_loop({.id = std::move(id),
                       .title = std::move(title),
                       .plant = {plant.A, plant.B, plant.C, plant.D, plant.period},
                       .K = lqr(plant, bryson({tolerance}), bryson({voltage})).value().K,
                       .delay = delay,
                       .height = height,
                       .compensated = compensated,
                       .states = {{"velocity", std::move(unit), std::move(label)}}});
}

FigureResult drivetrain_delay(std::string id, std::string title, bool compensated) {
  return velocity_delay(std::move(id), std::move(title), 3.02, 0.642, 0.2, 7.0, 40_ms, 2.0,
                        compensated, "m/s", "Velocity");
}

FigureResult flywheel_delay(std::string id, std::string title, bool compensated) {
  return velocity_delay(std::move(id), std::move(title), 0.011, 0.005515, 80.0, 12.0, 80_ms, 510.0,
                        compensated, "rad/s", "Angular velocity");
}

}  // namespace

/// Figure B.1: an elevator whose input is 50 ms late.
FigureResult figure_B_1() {
  return elevator_delay("B.1", "Elevator with a delay of 50 ms", false);
}

/// Figure B.2: the same, the gain compensated (B.12).
FigureResult figure_B_2() {
  return elevator_delay("B.2", "Elevator with a delay of 50 ms, compensated", true);
}

/// Figure B.3: a drivetrain whose input is 40 ms late.
FigureResult figure_B_3() {
  return drivetrain_delay("B.3", "Drivetrain velocity with a delay of 40 ms", false);
}

/// Figure B.4: the same, compensated.
FigureResult figure_B_4() {
  return drivetrain_delay("B.4", "Drivetrain velocity with a delay of 40 ms, compensated", true);
}

/// Figure B.5: a flywheel whose input is 80 ms late.
FigureResult figure_B_5() {
  return flywheel_delay("B.5", "Flywheel with a delay of 80 ms", false);
}

/// Figure B.6: the same, compensated.
FigureResult figure_B_6() {
  return flywheel_delay("B.6", "Flywheel with a delay of 80 ms, compensated", true);
}

}  // namespace flyball::book
