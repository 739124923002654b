#include <cmath>
#include <numbers>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

/// Figure 7.4: sampled at 2 Hz, a sine of 1.5 Hz cannot be told from one of 0.5 Hz (section 7.1.3).
/// The samples are t = k/2; the book's script finds some of them twice and misses others.
FigureResult figure_7_4() {
  constexpr double frequency = 1.5;
  constexpr double sample_rate = 2.0;
  // |f - N f_s| for the nearest whole N
  const double alias = std::abs(frequency - std::round(frequency / sample_rate) * sample_rate);
  const auto signal = [](double t) { return std::sin(2.0 * std::numbers::pi * frequency * t); };

  std::vector<double> time;
  std::vector<double> original;
  std::vector<double> aliased;
  for (int k = 0; k < 4000; ++k) {
    const double t = k * 0.001;
    time.push_back(t);
    original.push_back(signal(t));
    aliased.push_back(std::sin(-2.0 * std::numbers::pi * alias * t));
  }
  PlotLine samples{.label = "Samples at 2 Hz", .style = LineStyle::circles, .color = 6};
  for (int k = 0; k < 8; ++k) {
    samples.x.push_back(k / sample_rate);
    samples.y.push_back(signal(k / sample_rate));
  }

  FigureResult figure{.id = "7.4", .title = "Aliasing"};
  figure.columns = {{"time", "s", time}, {"original", "", original}, {"aliased", "", aliased}};
  figure.numbers = {{"alias_frequency", "Hz", alias}};
  Plot plot = line_plot(figure, "Signal",
                        {{"original", "Original signal at 1.5 Hz"},
                         {"aliased", "Aliased signal at 0.5 Hz", LineStyle::dashed}});
  plot.panels[0].lines.push_back(std::move(samples));
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
