// Pictures and tables of a log and its fit.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

using identification::FittedRun;
using identification::PreparedRun;
using identification::TestRun;

std::string run_name(std::string_view prefix, std::size_t source, identification::TestKind kind) {
  return fmt::format("{}_{}_{}", prefix, source + 1, to_string(kind));
}

std::vector<double> at_rows(const std::vector<double>& values,
                            const std::vector<std::size_t>& rows) {
  std::vector<double> picked(rows.size());
  std::transform(rows.begin(), rows.end(), picked.begin(),
                 [&](std::size_t row) { return values[row]; });
  return picked;
}

/// ", 500 ms to 3 s by hand" of a run that a person trimmed.
std::string by_hand(const TestRun& run) {
  if (run.left_out) {
    return ", left out by hand";
  }
  if (!run.is_trimmed() || run.time.empty()) {
    return "";
  }
  const double end = std::isfinite(run.to) ? run.to : run.from + run.time.back() - run.time.front();
  return fmt::format(", {} to {} by hand", text::seconds(run.from), text::seconds(end));
}

/// When the test began, on the log's clock: its first row, also one that a person cut.
double beginning(const PreparedRun& prepared) {
  const TestRun& run = prepared.run;
  return run.time.empty() ? 0.0 : run.time.front() - (prepared.begins_cut ? run.from : 0.0);
}

/// The rows of a run's window that have a residual: those with a new value, not where the sensors
/// look back before the start of a run that begins in motion.
std::vector<std::size_t> compared_rows(const PreparedRun& prepared, const FittedRun& run) {
  const double settling = prepared.starts_at_rest ? 0.0 : identification::FitOptions().settling;
  std::vector<std::size_t> rows;
  std::copy_if(run.fresh.begin(), run.fresh.end(), std::back_inserter(rows),
               [&](std::size_t row) { return run.time[row] >= run.time.front() + settling; });
  return rows;
}

/// The rows of a velocity that the fit did not use, as far as the axis of the used ones shows them:
/// where a mechanism stalls or falls, they would leave nothing of the others.
PlotLine unused_rows(const PreparedRun& prepared, const FittedRun& run, double begin) {
  const std::vector<double>& velocity =
      prepared.run.velocity.empty() ? prepared.smoothed_velocity : prepared.run.velocity;
  const auto [least, greatest] = std::minmax_element(run.velocity.begin(), run.velocity.end());
  const double room = 0.5 * (*greatest - *least);
  PlotLine rows{.label = not_used, .style = LineStyle::dotted, .color = unused_color};
  for (std::size_t i = 0; i < std::min(velocity.size(), prepared.run.time.size()); ++i) {
    const double time = prepared.run.time[i];
    // Joined to the used ones, where there are some beyond.
    const double first = run.time.front();
    const double last = run.time.back();
    const bool used = (time > first || first <= prepared.run.time.front()) &&
                      (time < last || last >= prepared.run.time.back());
    const bool shown = velocity[i] >= *least - room && velocity[i] <= *greatest + room;
    rows.x.push_back(time - begin);
    rows.y.push_back(!used && shown ? velocity[i] : NAN);
  }
  return rows;
}

/// Whole, as recorded; what the fit did not use is marked, and has no residual.
Figure fitted_figure(const IdentifyResult& result, const FittedRun& run,
                     const PreparedRun& prepared) {
  const std::string rate = result.unit + "/s";
  const TestRun& recorded = prepared.run;
  const double begin = beginning(prepared);
  const std::vector<double> time = since(begin, run.time);
  const std::vector<double> whole = since(begin, recorded.time);
  const std::vector<std::size_t> compared = compared_rows(prepared, run);
  Figure figure = over_time(
      "gains", run_name("fit", run.source, run.kind),
      fmt::format("Run {}: {}{}", run.source + 1, to_string(run.kind), by_hand(recorded)),
      fmt::format("Measured velocity and, dashed, the velocity simulated in free run from the "
                  "recorded voltage; their difference in the rows that the fit compares; the "
                  "voltage. Time counts from the start of the test; the fit uses {} of its {}.",
                  text::seconds(time.back() - time.front()),
                  text::seconds(whole.back() - whole.front())));
  std::vector<PlotSpan> unused;
  if (time.front() > whole.front()) {
    unused.push_back({whole.front(), time.front(), not_used});
  }
  if (time.back() < whole.back()) {
    unused.push_back({time.back(), whole.back(), not_used});
  }
  PlotPanel velocity = panel({"Velocity", rate}, {});
  if (!unused.empty()) {
    velocity.lines.push_back(unused_rows(prepared, run, begin));
  }
  velocity.lines.push_back(line("measured", time, run.velocity, measured_color));
  velocity.lines.push_back(
      line("simulated", time, run.velocity_hat, simulated_color, LineStyle::dashed));
  figure.plot.panels = {
      std::move(velocity),
      panel({"Residual", rate},
            {line("measured − simulated", at_rows(time, compared),
                  at_rows(run.velocity_residual, compared), quiet_color)},
            true),
      panel({"Voltage", "V"}, {line("", whole, recorded.voltage, voltage_color)}, true)};
  for (PlotPanel& shown : figure.plot.panels) {
    shown.spans = unused;
  }
  // Said once; where the velocity is, its curve says it.
  for (const std::size_t panel : {0U, 2U}) {
    for (PlotSpan& span : figure.plot.panels[panel].spans) {
      span.label.clear();
    }
  }
  return figure;
}

