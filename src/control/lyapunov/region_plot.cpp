#include <flyball/control/lyapunov/region_plot.hpp>

#include <cmath>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

PlotLine ring_line(const Eigen::MatrixXd& ring, std::string label, LineStyle style) {
  PlotLine line{.label = std::move(label), .style = style};
  for (Eigen::Index k = 0; k < ring.cols(); ++k) {
    line.x.push_back(ring(0, k));
    line.y.push_back(ring(1, k));
  }
  return line;
}

}  // namespace

Expected<Plot> region_plot(const SaturatedLoop& loop, const CertifiedRegion& region,
                           const std::vector<Coordinate>& names, Eigen::Index first,
                           Eigen::Index second, const SampledRegion* sampled,
                           const std::vector<double>& times) {
  std::vector<double> all{0.0};
  if (loop.model.states == 2) {
    all.insert(all.end(), times.begin(), times.end());
  }
  FLYBALL_TRY(const auto rings, backward_rings(loop, region, first, second, all));
  const auto name = [&](Eigen::Index state) {
    return static_cast<std::size_t>(state) < names.size()
               ? label(names[static_cast<std::size_t>(state)])
               : detail::format("x{}", state + 1);
  };
  PlotPanel panel{.y_label = name(second)};
  if (sampled != nullptr) {
    PlotLine comes{.label = "comes to rest, simulated", .style = LineStyle::points};
    for (Eigen::Index k = 0; k < sampled->starts.cols(); ++k) {
      if (sampled->comes[static_cast<std::size_t>(k)]) {
        comes.x.push_back(sampled->starts(first, k));
        comes.y.push_back(sampled->starts(second, k));
      }
    }
    panel.lines.push_back(std::move(comes));
  }
  panel.lines.push_back(ring_line(rings[0], "certified", LineStyle::solid));
  for (std::size_t k = 1; k < rings.size(); ++k) {
    panel.lines.push_back(
        ring_line(rings[k], detail::format("reaches it within {} s", format_number(all[k], 3)),
                  k % 2 == 1 ? LineStyle::dashed : LineStyle::dotted));
  }
  panel.lines.push_back({.label = "equilibrium",
                         .x = {region.x(first)},
                         .y = {region.x(second)},
                         .style = LineStyle::crosses});
  if (region.limiting_state.size() > 0 && loop.model.states == 2) {
    panel.lines.push_back({.label = "V does not fall",
                           .x = {region.limiting_state(first)},
                           .y = {region.limiting_state(second)},
                           .style = LineStyle::circles});
  }
  return Plot{.title = "Region of attraction", .x_label = name(first), .panels = {panel}};
}

}  // namespace flyball
