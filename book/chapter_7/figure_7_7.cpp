#include <flyball/control/lqr.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 7.7: what it costs to bring an elevator to rest from a position and a velocity, and the
/// gains Kp = 234.041 and Kd = 5.603 that section 7.7.2 prints.
FigureResult figure_7_7() {
  // The elevator of Figure 6.3 with its entries rounded as in the book's script; unrounded ones
  // give Kp = 234.037.
  const ContinuousSystem<2, 1, 1> elevator{.A = Eigen::Matrix2d{{0.0, 1.0}, {0.0, -164.209}},
                                           .B = Eigen::Vector2d{0.0, 21.457},
                                           .C = Eigen::RowVector2d{1.0, 0.0},
                                           .D = Eigen::Matrix<double, 1, 1>::Zero()};
  const auto plant = discretize(elevator, 5_ms).value();

  // Theorem 7.7.1: K = [Kp Kd], and the least cost from a state x to rest is xᵀ S x.
  const auto regulator = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();

  constexpr Eigen::Index points = 100;
  const Eigen::VectorXd axis = Eigen::VectorXd::LinSpaced(points, -1.0, 1.0);
  std::vector<double> positions;
  std::vector<double> velocities;
  std::vector<double> costs;
  for (const double velocity : axis) {
    for (const double position : axis) {
      const Eigen::Vector2d x{position, velocity};
      positions.push_back(position);
      velocities.push_back(velocity);
      costs.push_back(x.dot(regulator.S * x));
    }
  }

  FigureResult figure{.id = "7.7", .title = "Cost-to-go for elevator model"};
  figure.columns = {
      {"position", "m", positions}, {"velocity", "m/s", velocities}, {"cost_to_go", "", costs}};
  figure.numbers = {{"K_p", "V/m", regulator.K(0)},
                    {"K_d", "V/(m/s)", regulator.K(1)},
                    {"S_11", "1/m²", regulator.S(0, 0)},
                    {"S_12", "1/(m·m/s)", regulator.S(0, 1)},
                    {"S_22", "1/(m/s)²", regulator.S(1, 1)}};
  figure.picture = SurfacePlot{.title = figure.title,
                               .x_label = "Position (m)",
                               .y_label = "Velocity (m/s)",
                               .z_label = "Cost-to-go xᵀSx",
                               .x = values(axis),
                               .y = values(axis),
                               .z = costs};
  return figure;
}

}  // namespace flyball::book
