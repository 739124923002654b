#include <flyball/core/figure.hpp>

#include <cstddef>
#include <string_view>
#include <utility>

namespace flyball {

Plot pole_plot(std::string title, const std::vector<PolePlotGroup>& groups, bool discrete) {
  Plot plot;
  plot.title = std::move(title);
  plot.x_label = discrete ? "Real part" : "Real part (rad/s)";
  plot.equal_axes = true;
  plot.unit_circle = discrete;
  plot.width = 640;
  PlotPanel panel;
  panel.y_label = discrete ? "Imaginary part" : "Imaginary part (rad/s)";
  panel.marks.push_back({0.0, {}, true});
  panel.marks.push_back({0.0, {}, false});
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto line = [&](const std::vector<std::complex<double>>& roots, LineStyle style,
                          std::string_view kind) {
      if (roots.empty()) {
        return;
      }
      PlotLine& added = panel.lines.emplace_back();
      added.label =
          groups[g].label.empty() ? std::string(kind) : groups[g].label + " " + std::string(kind);
      added.style = style;
      added.color = static_cast<int>(g);
      for (const std::complex<double>& root : roots) {
        added.x.push_back(root.real());
        added.y.push_back(root.imag());
      }
    };
    line(groups[g].poles, LineStyle::crosses, "poles");
    line(groups[g].zeros, LineStyle::circles, "zeros");
  }
  plot.panels.push_back(std::move(panel));
  return plot;
}

}  // namespace flyball