Figure recorded_figure(const IdentifyResult& result, const PreparedRun& prepared) {
  const TestRun& run = prepared.run;
  Figure figure = over_time("data", run_name("recorded", prepared.source, run.kind),
                            fmt::format("Run {}: {}, as recorded{}", prepared.source + 1,
                                        to_string(run.kind), by_hand(run)),
                            "Voltage, velocity and position as the log has them; time counts from "
                            "the start of the test.");
  const std::vector<double> time = since(beginning(prepared), run.time);
  const auto add_run = [&](const Coordinate& shown, const std::vector<double>& values, int color) {
    if (!values.empty()) {
      figure.plot.panels.push_back(panel(shown, {line("", time, values, color)}));
    }
  };
  add_run({"Voltage", "V"}, run.voltage, voltage_color);
  add_run({"Velocity", result.unit + "/s"}, run.velocity, measured_color);
  add_run({"Position", result.unit}, run.position, measured_color);
  return figure;
}

/// Adds a column if it fits the clock; runs without a channel have an empty one.
void add_run(TimeSeries& series, std::string name, std::string unit,
             const std::vector<double>& values) {
  if (values.size() == series.rows() && !values.empty()) {
    static_cast<void>(series.add(std::move(name), std::move(unit), values));
  }
}

std::string run_csv(const FittedRun& run, const std::string& unit) {
  TimeSeries series(run.time);
  const std::string rate = unit + "/s";
  add_run(series, "voltage", "V", run.voltage);
  add_run(series, "velocity", rate, run.velocity);
  add_run(series, "velocity_simulated", rate, run.velocity_hat);
  add_run(series, "velocity_residual", rate, run.velocity_residual);
  add_run(series, "position", unit, run.position);
  add_run(series, "position_simulated", unit, run.position_hat);
  return to_csv(series);
}

std::string run_csv(const TestRun& run, const std::string& unit) {
  TimeSeries series(run.time);
  add_run(series, "voltage", "V", run.voltage);
  add_run(series, "velocity", unit + "/s", run.velocity);
  add_run(series, "position", unit, run.position);
  return to_csv(series);
}

/// How far a run's simulation is from what was measured, of the speed's own size; 0 without one.
double miss_of(const FittedRun* run) {
  if (run == nullptr || !run->used) {
    return 0.0;
  }
  double error = 0.0;
  double square = 0.0;
  for (const std::size_t row : run->fresh) {
    error += run->velocity_residual[row] * run->velocity_residual[row];
    square += run->velocity[row] * run->velocity[row];
  }
  return square > 0.0 ? error / square : 0.0;
}

}  // namespace

std::vector<PreparedRun> pictured_runs(const IdentifyResult& result) {
  std::vector<PreparedRun> runs = shown_runs(result);
  if (runs.size() <= most_pictured) {
    return runs;
  }
  const auto rest = runs.begin() + most_pictured / 2;
  std::vector<std::pair<double, std::size_t>> misses;
  for (auto run = rest; run != runs.end(); ++run) {
    misses.emplace_back(-miss_of(fitted_run(result, run->source)),
                        static_cast<std::size_t>(run - runs.begin()));
  }
  const auto end = misses.begin() + most_pictured / 2;
  std::partial_sort(misses.begin(), end, misses.end());
  std::vector<std::size_t> worst;
  std::transform(misses.begin(), end, std::back_inserter(worst),
                 [](const auto& miss) { return miss.second; });
  std::sort(worst.begin(), worst.end());
  std::vector<PreparedRun> chosen(runs.begin(), rest);
  for (const std::size_t at : worst) {
    chosen.push_back(std::move(runs[at]));
  }
  return chosen;
}

std::vector<Figure> figures_of(const IdentifyResult& result) {
  if (result.drive) {
    return drive_figures(result);
  }
  std::vector<Figure> figures;
  if (result.report.fit) {
    figures = interval_figures({{"", &*result.report.fit}});
  }
  for (const PreparedRun& prepared : pictured_runs(result)) {
    const FittedRun* fitted = fitted_run(result, prepared.source);
    const bool simulated = fitted != nullptr && fitted->used && !fitted->time.empty() &&
                           fitted->velocity_hat.size() == fitted->time.size();
    figures.push_back(simulated ? fitted_figure(result, *fitted, prepared)
                                : recorded_figure(result, prepared));
    if (const auto stretch =
            simulated ? transient_of(since(beginning(prepared), fitted->time), fitted->velocity_hat)
                      : std::nullopt) {
      figures.push_back(transient(figures.back(), *stretch));
    }
  }
  return figures;
}

std::vector<AnswerFile> data_files(const IdentifyResult& result) {
  if (result.drive) {
    return drive_files(result);
  }
  std::vector<AnswerFile> files = signal_log(result);
  for (const PreparedRun& prepared : shown_runs(result)) {
    const FittedRun* fitted = fitted_run(result, prepared.source);
    files.push_back(
        {fmt::format("data/{}.csv", run_name("run", prepared.source, prepared.run.kind)),
         fitted != nullptr && fitted->used ? run_csv(*fitted, result.unit)
                                           : run_csv(prepared.run, result.unit)});
  }
  return files;
}

}  // namespace flyball::study
