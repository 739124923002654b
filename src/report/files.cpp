#include <algorithm>

#include <fmt/format.h>

#include <flyball/core/version.hpp>
#include <flyball/io/csv.hpp>

#include "report/files.hpp"
#include "report/format.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

using identification::FeedforwardFit;
using identification::FittedRun;
using identification::GainEstimate;
using identification::PreparedRun;
using mechanisms::MechanismKind;

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

std::string one_line(std::string_view text) {
  std::string line = printable(text);
  std::replace(line.begin(), line.end(), '\n', ' ');
  return line;
}

std::string toml_number(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) {
    text += ".0";
  }
  return text;
}

std::string interval_comment(const GainEstimate* gain) {
  if (gain == nullptr || !gain->determined) {
    return "";
  }
  return fmt::format(", 95 % within {} to {}", number(gain->interval[0], 5),
                     number(gain->interval[1], 5));
}

std::string heading() {
  return fmt::format(
      "# A Flyball {} project: `flyball design` reads this file as it is.\n"
      "# Gains in V, V·s/unit and V·s²/unit with the unit of the mechanism (m or rad).\n\n",
      version);
}

std::string gains_tables(MechanismKind kind, const std::string& unit,
                         const mechanisms::FeedforwardGains& gains, bool kA_determined,
                         double kA_upper_bound, const FeedforwardFit* fit) {
  const auto estimate = [&](const GainEstimate FeedforwardFit::* gain) {
    return interval_comment(fit == nullptr ? nullptr : &(fit->*gain));
  };
  std::string text = fmt::format("[mechanism]\ntype = \"{}\"\n\n[gains]\n", to_string(kind));
  text += fmt::format("kS = {}  # V{}\n", toml_number(gains.kS), estimate(&FeedforwardFit::kS));
  text += fmt::format("kV = {}  # V·s/{}{}\n", toml_number(gains.kV), unit,
                      estimate(&FeedforwardFit::kV));
  if (kA_determined) {
    text += fmt::format("kA = {}  # V·s²/{}{}\n", toml_number(gains.kA), unit,
                        estimate(&FeedforwardFit::kA));
  } else {
    text += fmt::format(
        "# kA is not determined, below {} V·s²/{}{}\n", number(kA_upper_bound), unit,
        fit != nullptr && !fit->kA.reason.empty() ? ": " + one_line(fit->kA.reason) : "");
  }
  if (kind != MechanismKind::flywheel) {
    text += fmt::format("kG = {}  # V{}\n", toml_number(gains.kG),
                        interval_comment(fit != nullptr && fit->kG ? &*fit->kG : nullptr));
  }
  if (kind == MechanismKind::arm) {
    text += fmt::format(
        "angle_offset = \"{} rad\"  # true angle from horizontal less the measured one{}\n",
        toml_number(gains.angle_offset),
        interval_comment(fit != nullptr && fit->angle_offset ? &*fit->angle_offset : nullptr));
  }
  return text;
}

/// ["0.01 m", "0.5 m/s"]; the states' units are the parentheses of their names.
std::string quantities(const std::vector<double>& values, const std::vector<std::string>& states) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::string unit;
    if (i < states.size()) {
      const std::size_t open = states[i].find('(');
      const std::size_t close = states[i].find(')');
      if (open != std::string::npos && close != std::string::npos && open < close) {
        unit = states[i].substr(open + 1, close - open - 1);
      }
    }
    text += fmt::format("{}\"{} {}\"", i == 0 ? "" : ", ", toml_number(values[i]), unit);
  }
  return text + "]";
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

std::string gains_toml(const study::IdentifyResult& result) {
  if (!result.report.fit) {
    return "";
  }
  const FeedforwardFit& fit = *result.report.fit;
  mechanisms::FeedforwardGains gains;
  gains.kS = fit.kS.value;
  gains.kV = fit.kV.value;
  gains.kA = fit.kA.value;
  gains.kG = fit.kG ? fit.kG->value : 0.0;
  gains.angle_offset = fit.angle_offset ? fit.angle_offset->value : 0.0;
  return heading() + gains_tables(result.mechanism, result.unit, gains, fit.kA.determined,
                                  fit.kA.upper_bound, &fit);
}

std::string gains_toml(const study::DesignResult& result, const FeedforwardFit* fit) {
  const study::DesignJob& job = result.job;
  const study::ControllerOptions& controller = job.controller;
  std::string text =
      heading() + gains_tables(job.plant.kind, job.plant.unit, job.plant.gains,
                               job.plant.kA_determined, job.plant.kA_upper_bound, fit);
  text += fmt::format("\n[controller]\nperiod = \"{} s\"\n", toml_number(controller.period));
  if (!controller.state_tolerance.empty()) {
    std::vector<double> tolerances = controller.state_tolerance;
    std::vector<std::string> states = result.states;
    std::string comment;
    if (result.velocity_servo && job.plant.kind != MechanismKind::flywheel &&
        tolerances.size() == 1) {
      // A project gives a position and a velocity; the plant without kA has the first alone.
      tolerances.push_back(job.plant.nominal_voltage / job.plant.gains.kV);
      states.push_back(fmt::format("velocity ({}/s)", job.plant.unit));
      comment = "  # without kA the velocity's is not used";
    }
    text += fmt::format("state_tolerance = {}{}\n", quantities(tolerances, states), comment);
  }
  text += fmt::format("input_tolerance = \"{} V\"\nmax_voltage = \"{} V\"\n",
                      toml_number(controller.input_tolerance), toml_number(controller.max_voltage));
  if (controller.delay) {
    text += fmt::format("delay = \"{} s\"\n", toml_number(*controller.delay));
  }
  if (job.estimator.measurement_std || !job.estimator.model_std.empty()) {
    text += "\n[estimator]\n";
    if (job.estimator.measurement_std) {
      text += fmt::format("measurement_std = \"{} {}\"\n",
                          toml_number(*job.estimator.measurement_std), controlled_unit(job.plant));
    }
    if (!job.estimator.model_std.empty() && !result.velocity_servo) {
      text += fmt::format("model_std = {}\n", quantities(job.estimator.model_std, result.states));
    }
  }
  if (job.sensor.resolution > 0.0) {
    text += fmt::format("\n[sensor]\nresolution = \"{} {}\"\n", toml_number(job.sensor.resolution),
                        controlled_unit(job.plant));
  }
  text += fmt::format(
      "\n[battery]\nopen_circuit_voltage = \"{} V\"\nresistance = \"{} Ohm\"\n\n[profile]\n"
      "goal = \"{} {}\"\nseed = {}\n",
      toml_number(job.battery.open_circuit_voltage), toml_number(job.battery.resistance),
      toml_number(result.motion.goal), controlled_unit(job.plant), job.seed);
  return text;
}

}  // namespace flyball::report
