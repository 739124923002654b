// Pictures of a mechanism that is sized.
#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/size_parts.hpp"

namespace flyball::study {

namespace {

using Number = double (*)(const SizeChoice& choice);

/// A number of each point that gets there, over the points' values.
PlotLine over(const std::vector<SizePoint>& points, std::optional<SizeChoice> SizePoint::* of,
              std::string label, Number number, int color, LineStyle style = LineStyle::solid) {
  PlotLine line{.label = std::move(label), .style = style, .color = color};
  for (const SizePoint& point : points) {
    const auto& choice = point.*of;
    line.x.push_back(point.value);
    line.y.push_back(choice ? number(*choice) : nan);
  }
  return line;
}

/// The same of those alone that brown out or overheat, as crosses.
PlotLine bad_ones(const std::vector<SizePoint>& points, std::optional<SizeChoice> SizePoint::* of,
                  Number number) {
  PlotLine line{
      .label = "browns out or overheats", .style = LineStyle::crosses, .color = unused_color};
  for (const SizePoint& point : points) {
    const auto& choice = point.*of;
    if (choice && !choice->is_good()) {
      line.x.push_back(point.value);
      line.y.push_back(number(*choice));
    }
  }
  return line;
}

/// "mass" of "Mass".
std::string lowered(std::string title) {
  title.front() = static_cast<char>(title.front() + ('a' - 'A'));
  return title;
}

constexpr Number time_of = [](const SizeChoice& c) { return c.travel.time; };
constexpr Number gearing_of = [](const SizeChoice& c) { return c.gearing; };
constexpr Number current_of = [](const SizeChoice& c) { return c.travel.peak_current; };
constexpr Number supply_of = [](const SizeChoice& c) { return c.travel.peak_supply; };
constexpr Number holding_of = [](const SizeChoice& c) { return c.holding_current; };
constexpr Number rail_of = [](const SizeChoice& c) { return c.travel.least_rail; };
constexpr Number energy_of = [](const SizeChoice& c) { return c.travel.energy; };
constexpr Number heat_of = [](const SizeChoice& c) { return c.travel.heat; };
constexpr Number warmth_of = [](const SizeChoice& c) { return c.travel.temperature; };

/// A panel of the rail with room around the brownout's line.
PlotPanel rail_panel(const SizeResult& result, std::vector<PlotLine> lines) {
  PlotPanel panel{.y_label = "Least rail (V)", .lines = std::move(lines)};
  const double brownout = result.job.brownout_voltage;
  panel.marks.push_back({brownout, "brownout", false});
  double least = brownout;
  for (const PlotLine& line : panel.lines) {
    for (const double value : line.y) {
      least = std::isnan(value) ? least : std::min(least, value);
    }
  }
  const double most = result.job.travel.limits.battery.open_circuit_voltage;
  const double room = 0.15 * (most - least);
  if (room > 0.0) {
    panel.y_limits = PlotLimits{least - room, most + 0.3 * room};
  }
  return panel;
}

Figure gearing_figure(const SizeResult& result) {
  Figure figure{"gearing",
                "gearing",
                "Against the gearing",
                fmt::format("The time of the fastest motion ({}), and what it costs, against the "
                            "gearing; shaded is where the time is within 2 % of the least.",
                            motion_in_words(result)),
                {}};
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = "Gearing (motor turns per output turn)";
  plot.log_x = true;
  const auto& points = result.gearings;
  constexpr auto at = &SizePoint::at_gearing;
  PlotPanel time{.y_label = "Time (s)"};
  time.lines.push_back(over(points, at, "", time_of, measured_color));
  if (PlotLine bad = bad_ones(points, at, time_of); !bad.x.empty()) {
    time.lines.push_back(std::move(bad));
  }
  time.lines.push_back({.label = "best",
                        .x = {result.best.gearing},
                        .y = {result.best.travel.time},
                        .style = LineStyle::circles,
                        .color = simulated_color});
  if (result.given) {
    time.lines.push_back({.label = "given",
                          .x = {result.given->gearing},
                          .y = {result.given->travel.time},
                          .style = LineStyle::squares,
                          .color = voltage_color});
  }
  time.spans.push_back({result.low, result.high, "within 2 %"});
  PlotPanel current{.y_label = "Peak current (A)"};
  current.lines.push_back(over(points, at, "windings", current_of, measured_color));
  current.lines.push_back(
      over(points, at, "battery", supply_of, simulated_color, LineStyle::dashed));
  if (!result.job.travel.speed && result.best.holding_current > 0.0) {
    current.lines.push_back(
        over(points, at, "to hold it", holding_of, voltage_color, LineStyle::dotted));
  }
  PlotPanel rail = rail_panel(result, {over(points, at, "", rail_of, measured_color)});
  PlotPanel energy{.y_label = "Energy (J)"};
  energy.lines.push_back(over(points, at, "taken", energy_of, measured_color));
  energy.lines.push_back(
      over(points, at, "heat in the windings", heat_of, simulated_color, LineStyle::dashed));
  plot.panels = {std::move(time), std::move(current), std::move(rail), std::move(energy)};
  if (result.job.travel.winding.is_known()) {
    PlotPanel warmth{.y_label = "Windings (°C)"};
    warmth.lines.push_back(over(points, at, "", warmth_of, measured_color));
    warmth.marks.push_back({result.job.temperature_limit, "limit", false});
    plot.panels.push_back(std::move(warmth));
  }
  return figure;
}

/// A column of the best motion, and of the given one.
PlotPanel motion_panel(const SizeResult& result, const std::string& column,
                       const std::string& label) {
  PlotPanel panel{.y_label = label};
  if (const auto* values = result.motion.find(column)) {
    panel.lines.push_back(line("best", result.motion.time(), *values, measured_color));
  }
  if (result.given_motion) {
    if (const auto* values = result.given_motion->find(column)) {
      panel.lines.push_back(
          line("given", result.given_motion->time(), *values, quiet_color, LineStyle::dashed));
    }
  }
  return panel;
}

Figure motion_figure(const SizeResult& result) {
  Figure figure = over_time(
      "motion", "motion", "The fastest motion",
      fmt::format(
          "The fastest motion at the best gearing, {}{}.", text::number(result.best.gearing, 3),
          result.given_motion
              ? fmt::format(", and at the given one, {}", text::number(result.given->gearing, 3))
              : ""));
  figure.plot.clock = size_clock;
  if (!result.job.travel.speed) {
    figure.plot.panels.push_back(
        motion_panel(result, "position", fmt::format("Position ({})", way_unit(result))));
  }
  figure.plot.panels.push_back(
      motion_panel(result, "velocity", fmt::format("Velocity ({})", speed_unit(result))));
  figure.plot.panels.push_back(motion_panel(result, "voltage", "Voltage (V)"));
  figure.plot.panels.push_back(motion_panel(result, "current", "Windings (A)"));
  figure.plot.panels.push_back(motion_panel(result, "supply_current", "Battery (A)"));
  PlotPanel rail = motion_panel(result, "rail", "Rail (V)");
  figure.plot.panels.push_back(std::move(rail));
  if (result.job.travel.winding.is_known()) {
    figure.plot.panels.push_back(motion_panel(result, "temperature", "Windings (°C)"));
  }
  return figure;
}

Figure sweep_figure(const SizeResult& result, const SizeSweep& sweep) {
  const std::string at =
      text::number(result.given ? result.given->gearing : result.best.gearing, 3);
  Figure figure{
      "sweeps",
      sweep.name,
      fmt::format("Against the {}", lowered(sweep.title)),
      fmt::format("The time against the {}: at the gearing {} and at the one that is best "
                  "for each value, which is drawn below.",
                  lowered(sweep.title), at),
      {}};
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = fmt::format("{} ({})", sweep.title, sweep.unit);
  plot.log_x = true;
  PlotPanel time{.y_label = "Time (s)"};
  time.lines.push_back(over(sweep.points, &SizePoint::at_gearing, fmt::format("gearing {}", at),
                            time_of, measured_color));
  time.lines.push_back(over(sweep.points, &SizePoint::at_best, "its best gearing", time_of,
                            simulated_color, LineStyle::dashed));
  PlotPanel gearing{.y_label = "Best gearing"};
  gearing.lines.push_back(over(sweep.points, &SizePoint::at_best, "", gearing_of, simulated_color));
  PlotPanel rail = rail_panel(result, {over(sweep.points, &SizePoint::at_gearing,
                                            fmt::format("gearing {}", at), rail_of, measured_color),
                                       over(sweep.points, &SizePoint::at_best, "its best gearing",
                                            rail_of, simulated_color, LineStyle::dashed)});
  plot.panels = {std::move(time), std::move(gearing), std::move(rail)};
  if (std::isfinite(sweep.here)) {
    for (PlotPanel& panel : plot.panels) {
      panel.marks.push_back({sweep.here, &panel == plot.panels.data() ? "here" : "", true});
    }
  }
  return figure;
}

}  // namespace

std::vector<Figure> figures_of(const SizeResult& result) {
  std::vector<Figure> figures{gearing_figure(result), motion_figure(result)};
  for (const SizeSweep& sweep : result.sweeps) {
    figures.push_back(sweep_figure(result, sweep));
  }
  return figures;
}

}  // namespace flyball::study
