#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/core/coordinate.hpp>
#include <flyball/core/figure.hpp>
#include <flyball/core/time_series.hpp>

/// Pieces of the answers' pictures.
namespace flyball::study {

/// Colours mean the same in all pictures.
constexpr int measured_color = 0;
constexpr int simulated_color = 1;
constexpr int quiet_color = 2;
constexpr int voltage_color = 3;

/// A picture over time, without panels yet.
[[nodiscard]] inline Figure over_time(std::string section, std::string name, std::string title,
                                      std::string description) {
  Figure figure{std::move(section), std::move(name), std::move(title), std::move(description), {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  return figure;
}

[[nodiscard]] inline PlotLine line(std::string label, const std::vector<double>& x,
                                   const std::vector<double>& y, int color,
                                   LineStyle style = LineStyle::solid) {
  return {std::move(label), x, y, style, color};
}

/// @param zero  Whether a thin line marks zero.
[[nodiscard]] inline PlotPanel panel(const Coordinate& shown, std::vector<PlotLine> lines,
                                     bool zero = false) {
  PlotPanel made;
  made.y_label = label(shown);
  made.lines = std::move(lines);
  if (zero) {
    made.marks.push_back({0.0, "", false});
  }
  return made;
}

}  // namespace flyball::study
