#include <flyball/estimation/kalman_filter.hpp>

#include <cmath>

#include "book/chapter_9/wall_measurements.hpp"
#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

/// A robot drives from one wall to another at 0.8 cm/s and measures the distance to both once a
/// second (section 9.6.3): its position, its velocity and the distance between the walls.
struct WallEstimates {
  std::vector<double> time;
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Matrix3d> P;
};

WallEstimates estimate_walls() {
  // (9.29), (9.30); the input that sets the velocity is 1.
  DiscreteSystem<3, 1, 2> plant;
  plant.A << 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  plant.B << 0.0, 0.8, 0.0;
  plant.C << 1.0, 0.0, 0.0, -1.0, 0.0, 1.0;
  plant.D.setZero();
  plant.period = Time(1.0);
  const auto Q = standard_deviations({0.0, 0.1, 0.0});
  const Eigen::Matrix2d R = 10.0 * Eigen::Matrix2d::Identity();
  // (9.33), (9.34): from the first two measurements.
  const Eigen::Vector3d x_0(measured_way[0], measured_way[1] - measured_way[0],
                            measured_way[0] + measured_wall[0]);
  const Eigen::Matrix3d P_0{{10.0, 10.0, 10.0}, {10.0, 20.0, 10.0}, {10.0, 10.0, 20.0}};
  auto filter = kalman_filter(plant, Q, R, P_0).value();
  filter.reset(x_0);

  WallEstimates estimates;
  const Eigen::Matrix<double, 1, 1> u(1.0);
  for (std::size_t k = 0; k < measured_way.size(); ++k) {
    if (k > 0) {
      filter.predict(u);
      filter.update({measured_way[k], measured_wall[k]}, u);
    }
    // The book's abscissa ends at 100.
    estimates.time.push_back(static_cast<double>(k) * 100.0 / 99.0);
    estimates.x.push_back(filter.x_hat());
    estimates.P.push_back(k > 0 ? filter.P() : P_0);
  }
  return estimates;
}

template <class Entry>
std::vector<double> each_estimate(const WallEstimates& estimates, const Entry& entry) {
  std::vector<double> result;
  for (std::size_t k = 0; k < estimates.time.size(); ++k) {
    result.push_back(entry(k));
  }
  return result;
}

std::vector<double> state(const WallEstimates& estimates, Eigen::Index i) {
  return each_estimate(estimates, [&](std::size_t k) { return estimates.x[k](i); });
}

std::vector<double> covariance(const WallEstimates& estimates, Eigen::Index i, Eigen::Index j) {
  return each_estimate(estimates, [&](std::size_t k) { return estimates.P[k](i, j); });
}

/// The deviations that section 9.6.4 prints, 0.5188 and 0.4491, are those after 98 updates.
FigureNumber deviation(const WallEstimates& estimates, const std::string& name, Eigen::Index i,
                       std::size_t updates) {
  return {name + "_std_" + std::to_string(updates), "cm", std::sqrt(estimates.P[updates](i, i))};
}

template <class Values>
std::vector<double> to_vector(const Values& values) {
  return {values.begin(), values.end()};
}

/// An estimate above its variances.
Plot estimate_and_variance(const FigureResult& figure, const std::string& label,
                           const std::vector<PlotColumn>& variances) {
  Plot plot = line_plot(figure, label, {{figure.columns[1].name, ""}});
  Plot below = line_plot(figure, "Variance (cm²)", variances);
  plot.panels.push_back(below.panels.front());
  return plot;
}

}  // namespace

/// Figure 9.3: a Kalman filter's estimates beside what was measured.
FigureResult figure_9_3() {
  const WallEstimates estimates = estimate_walls();
  FigureResult figure{.id = "9.3", .title = "State estimates and measurements with Kalman filter"};
  figure.columns = {{"time", "s", estimates.time},
                    {"robot_position", "cm", state(estimates, 0)},
                    {"robot_velocity", "cm/s", state(estimates, 1)},
                    {"wall_position", "cm", state(estimates, 2)},
                    {"measured_way", "cm", to_vector(measured_way)},
                    {"measured_wall", "cm", to_vector(measured_wall)}};
  figure.numbers = {deviation(estimates, "robot", 0, 98), deviation(estimates, "wall", 2, 98),
                    deviation(estimates, "robot", 0, 99), deviation(estimates, "wall", 2, 99)};
  figure.picture = line_plot(
      figure, "Distance (cm), velocity (cm/s)",
      {{"robot_position", "Robot position, estimate"},
       {"robot_velocity", "Robot velocity, estimate"},
       {"wall_position", "Wall position, estimate"},
       {"measured_way", "Robot to the wall behind it, measured", LineStyle::dotted},
       {"measured_wall", "Robot to the wall in front of it, measured", LineStyle::dotted}});
  return figure;
}

/// Figure 9.4: the robot's position, and how its variance goes down with each measurement.
FigureResult figure_9_4() {
  const WallEstimates estimates = estimate_walls();
  FigureResult figure{.id = "9.4",
                      .title = "Robot position estimate and variance with Kalman filter"};
  figure.columns = {{"time", "s", estimates.time},
                    {"robot_position", "cm", state(estimates, 0)},
                    {"P_11", "cm²", covariance(estimates, 0, 0)}};
  figure.numbers = {deviation(estimates, "robot", 0, 98)};
  figure.picture = estimate_and_variance(figure, "Robot position (cm)",
                                         {{"P_11", "P₁₁, variance of the robot's position"}});
  return figure;
}

/// Figure 9.5: the same of the wall. The book plots P₃₁, the covariance of the wall and the robot,
/// under the title of P₃₃, which is here beside it.
FigureResult figure_9_5() {
  const WallEstimates estimates = estimate_walls();
  FigureResult figure{.id = "9.5",
                      .title = "Wall position estimate and variance with Kalman filter"};
  figure.columns = {{"time", "s", estimates.time},
                    {"wall_position", "cm", state(estimates, 2)},
                    {"P_31", "cm²", covariance(estimates, 2, 0)},
                    {"P_33", "cm²", covariance(estimates, 2, 2)}};
  figure.numbers = {deviation(estimates, "wall", 2, 98)};
  figure.picture =
      estimate_and_variance(figure, "Wall position (cm)",
                            {{"P_31", "P₃₁, covariance of wall and robot, which the book shows"},
                             {"P_33", "P₃₃, variance of the wall's position", LineStyle::dashed}});
  return figure;
}

}  // namespace flyball::book
