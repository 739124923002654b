#include <cmath>

#include <fmt/format.h>

#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 6.1: impulse responses against the place of the pole (section 6.4): e^(σt) cos ωt for the
/// pole σ + jω.
FigureResult figure_6_1() {
  constexpr double poles[][2] = {{-1.75, 1.75}, {-2.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0},  {0.0, 2.0},
                                 {0.0, 0.0},    {1.0, 0.0},  {2.0, 0.0},  {0.75, 1.75}};
  const Time period = 10_ms;
  constexpr int samples = 101;

  FigureResult figure{.id = "6.1", .title = "Impulse response against the place of the pole"};
  std::vector<double> time;
  for (int k = 0; k < samples; ++k) {
    time.push_back(k * period.si());
  }
  figure.columns.push_back({"time", "s", time});
  PlotPanel panel{
      .y_label = "Imaginary part of the pole (rad/s)",
      .marks = {{.at = 0.0, .vertical = true}, {.at = 0.0}},
      .notes = {{-2.1, 2.25, "Stable: left half-plane"}, {0.6, 2.25, "Unstable: right half-plane"}},
      .y_limits = PlotLimits{-0.4, 2.5}};
  PlotLine crosses{.label = "Pole", .style = LineStyle::crosses, .color = 6};
  for (const auto& [sigma, omega] : poles) {
    // dx/dt = [σ -ω; ω σ] x turns and grows like the mode; the impulse is its initial state.
    const Eigen::Matrix2d A{{sigma, -omega}, {omega, sigma}};
    const auto mode = discretize_zoh(A, Eigen::Vector2d(1.0, 0.0), period).value();
    Eigen::Vector2d x(1.0, 0.0);
    std::vector<double> response;
    PlotLine drawn{.color = sigma < 0.0 ? 2 : sigma > 0.0 ? 1 : 0};
    PlotLine axis{.x = {sigma, sigma + 0.4}, .y = {omega, omega}, .style = LineStyle::dotted};
    axis.color = 6;
    for (int k = 0; k < samples; ++k) {
      response.push_back(x(0));
      x = mode.A * x;
    }
    // Drawn beside its pole, the oscillations faster, up to twice the impulse.
    for (int k = 0; k < 200; ++k) {
      const double t = k * 0.01;
      const double value = std::exp(sigma * t) * std::cos(omega * 80.0 / 3.0 * t / 2.0);
      if (std::abs(value) > 2.0) {
        break;
      }
      drawn.x.push_back(sigma + 0.2 * t);
      drawn.y.push_back(omega + 0.15 * value);
    }
    figure.columns.push_back({fmt::format("pole {}{:+}j", sigma, omega), "", response});
    if (omega > 0.0) {
      panel.lines.push_back(std::move(axis));
    }
    panel.lines.push_back(std::move(drawn));
    crosses.x.push_back(sigma);
    crosses.y.push_back(omega);
  }
  panel.lines.push_back(std::move(crosses));
  figure.picture = Plot{.title = figure.title,
                        .x_label = "Real part of the pole (1/s)",
                        .panels = {panel},
                        .equal_axes = true};
  return figure;
}

}  // namespace flyball::book
