#include <flyball/core/figure.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/format.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;

constexpr std::array damping_ratios{0.1, 0.3, 0.5, 0.7, 0.9};

/// Of the groups' poles, in turn.
constexpr std::array pole_styles{LineStyle::crosses, LineStyle::frames, LineStyle::diamonds};

/// Adds a curve to a line, apart from what it has, and its mirror image below the real axis.
template <class Curve>
void add_mirrored(PlotLine& line, double from, double to, const Curve& curve) {
  constexpr int pieces = 40;
  constexpr double gap = std::numeric_limits<double>::quiet_NaN();
  for (const double side : {1.0, -1.0}) {
    for (int i = 0; i <= pieces; ++i) {
      const Complex point = curve(from + (to - from) * i / pieces);
      line.x.push_back(point.real());
      line.y.push_back(side * point.imag());
    }
    line.x.push_back(gap);
    line.y.push_back(gap);
  }
}

/// s of a damping ratio and a natural frequency.
Complex s_of(double ratio, double frequency) {
  return {-ratio * frequency, frequency * std::sqrt(std::max(0.0, 1.0 - ratio * ratio))};
}

/// Curves of equal damping ratio ζ and of equal natural frequency.
/// @param place  Where an s is in the plane. @param furthest  The largest natural frequency.
/// @param label_at  Share of it, where the ratio stands beside its curve.
template <class Place>
void add_damping_grid(PlotPanel& panel, double furthest, double label_at, const Place& place) {
  PlotLine grid{.style = LineStyle::guide};
  for (const double ratio : damping_ratios) {
    // In the z plane up to the real axis: the damped frequency is then Nyquist's.
    const double damped = std::sqrt(1.0 - ratio * ratio);
    const double end = label_at < 0.5 ? furthest / damped : furthest;
    add_mirrored(grid, 0.0, end, [&](double frequency) { return place(s_of(ratio, frequency)); });
    const Complex at = place(s_of(ratio, label_at * end));
    panel.notes.push_back({at.real(), at.imag(), detail::format("ζ {}", ratio)});
  }
  for (const double share : {0.2, 0.4, 0.6, 0.8, 1.0}) {
    add_mirrored(grid, 0.0, 1.0,
                 [&](double ratio) { return place(s_of(ratio, share * furthest)); });
  }
  panel.lines.push_back(std::move(grid));
}

void add_damping_grid(PlotPanel& panel, const std::vector<PolePlotGroup>& groups, bool discrete) {
  if (discrete) {
    add_damping_grid(panel, std::numbers::pi, 0.3, [](Complex s) { return std::exp(s); });
    return;
  }
  double largest = 0.0;
  for (const PolePlotGroup& group : groups) {
    for (const auto& roots : {group.poles, group.zeros}) {
      for (const Complex& root : roots) {
        largest = std::max(largest, std::isfinite(std::abs(root)) ? std::abs(root) : 0.0);
      }
    }
  }
  if (largest > 0.0) {
    add_damping_grid(panel, largest, 1.0, [](Complex s) { return s; });
  }
}

}  // namespace

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
  add_damping_grid(panel, groups, discrete);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto line = [&](const std::vector<Complex>& roots, LineStyle style,
                          std::string_view kind) {
      if (roots.empty()) {
        return;
      }
      PlotLine& added = panel.lines.emplace_back();
      added.label =
          groups[g].label.empty() ? std::string(kind) : groups[g].label + " " + std::string(kind);
      added.style = style;
      added.color = static_cast<int>(g);
      for (const Complex& root : roots) {
        added.x.push_back(root.real());
        added.y.push_back(root.imag());
      }
    };
    line(groups[g].poles, pole_styles[g % pole_styles.size()], "poles");
    line(groups[g].zeros, LineStyle::circles, "zeros");
  }
  plot.panels.push_back(std::move(panel));
  return plot;
}

}  // namespace flyball
