// Responses over frequency: Bode plots and Nyquist curves.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/frequency_figures.hpp"

namespace flyball::study {

namespace {

double in_degrees(double radians) {
  return radians * 180.0 / pi;
}

/// Where the phase first falls through -180°, or that less whole turns: straight between points.
std::optional<double> phase_crossing(const std::vector<FrequencyPoint>& response) {
  for (std::size_t i = 1; i < response.size(); ++i) {
    const double before = response[i - 1].phase + pi;
    const double after = response[i].phase + pi;
    if (before > 0.0 && after <= 0.0) {
      const double share = before / (before - after);
      return response[i - 1].frequency *
             std::pow(response[i].frequency / response[i - 1].frequency, share);
    }
  }
  return std::nullopt;
}

/// The response with the phase, of all that are whole turns apart, that is next to -180° where it
/// matters.
std::vector<FrequencyPoint> about_half_a_turn(std::vector<FrequencyPoint> response,
                                              double crossover) {
  const auto at = std::lower_bound(
      response.begin(), response.end(), crossover,
      [](const FrequencyPoint& point, double frequency) { return point.frequency < frequency; });
  if (at != response.end()) {
    const double shift = 2.0 * pi * std::round((-pi - at->phase) / (2.0 * pi));
    for (FrequencyPoint& point : response) {
      point.phase += shift;
    }
  }
  return response;
}

}  // namespace

Plot bode_plot(std::string title) {
  return {.title = std::move(title),
          .x_label = "Frequency (rad/s)",
          .panels = {{.y_label = "Gain (dB)", .marks = {{.at = 0.0}}},
                     {.y_label = "Phase (°)", .marks = {{.at = -180.0}}}},
          .log_x = true};
}

void add_response(Plot& bode, const std::vector<FrequencyPoint>& response, std::string label,
                  int color) {
  PlotLine gains{.label = std::move(label), .color = color};
  PlotLine phases{.color = color};
  double largest = 0.0;
  for (const FrequencyPoint& point : response) {
    largest = std::max(largest, point.gain);
  }
  constexpr double rounding = 1e-13;
  for (const FrequencyPoint& point : response) {
    // A zero on the way has no decibels and no phase, and what rounding leaves of one neither.
    const bool shown = point.gain > rounding * largest;
    gains.x.push_back(point.frequency);
    gains.y.push_back(shown ? 20.0 * std::log10(point.gain) : NAN);
    phases.y.push_back(shown ? in_degrees(point.phase) : NAN);
  }
  phases.x = gains.x;
  bode.panels[0].lines.push_back(std::move(gains));
  bode.panels[1].lines.push_back(std::move(phases));
}

Figure bode_figure(const OpenedLoop& loop) {
  Figure figure{loop.section,
                "bode" + loop.name,
                "Bode plot of the opened loop" + loop.where,
                "Gain and phase of the loop opened at the plant input, with the delay in it, up to "
                "half the sampling frequency. Where the gain is 0 dB, what the phase is above "
                "−180° is the phase margin; where the phase is −180°, what the gain is below 0 dB "
                "is the gain margin.",
                {}};
  figure.plot = bode_plot(figure.title);
  const std::vector<FrequencyPoint> response =
      loop.crossover ? about_half_a_turn(loop.response, *loop.crossover) : loop.response;
  add_response(figure.plot, response, "", measured_color);
  PlotPanel& gain = figure.plot.panels[0];
  PlotPanel& phase = figure.plot.panels[1];
  phase.lines[0].color = quiet_color;
  if (loop.crossover && *loop.crossover > 0.0) {
    phase.marks.push_back(
        {*loop.crossover,
         loop.phase_margin
             ? fmt::format("phase margin {}°", text::number(in_degrees(*loop.phase_margin), 3))
             : "",
         true});
    gain.marks.push_back({*loop.crossover, "", true});
  }
  const auto turned = loop.turned ? loop.turned : phase_crossing(response);
  if (turned && (!loop.gain_margin || std::isfinite(*loop.gain_margin))) {
    gain.marks.push_back({*turned,
                          loop.gain_margin
                              ? fmt::format("gain margin {} dB",
                                            text::number(20.0 * std::log10(*loop.gain_margin), 3))
                              : "",
                          true});
    phase.marks.push_back({*turned, "", true});
  }
  return figure;
}

Plot nyquist_plot(std::string title, std::string label,
                  const std::vector<FrequencyPoint>& response) {
  constexpr double far = 3.0;
  PlotLine curve{.label = std::move(label), .color = measured_color};
  PlotLine mirrored{
      .label = "negative frequencies", .style = LineStyle::dashed, .color = measured_color};
  bool near = true;
  for (const FrequencyPoint& point : response) {
    if (point.gain <= far) {
      if (!near && !curve.x.empty()) {
        curve.x.push_back(NAN);  // it was far away in between
        curve.y.push_back(NAN);
      }
      curve.x.push_back(point.gain * std::cos(point.phase));
      curve.y.push_back(point.gain * std::sin(point.phase));
    }
    near = point.gain <= far;
  }
  mirrored.x = curve.x;
  std::transform(curve.y.begin(), curve.y.end(), std::back_inserter(mirrored.y),
                 [](double y) { return -y; });
  Plot plot{.title = std::move(title),
            .x_label = "Real part",
            .equal_axes = true,
            .unit_circle = true,
            .width = 640};
  plot.panels = {
      {.y_label = "Imaginary part",
       .lines = {std::move(curve),
                 std::move(mirrored),
                 {.label = "−1", .x = {-1.0}, .y = {0.0}, .style = LineStyle::crosses, .color = 1}},
       .marks = {{.at = 0.0, .vertical = true}, {.at = 0.0}}}};
  return plot;
}

Figure nyquist_figure(const OpenedLoop& loop) {
  const std::string title = "Nyquist curve of the opened loop" + loop.where;
  return {loop.section, "nyquist" + loop.name, title,
          "The same loop in the complex plane, cut off far from the origin. The farther the "
          "curve stays from −1, the more the mechanism may differ from its model; the circle "
          "is a gain of one.",
          nyquist_plot(title, "L", loop.response)};
}

}  // namespace flyball::study
