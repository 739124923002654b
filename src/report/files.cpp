#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "report/files.hpp"
#include "report/format.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

using identification::FittedRun;
using identification::PreparedRun;

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

std::string run_csv(const identification::TestRun& run, const std::string& unit) {
  TimeSeries series(run.time);
  add(series, "voltage", "V", run.voltage);
  add(series, "velocity", unit + "/s", run.velocity);
  add(series, "position", unit, run.position);
  return to_csv(series);
}

}  // namespace

std::vector<ReportFile> data_files(const study::IdentifyResult& result) {
  std::vector<ReportFile> files;
  for (const PreparedRun& prepared : shown_runs(result)) {
    const FittedRun* fitted = nullptr;
    if (result.report.fit) {
      for (const FittedRun& run : result.report.fit->runs) {
        fitted = run.source == prepared.source && run.used ? &run : fitted;
      }
    }
    const std::string name =
        fmt::format("data/run_{}_{}.csv", prepared.source + 1, to_string(prepared.run.kind));
    files.push_back({name, fitted != nullptr ? run_csv(*fitted, result.unit)
                                             : run_csv(prepared.run, result.unit)});
  }
  return files;
}

std::vector<ReportFile> data_files(const study::DesignResult& result) {
  std::vector<ReportFile> files;
  if (result.response.rows() > 0) {
    files.push_back({"data/closed_loop.csv", to_csv(result.response)});
  }
  if (!result.robustness.empty()) {
    std::string grid = "inertia_factor,gain_factor,stable,spectral_radius,overshoot\n";
    for (const study::RobustnessPoint& point : result.robustness) {
      grid += fmt::format("{},{},{},{},{}\n", exact(point.inertia_factor), exact(point.gain_factor),
                          point.stable ? "true" : "false", exact(point.spectral_radius),
                          exact(point.overshoot));
    }
    files.push_back({"data/robustness.csv", std::move(grid)});
  }
  return files;
}

}  // namespace flyball::report
