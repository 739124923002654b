#include <cmath>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

constexpr int step_samples = 60;

FigureResult pole_figure(std::string id, std::string title, const DiscreteSystem<>& right,
                         const DiscreteSystem<>& left, const std::string& right_label,
                         const std::string& left_label) {
  std::vector<double> time;
  for (int k = 0; k < step_samples; ++k) {
    time.push_back(k * right.period.si());
  }
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  figure.columns = {{"time", "s", time},
                    {"right_half_plane", "", values(unit_step(right, step_samples))},
                    {"left_half_plane", "", values(unit_step(left, step_samples))}};
  // What they settle at: G(1).
  const auto settled = [](const DiscreteSystem<>& system) { return unit_step(system, 2000)(1999); };
  figure.numbers = {{"final_right", "", settled(right)}, {"final_left", "", settled(left)}};
  figure.picture =
      line_plot(figure, "Step response",
                {{"right_half_plane", right_label, LineStyle::samples, state_color},
                 {"left_half_plane", left_label, LineStyle::samples, reference_color}});
  return figure;
}

}  // namespace

/// Figure 7.2: step responses of 1/(z - 0.6) and 1/(z + 0.6) (section 7.1.2): a pole on the
/// negative real axis oscillates at half the sample rate.
FigureResult figure_7_2() {
  const auto system = [](double pole) {
    return DiscreteSystem<>{Eigen::MatrixXd{{pole}}, Eigen::MatrixXd{{1.0}}, Eigen::MatrixXd{{1.0}},
                            Eigen::MatrixXd{{0.0}}, 100_ms};
  };
  return pole_figure("7.2", "Single poles on the real axis", system(0.6), system(-0.6),
                     "Pole at 0.6, right half-plane", "Pole at −0.6, left half-plane");
}

/// Figure 7.3: of 1/((z ∓ 0.6)² + 0.6²), whose poles are ±0.6 ± 0.6j.
FigureResult figure_7_3() {
  const auto system = [](double re) {
    // z² - 2 re z + re² + 0.36
    return DiscreteSystem<>{Eigen::MatrixXd{{0.0, 1.0}, {-(re * re + 0.36), 2.0 * re}},
                            Eigen::MatrixXd{{0.0}, {1.0}}, Eigen::MatrixXd{{1.0, 0.0}},
                            Eigen::MatrixXd{{0.0}}, 100_ms};
  };
  return pole_figure("7.3", "Complex conjugate poles", system(0.6), system(-0.6),
                     "Poles at 0.6 ± 0.6j, right half-plane",
                     "Poles at −0.6 ± 0.6j, left half-plane");
}

}  // namespace flyball::book
