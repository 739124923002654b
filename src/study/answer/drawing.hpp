#pragma once

#include <optional>
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
constexpr int unused_color = 6;

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

/// Times counted from a beginning.
[[nodiscard]] std::vector<double> since(double beginning, const std::vector<double>& time);

/// Where four fifths of a curve's ups and downs are, with some room, if that is less than a quarter
/// of its time: too short to be read where the whole is shown.
[[nodiscard]] std::optional<PlotLimits> transient_of(const std::vector<double>& time,
                                                     const std::vector<double>& value);

/// A stretch of a figure over time as a figure of its own, "…, its transient".
[[nodiscard]] Figure transient(const Figure& whole, const PlotLimits& stretch);

}  // namespace flyball::study
