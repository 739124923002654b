#include <cmath>

#include <flyball/math/probability/density.hpp>
#include <flyball/math/probability/distributions.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

/// Figure 9.1: a density p(x), and the area over [x₁, x₁ + dx] that is the probability of that
/// interval (section 9.3.1).
FigureResult figure_9_1() {
  constexpr double mean = 1.0;
  constexpr double sigma = 2.0;
  constexpr double x_1 = 2.0;
  constexpr double dx = 0.5;
  const auto p = [](double x) { return normal_pdf(x, mean, sigma); };

  FigureResult figure{.id = "9.1", .title = "Probability density function"};
  std::vector<double> axis;
  std::vector<double> density;
  PlotBand strip{.label = "p(x₁) dx", .color = 1};
  for (int i = 0; i < 17000; ++i) {
    const double x = -7.5 + 0.001 * i;
    axis.push_back(x);
    density.push_back(p(x));
    if (x_1 <= x && x <= x_1 + dx) {
      strip.x.push_back(x);
      strip.low.push_back(0.0);
      strip.high.push_back(p(x));
    }
  }
  figure.columns = {{"x", "", axis}, {"density", "", density}};
  figure.numbers = {{"p(2)", "", p(x_1)},
                    {"p(2.5)", "", p(x_1 + dx)},
                    {"probability of [2, 2.5]", "", probability(p, x_1, x_1 + dx).value()}};
  PlotPanel panel{.y_label = "p(x)",
                  .lines = {{.label = "p(x)", .x = axis, .y = density, .color = 0}},
                  .bands = {strip}};
  figure.picture = Plot{.title = figure.title, .x_label = "x", .panels = {panel}};
  return figure;
}

/// Figure 9.2: the density p(x, y) of two variables is a surface, and a probability the volume
/// under a part of it (section 9.3.4).
FigureResult figure_9_2() {
  const auto vector =
      GaussianVector::create(Eigen::Vector2d(0.0, 1.0), 0.25 * Eigen::Matrix2d::Identity()).value();
  const Eigen::VectorXd x_axis = Eigen::VectorXd::LinSpaced(30, -1.0, 1.0);
  const Eigen::VectorXd y_axis = Eigen::VectorXd::LinSpaced(30, 0.0, 2.0);
  std::vector<double> xs;
  std::vector<double> ys;
  std::vector<double> density;
  for (const double y : y_axis) {
    for (const double x : x_axis) {
      xs.push_back(x);
      ys.push_back(y);
      density.push_back(std::exp(vector.log_density(Eigen::Vector2d(x, y)).value()));
    }
  }
  FigureResult figure{.id = "9.2", .title = "Joint probability density function"};
  figure.columns = {{"x", "", xs}, {"y", "", ys}, {"density", "", density}};
  figure.picture = SurfacePlot{.title = figure.title,
                               .x_label = "x",
                               .y_label = "y",
                               .z_label = "p(x, y)",
                               .x = values(x_axis),
                               .y = values(y_axis),
                               .z = density};
  return figure;
}

}  // namespace flyball::book
