#include <cmath>
#include <string>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

/// Figure 7.5: the exponential and its Taylor polynomials (section 7.3.1).
FigureResult figure_7_5() {
  constexpr int samples = 10000;
  FigureResult figure{.id = "7.5", .title = "Taylor series expansions of the exponential"};
  std::vector<double> t;
  std::vector<double> exact;
  for (int k = 0; k < samples; ++k) {
    t.push_back(-5.0 + k * 0.001);
    exact.push_back(std::exp(t.back()));
  }
  figure.columns = {{"t", "", t}, {"exponential", "", exact}};
  std::vector<PlotColumn> drawn{{"exponential", "exp(t)", LineStyle::solid, 6}};
  constexpr LineStyle styles[] = {LineStyle::dotted, LineStyle::dash_dot, LineStyle::dashed};
  for (int order = 5; order >= 0; --order) {
    std::vector<double> polynomial;
    for (const double at : t) {
      double term = 1.0;
      double sum = 1.0;
      for (int k = 1; k <= order; ++k) {
        term *= at / k;
        sum += term;
      }
      polynomial.push_back(sum);
    }
    const std::string name = "order_" + std::to_string(order);
    figure.columns.push_back({name, "", polynomial});
    drawn.push_back({name, "Order " + std::to_string(order), styles[order % 3], 5 - order});
  }
  Plot plot = line_plot(figure, "Sum of the series", drawn);
  plot.x_label = "t";
  plot.panels[0].y_limits = PlotLimits{-2.0, 20.0};  // the book's axes
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
