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
  std::vector<PlotColumn> drawn{{"exponential", "e^t"}};
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
    drawn.push_back({name, "n = " + std::to_string(order)});
  }
  Plot plot = line_plot(figure, "f(t)", drawn);
  plot.x_label = "t";
  // As far as the book's axes go.
  for (PlotLine& line : plot.panels[0].lines) {
    for (double& y : line.y) {
      y = y < -2.0 || y > 20.0 ? std::nan("") : y;
    }
  }
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
