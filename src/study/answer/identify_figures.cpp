// Pictures and tables of a log and its fit.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

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

Figure fitted_figure(const IdentifyResult& result, const FittedRun& run, const TestRun& recorded) {
  const std::string rate = result.unit + "/s";
  Figure figure = over_time(
      "gains", run_name("fit", run.source, run.kind),
      fmt::format("Run {}: {}{}", run.source + 1, to_string(run.kind), by_hand(recorded)),
      fmt::format("Measured velocity against the velocity simulated in free run from the recorded "
                  "voltage, their difference where the velocity is new, and "
                  "the voltage, over {}.",
                  text::seconds(run.time.empty() ? 0.0 : run.time.back() - run.time.front())));
  figure.plot.panels = {
      panel({"Velocity", rate}, {line("measured", run.time, run.velocity, measured_color),
                                 line("simulated", run.time, run.velocity_hat, simulated_color)}),
      panel({"Residual", rate},
            {line("measured − simulated", at_rows(run.time, run.fresh),
                  at_rows(run.velocity_residual, run.fresh), quiet_color)},
            true),
      panel({"Voltage", "V"}, {line("", run.time, run.voltage, voltage_color)}, true)};
  return figure;
}

Figure recorded_figure(const IdentifyResult& result, const PreparedRun& prepared) {
  const TestRun& run = prepared.run;
  Figure figure = over_time("data", run_name("recorded", prepared.source, run.kind),
                            fmt::format("Run {}: {}, as recorded{}", prepared.source + 1,
                                        to_string(run.kind), by_hand(run)),
                            "Voltage, velocity and position as the log has them.");
  const auto add = [&](const Coordinate& shown, const std::vector<double>& values, int color) {
    if (!values.empty()) {
      figure.plot.panels.push_back(panel(shown, {line("", run.time, values, color)}));
    }
  };
  add({"Voltage", "V"}, run.voltage, voltage_color);
  add({"Velocity", result.unit + "/s"}, run.velocity, measured_color);
  add({"Position", result.unit}, run.position, measured_color);
  return figure;
}

/// Adds a column if it fits the clock; runs without a channel have an empty one.
void add(TimeSeries& series, std::string name, std::string unit,
         const std::vector<double>& values) {
  if (values.size() == series.rows() && !values.empty()) {
    static_cast<void>(series.add(std::move(name), std::move(unit), values));
  }
}

std::string run_csv(const FittedRun& run, const std::string& unit) {
  TimeSeries series(run.time);
  const std::string rate = unit + "/s";
  add(series, "voltage", "V", run.voltage);
  add(series, "velocity", rate, run.velocity);
  add(series, "velocity_simulated", rate, run.velocity_hat);
  add(series, "velocity_residual", rate, run.velocity_residual);
  add(series, "position", unit, run.position);
  add(series, "position_simulated", unit, run.position_hat);
  return to_csv(series);
}

std::string run_csv(const TestRun& run, const std::string& unit) {
  TimeSeries series(run.time);
  add(series, "voltage", "V", run.voltage);
  add(series, "velocity", unit + "/s", run.velocity);
  add(series, "position", unit, run.position);
  return to_csv(series);
}

}  // namespace

std::vector<Figure> figures_of(const IdentifyResult& result) {
  if (result.drive) {
    return drive_figures(result);
  }
  std::vector<Figure> figures;
  for (const PreparedRun& prepared : shown_runs(result)) {
    const FittedRun* fitted = fitted_run(result, prepared.source);
    const bool simulated = fitted != nullptr && fitted->used && !fitted->time.empty() &&
                           fitted->velocity_hat.size() == fitted->time.size();
    figures.push_back(simulated ? fitted_figure(result, *fitted, prepared.run)
                                : recorded_figure(result, prepared));
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
