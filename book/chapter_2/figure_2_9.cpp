#include <cmath>

#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 2.9: underdamped, overdamped and critically damped responses (section 2.5) of
/// 1/(s(s + 5)) with a gain K in the feedback path: 1/(s² + 5s + K). Critical is K = 6.25; the
/// book's script has 6.268.
FigureResult figure_2_9() {
  const Time period = 0.1_ms;
  const auto step = [&](double K) {
    const ContinuousSystem<> closed_loop{Eigen::MatrixXd{{0.0, 1.0}, {-K, -5.0}},
                                         Eigen::MatrixXd{{0.0}, {1.0}}, Eigen::MatrixXd{{1.0, 0.0}},
                                         Eigen::MatrixXd{{0.0}}};
    Eigen::VectorXd y = unit_step(discretize(closed_loop, period).value(), 60000);
    return values(y / y(y.size() - 1));
  };
  std::vector<double> time;
  for (int k = 0; k < 60000; ++k) {
    time.push_back(k * period.si());
  }
  FigureResult figure{.id = "2.9", .title = "Underdamped, overdamped, critically damped responses"};
  figure.columns = {{"time", "s", time},
                    {"setpoint", "m", std::vector<double>(time.size(), 1.0)},
                    {"underdamped", "m", step(120.0)},
                    {"overdamped", "m", step(3.0)},
                    {"critically_damped", "m", step(6.268)}};
  // ζ = 5/(2 √K).
  figure.numbers = {{"damping_underdamped", "", 2.5 / std::sqrt(120.0)},
                    {"damping_overdamped", "", 2.5 / std::sqrt(3.0)},
                    {"damping_critically_damped", "", 2.5 / std::sqrt(6.268)}};
  figure.picture = line_plot(figure, "Position (m)",
                             {{"underdamped", "Underdamped", LineStyle::solid, 0},
                              {"overdamped", "Overdamped", LineStyle::dash_dot, 2},
                              {"critically_damped", "Critically damped", LineStyle::dotted, 6},
                              {"setpoint", "Setpoint", LineStyle::dashed, reference_color}});
  return figure;
}

}  // namespace flyball::book
