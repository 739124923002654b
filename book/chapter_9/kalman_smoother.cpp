#include <flyball/estimation/smoother.hpp>

#include "book/chapter_9/wall_measurements.hpp"
#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

/// The robot between two walls again, its velocity a random walk (9.47), by all measurements at
/// once (section 9.7.2).
LinearSmoothing smooth_walls() {
  const DiscreteSystem<> plant{
      .A = Eigen::Matrix3d{{1.0, 1.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}},
      .B = Eigen::MatrixXd::Zero(3, 1),
      .C = Eigen::Matrix<double, 2, 3>{{1.0, 0.0, 0.0}, {-1.0, 0.0, 1.0}},
      .D = Eigen::MatrixXd::Zero(2, 1),
      .period = Time(1.0)};
  const auto Q = standard_deviations({0.0, 0.1, 0.0});
  const Eigen::Matrix2d R = 10.0 * Eigen::Matrix2d::Identity();
  // From the first measurement and a velocity of 0.2 ± 1 cm/s.
  const Eigen::Vector3d x_0(measured_way[0], 0.2, measured_way[0] + measured_wall[0]);
  const Eigen::Matrix3d P_0{{10.0, 0.0, 10.0}, {0.0, 1.0, 0.0}, {10.0, 0.0, 20.0}};
  constexpr auto steps = static_cast<Eigen::Index>(measured_way.size()) - 1;
  Eigen::MatrixXd y(2, steps);
  y.row(0) = Eigen::RowVectorXd::Map(measured_way.data() + 1, steps);
  y.row(1) = Eigen::RowVectorXd::Map(measured_wall.data() + 1, steps);
  return smooth(plant, Q, R, x_0, P_0, Eigen::MatrixXd::Zero(1, steps), y).value();
}

std::vector<double> seconds() {
  // The book's abscissa ends at 100.
  return values(
      Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(measured_way.size()), 0.0, 100.0));
}

/// One entry of each covariance's diagonal.
std::vector<double> variances(const std::vector<Eigen::MatrixXd>& P, Eigen::Index i) {
  std::vector<double> result;
  for (const Eigen::MatrixXd& of_one : P) {
    result.push_back(of_one(i, i));
  }
  return result;
}

/// A state by the filter and by the smoother.
FigureResult smoothed_state(std::string id, std::string title, Eigen::Index state,
                            const std::string& unit, const std::string& label) {
  const LinearSmoothing estimates = smooth_walls();
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  figure.columns = {{"time", "s", seconds()},
                    {"filter", unit, values(estimates.x_filtered.row(state))},
                    {"smoother", unit, values(estimates.smoothed.x.row(state))}};
  figure.picture = line_plot(figure, label + " (" + unit + ")",
                             {{"filter", "Kalman filter"}, {"smoother", "Kalman smoother"}});
  return figure;
}

}  // namespace

/// Figure 9.6: the robot's position by the measurements up to each instant, and by all of them.
FigureResult figure_9_6() {
  return smoothed_state("9.6", "Robot position with Kalman smoother", 0, "cm", "Robot position");
}

/// Figure 9.7: its velocity.
FigureResult figure_9_7() {
  return smoothed_state("9.7", "Robot velocity with Kalman smoother", 1, "cm/s", "Robot velocity");
}

/// Figure 9.8: the wall, which does not move, so that its last estimate is right for all times.
FigureResult figure_9_8() {
  return smoothed_state("9.8", "Wall position with Kalman smoother", 2, "cm", "Wall position");
}

/// Figure 9.9: what later measurements take from the variances. The book plots P₂₂, that of the
/// velocity, under the title of P₁₁, which is here below it.
FigureResult figure_9_9() {
  const LinearSmoothing estimates = smooth_walls();
  FigureResult figure{.id = "9.9", .title = "Robot position variance with Kalman smoother"};
  figure.columns = {{"time", "s", seconds()},
                    {"P_22_filter", "(cm/s)²", variances(estimates.P_filtered, 1)},
                    {"P_22_smoother", "(cm/s)²", variances(estimates.smoothed.P, 1)},
                    {"P_11_filter", "cm²", variances(estimates.P_filtered, 0)},
                    {"P_11_smoother", "cm²", variances(estimates.smoothed.P, 0)}};
  Plot plot = line_plot(figure, "P₂₂ (cm²/s²)",
                        {{"P_22_filter", "Velocity, Kalman filter (the book's curve)"},
                         {"P_22_smoother", "Velocity, Kalman smoother (the book's curve)"}});
  Plot position = line_plot(
      figure, "P₁₁ (cm²)",
      {{"P_11_filter", "Position, Kalman filter"}, {"P_11_smoother", "Position, Kalman smoother"}});
  plot.panels.push_back(position.panels.front());
  figure.picture = plot;
  return figure;
}

}  // namespace flyball::book
