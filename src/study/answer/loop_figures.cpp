// Pictures of the loop as it runs: in frequency, and after a small step.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using std::numbers::pi;

double degrees(double radians) {
  return radians * 180.0 / pi;
}

/// Where a quantity along the response first crosses a level, straight between its points.
template <class Of>
std::optional<double> crossing(const std::vector<LoopPoint>& response, double level, const Of& of) {
  for (std::size_t i = 1; i < response.size(); ++i) {
    const double before = of(response[i - 1]) - level;
    const double after = of(response[i]) - level;
    if (before > 0.0 && after <= 0.0) {
      const double share = before / (before - after);
      return response[i - 1].frequency *
             std::pow(response[i].frequency / response[i - 1].frequency, share);
    }
  }
  return std::nullopt;
}

Figure bode_figure(const DesignResult& result) {
  Figure figure{"robustness",
                "bode",
                "Bode plot of the opened loop",
                "Gain and phase of the loop opened at the plant input, with the delay in it, up to "
                "half the sampling frequency. Where the gain is 0 dB, what the phase is above "
                "−180° is the phase margin; where the phase is −180°, what the gain is below 0 dB "
                "is the gain margin.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Frequency (rad/s)";
  figure.plot.log_x = true;
  PlotPanel gain{.y_label = "Gain (dB)", .marks = {{.at = 0.0}}};
  PlotPanel phase{.y_label = "Phase (°)", .marks = {{.at = -180.0}}};
  PlotLine gains{.color = measured_color};
  PlotLine phases{.color = quiet_color};
  for (const LoopPoint& point : result.frequency_response) {
    for (PlotLine* line : {&gains, &phases}) {
      line->x.push_back(point.frequency);
    }
    gains.y.push_back(20.0 * std::log10(point.gain));
    phases.y.push_back(degrees(point.phase));
  }
  // Of an open kA the margins are the smallest over it, not this curve's.
  const LoopMargins& margins = result.margins;
  const auto said = [&](const std::string& words) {
    return result.velocity_servo ? std::string() : words;
  };
  if (margins.crossover > 0.0) {
    phase.marks.push_back(
        {margins.crossover,
         said(fmt::format("phase margin {}°", text::number(degrees(margins.phase_margin), 3))),
         true});
    gain.marks.push_back({margins.crossover, "", true});
  }
  const auto turned =
      crossing(result.frequency_response, -pi, [](const LoopPoint& point) { return point.phase; });
  if (turned && std::isfinite(margins.gain_margin)) {
    gain.marks.push_back(
        {*turned,
         said(fmt::format("gain margin {} dB",
                          text::number(20.0 * std::log10(margins.gain_margin), 3))),
         true});
    phase.marks.push_back({*turned, "", true});
  }
  gain.lines = {std::move(gains)};
  phase.lines = {std::move(phases)};
  figure.plot.panels = {std::move(gain), std::move(phase)};
  return figure;
}

Figure nyquist_figure(const DesignResult& result) {
  Figure figure{"robustness",
                "nyquist",
                "Nyquist curve of the opened loop",
                "The same loop in the complex plane, cut off far from the origin. The farther the "
                "curve stays from −1, the more the mechanism may differ from its model; the circle "
                "is a gain of one.",
                {}};
  figure.plot = {.title = figure.title,
                 .x_label = "Real part",
                 .equal_axes = true,
                 .unit_circle = true,
                 .width = 640};
  constexpr double far = 3.0;
  PlotLine curve{.label = "L", .color = measured_color};
  PlotLine mirrored{
      .label = "negative frequencies", .style = LineStyle::dashed, .color = measured_color};
  for (const LoopPoint& point : result.frequency_response) {
    if (point.gain <= far) {
      curve.x.push_back(point.gain * std::cos(point.phase));
      curve.y.push_back(point.gain * std::sin(point.phase));
    }
  }
  mirrored.x = curve.x;
  std::transform(curve.y.begin(), curve.y.end(), std::back_inserter(mirrored.y),
                 [](double y) { return -y; });
  figure.plot.panels = {
      {.y_label = "Imaginary part",
       .lines = {std::move(curve),
                 std::move(mirrored),
                 {.label = "−1", .x = {-1.0}, .y = {0.0}, .style = LineStyle::crosses, .color = 1}},
       .marks = {{.at = 0.0, .vertical = true}, {.at = 0.0}}}};
  return figure;
}

Figure step_figure(const DesignResult& result) {
  const LoopBehavior& loop = result.loop;
  Figure figure = over_time(
      "controller", "small_step", "A small step of the loop as it runs",
      "The controlled output after a step of its reference that is so small that no limit is "
      "reached, as a share of where it ends; it has settled where it stays in the band of 2 %.");
  PlotLine step{.style = LineStyle::samples, .color = measured_color};
  const double end = loop.settling_time ? 1.8 * *loop.settling_time : loop.step_time.back();
  for (std::size_t i = 0; i < loop.step.size() && (loop.step_time[i] <= end || i < 10); ++i) {
    step.x.push_back(loop.step_time[i]);
    step.y.push_back(loop.step[i]);
  }
  PlotBand settled{.label = "within 2 %", .x = step.x, .color = quiet_color};
  settled.low.assign(step.x.size(), 0.98);
  settled.high.assign(step.x.size(), 1.02);
  PlotPanel panel{.y_label = "Share of the step", .lines = {std::move(step)}};
  panel.bands = {std::move(settled)};
  if (loop.settling_time) {
    panel.marks.push_back(
        {*loop.settling_time, "settled after " + text::seconds(*loop.settling_time), true});
  }
  figure.plot.panels = {std::move(panel)};
  return figure;
}

}  // namespace

std::vector<Figure> loop_figures(const DesignResult& result) {
  std::vector<Figure> figures;
  if (!result.loop.step.empty()) {
    figures.push_back(step_figure(result));
  }
  if (!result.frequency_response.empty()) {
    figures.push_back(bode_figure(result));
    figures.push_back(nyquist_figure(result));
  }
  return figures;
}

}  // namespace flyball::study
