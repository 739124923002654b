// The gains' intervals beside each other.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::GainEstimate;

/// A gain that is determined, and the one-step regression's value of it.
struct Shown {
  std::string name;
  const GainEstimate* gain;
  double one_step;
};

std::vector<Shown> shown_gains(const std::string& prefix, const FeedforwardFit& fit) {
  std::vector<Shown> shown;
  const identification::OneStepFit none{.kS = NAN, .kV = NAN, .kA = NAN, .kG = NAN};
  const auto one = fit.one_step.value_or(none);
  const auto add = [&](const std::string& name, const GainEstimate& gain, const std::string& unit,
                       double one_step) {
    if (gain.determined && gain.value != 0.0 && std::isfinite(gain.value)) {
      shown.push_back({fmt::format("{}{} {} {}", prefix, name, text::number(gain.value, 3), unit),
                       &gain, one_step});
    }
  };
  add("kS", fit.kS, "V", one.kS);
  add("kV", fit.kV, "V·s/" + fit.unit, one.kV);
  add("kA", fit.kA, "V·s²/" + fit.unit, one.kA);
  if (fit.kG) {
    add("kG", *fit.kG, "V", one.kG);
  }
  for (const identification::ModelTerm& term : fit.terms) {
    std::string name = term.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    add(name, term.value, term.unit, NAN);
  }
  return shown;
}

}  // namespace

std::vector<Figure> interval_figures(
    const std::vector<std::pair<std::string, const FeedforwardFit*>>& fits) {
  std::vector<Shown> gains;
  for (const auto& [prefix, fit] : fits) {
    append(gains, shown_gains(prefix, *fit));
  }
  if (gains.empty()) {
    return {};
  }
  PlotPanel panel{.y_label = "Gain", .marks = {{.at = 0.0, .vertical = true}}};
  PlotLine intervals{.label = "95 % interval", .color = measured_color};
  PlotLine values{.label = "value", .style = LineStyle::squares, .color = measured_color};
  PlotLine one_step{
      .label = "one-step regression", .style = LineStyle::crosses, .color = simulated_color};
  double widest = 0.0;
  const auto percent = [](double value, const GainEstimate& of) {
    return 100.0 * (value - of.value) / std::abs(of.value);
  };
  for (const Shown& shown : gains) {
    for (const double end : shown.gain->interval) {
      widest = std::max(widest, std::abs(percent(end, *shown.gain)));
    }
  }
  double row = static_cast<double>(gains.size());
  for (const auto& [name, gain, one] : gains) {
    panel.y_ticks.push_back({row, name});
    for (const double end : gain->interval) {
      intervals.x.push_back(percent(end, *gain));
      intervals.y.push_back(row);
    }
    intervals.x.push_back(NAN);
    intervals.y.push_back(NAN);
    values.x.push_back(0.0);
    values.y.push_back(row);
    // Far ones would leave nothing of the intervals.
    if (std::abs(percent(one, *gain)) <= 3.0 * widest) {
      one_step.x.push_back(percent(one, *gain));
      one_step.y.push_back(row);
    }
    row -= 1.0;
  }
  panel.y_limits = PlotLimits{0.4, static_cast<double>(gains.size()) + 0.6};
  panel.lines = {std::move(intervals), std::move(values)};
  if (!one_step.x.empty()) {
    panel.lines.push_back(std::move(one_step));
  }
  Figure figure{"gains",
                "intervals",
                "How sure the gains are",
                "Each gain's 95 % interval, as a share of its value: the narrower, the surer. A "
                "one-step regression that lies close by is beside it.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = "Off the value (%)";
  figure.plot.height = 150 + 34 * static_cast<int>(gains.size());
  figure.plot.panels = {std::move(panel)};
  return {std::move(figure)};
}

}  // namespace flyball::study
