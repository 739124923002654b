// Pictures of the loop as it runs: in frequency, and after a small step.
#include <utility>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/frequency_figures.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

OpenedLoop opened(const DesignResult& result) {
  const LoopMargins& margins = result.margins;
  OpenedLoop loop{.section = "robustness",
                  .response = result.frequency_response,
                  .crossover = margins.crossover};
  // Of an open kA the margins are the smallest over it, not this curve's.
  if (!result.velocity_servo) {
    loop.phase_margin = margins.phase_margin;
    loop.gain_margin = margins.gain_margin;
  }
  return loop;
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
    figures.push_back(bode_figure(opened(result)));
    figures.push_back(nyquist_figure(opened(result)));
  }
  return figures;
}

}  // namespace flyball::study
