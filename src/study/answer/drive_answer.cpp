// Verdict, JSON, pictures and tables of a drivetrain's identification.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

using identification::DriveFit;
using identification::DriveReport;
using identification::DriveRun;
using identification::FeedforwardFit;
using identification::FittedDriveRun;

std::string run_name(std::string_view prefix, std::size_t index, const DriveRun& run) {
  return fmt::format("{}_{}_{}", prefix, index + 1, to_string(run.kind));
}

PlotPanel compared(const Coordinate& shown, const FittedDriveRun& run,
                   const std::vector<double>& measured, const std::vector<double>& simulated,
                   double begin) {
  const std::vector<double> time = since(begin, run.time);
  std::vector<PlotLine> lines{line("measured", time, measured, measured_color)};
  if (!simulated.empty()) {
    lines.push_back(line("simulated", time, simulated, simulated_color, LineStyle::dashed));
  }
  return panel(shown, std::move(lines));
}

/// Marks the rows of a run before and after those that the fit used, and shows what is recorded of
/// them, as far as the axis of the others reaches.
void mark_unused(PlotPanel& shown, const DriveRun& run, const FittedDriveRun& fitted,
                 const std::vector<double>& recorded, bool said) {
  if (fitted.time.empty() || run.time.empty()) {
    return;
  }
  const double begin = run.time.front();
  const double first = fitted.time.front();
  const double last = fitted.time.back();
  const auto mark = [&](double from, double to) {
    if (to > from) {
      shown.spans.push_back({from - begin, to - begin, said ? not_used : ""});
    }
  };
  mark(begin, first);
  mark(last, run.time.back());
  if (shown.spans.empty() || recorded.size() != run.time.size() || shown.lines.empty()) {
    return;
  }
  const std::vector<double>& used = shown.lines.front().y;
  const auto [least, greatest] = std::minmax_element(used.begin(), used.end());
  const double room = 0.5 * (*greatest - *least);
  PlotLine rows{.label = not_used, .style = LineStyle::dotted, .color = unused_color};
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    // Joined to the used ones, where there are some beyond.
    const bool outside =
        (run.time[i] <= first && first > begin) || (run.time[i] >= last && last < run.time.back());
    const bool near = recorded[i] >= *least - room && recorded[i] <= *greatest + room;
    rows.x.push_back(run.time[i] - begin);
    rows.y.push_back(outside && near ? recorded[i] : NAN);
  }
  shown.lines.insert(shown.lines.begin(), std::move(rows));
}

Figure drive_figure(const DriveReport& report, const FittedDriveRun& fitted, std::size_t index) {
  const DriveRun& run = report.recording.runs[index];
  const std::string rate = report.recording.unit + "/s";
  Figure figure = over_time(
      fitted.used ? "gains" : "data", run_name(fitted.used ? "fit" : "recorded", index, run),
      fmt::format("Run {}: {}, {}", index + 1, to_string(run.kind), to_string(report.tests[index])),
      fitted.used ? "Measured velocities and heading against those that the whole model makes in "
                    "free run from both recorded voltages, and the voltages."
                  : "Velocities, heading and voltages as the log has them.");
  const double begin = run.time.empty() ? 0.0 : run.time.front();
  const std::vector<double> time = since(begin, run.time);
  figure.plot.panels = {compared({"Left velocity", rate}, fitted, fitted.left_velocity,
                                 fitted.left_velocity_hat, begin),
                        compared({"Right velocity", rate}, fitted, fitted.right_velocity,
                                 fitted.right_velocity_hat, begin)};
  if (!fitted.heading.empty()) {
    figure.plot.panels.push_back(
        compared({"Heading", "rad"}, fitted, fitted.heading, fitted.heading_hat, begin));
  }
  figure.plot.panels.push_back(
      panel({"Voltage", "V"},
            {line("left", time, run.left.voltage, voltage_color),
             line("right", time, run.right.voltage, quiet_color, LineStyle::dashed)},
            true));
  if (fitted.used) {
    std::vector<PlotPanel>& panels = figure.plot.panels;
    mark_unused(panels[0], run, fitted, run.left.velocity, false);
    mark_unused(panels[1], run, fitted, run.right.velocity, false);
    if (panels.size() > 3) {
      mark_unused(panels[2], run, fitted, run.heading, false);
    }
    mark_unused(panels.back(), run, fitted, {}, true);
  }
  return figure;
}

/// Adds a column if it fits the clock.
void add(TimeSeries& series, std::string name, std::string unit,
         const std::vector<double>& values) {
  if (values.size() == series.rows() && !values.empty()) {
    static_cast<void>(series.add(std::move(name), std::move(unit), values));
  }
}

std::string run_csv(const DriveReport& report, std::size_t index) {
  const std::string& unit = report.recording.unit;
  const std::string rate = unit + "/s";
  if (index < report.runs.size() && report.runs[index].used) {
    const FittedDriveRun& run = report.runs[index];
    TimeSeries series(run.time);
    add(series, "left_velocity", rate, run.left_velocity);
    add(series, "left_velocity_simulated", rate, run.left_velocity_hat);
    add(series, "right_velocity", rate, run.right_velocity);
    add(series, "right_velocity_simulated", rate, run.right_velocity_hat);
    add(series, "heading", "rad", run.heading);
    add(series, "heading_simulated", "rad", run.heading_hat);
    return to_csv(series);
  }
  const DriveRun& run = report.recording.runs[index];
  TimeSeries series(run.time);
  add(series, "left_voltage", "V", run.left.voltage);
  add(series, "right_voltage", "V", run.right.voltage);
  add(series, "left_position", unit, run.left.position);
  add(series, "right_position", unit, run.right.position);
  add(series, "left_velocity", rate, run.left.velocity);
  add(series, "right_velocity", rate, run.right.velocity);
  add(series, "heading", "rad", run.heading);
  return to_csv(series);
}

void write_mode(JsonWriter& json, std::string_view name, const std::optional<FeedforwardFit>& fit) {
  if (!fit) {
    return;
  }
  json.object(name, [&] {
    write_quality(json, *fit);
    write_terms(json, *fit);
  });
}

}  // namespace

Verdict drive_verdict(const IdentifyResult& result) {
  if (!result.drive->fit) {
    return {
        Tone::bad, "No gains can be taken from this log.", {to_string(result.drive->fit.error())}};
  }
  const DriveFit& fit = *result.drive->fit;
  Verdict verdict;
  bool assumed = false;
  for (const Diagnostic& found : result.diagnostics()) {
    if (found.code == "unit_assumed") {
      verdict.add(Tone::caution, found.message);
      assumed = true;
    }
  }
  add_wiring(verdict, result.diagnostics());
  const auto judge = [&](const char* mode, const std::optional<FeedforwardFit>& of) {
    if (!of) {
      verdict.add(Tone::caution, fmt::format("no gains of the {} motion", mode));
      return;
    }
    if (!of->kA.determined) {
      verdict.add(Tone::caution,
                  fmt::format("the log does not determine kA of the {} motion", mode));
    }
    if (of->r_squared < poor_fit) {
      verdict.add(Tone::caution,
                  fmt::format("the simulated {} velocity explains only {} of the measured one: "
                              "compare them before you trust the gains",
                              mode, text::percent(std::max(0.0, of->r_squared))));
    }
  };
  judge("linear", fit.linear);
  judge("angular", fit.angular);
  if (!fit.trackwidth || !fit.trackwidth->determined) {
    verdict.add(Tone::caution, "the trackwidth is not known");
  }
  add_warnings(verdict, result.diagnostics(), "about the data");
  verdict.line = verdict.tone == Tone::good ? "The gains of both motions can be used."
                 : assumed                  ? "The gains can be used once the unit is confirmed."
                                            : "The gains can be used with care.";
  return verdict;
}

void write_drive_gains(JsonWriter& json, const DriveFit& fit) {
  const bool width = fit.trackwidth && fit.trackwidth->determined;
  const auto angular = [&](const identification::GainEstimate& gain) {
    return width ? identification::per_radian(gain, *fit.trackwidth) : gain;
  };
  const std::string turning = width ? "rad" : fit.unit;
  if (fit.linear) {
    write_gain(json, "kS", fit.linear->kS, "V");
    write_gain(json, "kV", fit.linear->kV, "V·s/" + fit.unit);
    write_gain(json, "kA", fit.linear->kA, "V·s²/" + fit.unit);
  }
  if (fit.angular) {
    write_gain(json, "kS_angular", fit.angular->kS, "V");
    write_gain(json, "kV_angular", angular(fit.angular->kV), "V·s/" + turning);
    write_gain(json, "kA_angular", angular(fit.angular->kA), "V·s²/" + turning);
  }
  if (fit.kS_left) {
    write_gain(json, "kS_left", *fit.kS_left, "V");
    write_gain(json, "kS_right", *fit.kS_right, "V");
  }
  if (fit.trackwidth) {
    write_gain(json, "trackwidth", *fit.trackwidth, "m");
  }
}

void write_drive(JsonWriter& json, const IdentifyResult& result) {
  const DriveFit& fit = *result.drive->fit;
  json.add("mechanism", "drivetrain");
  json.add("unit", fit.unit);
  json.object("gains", [&] { write_drive_gains(json, fit); });
  json.object("modes", [&] {
    write_mode(json, "linear", fit.linear);
    write_mode(json, "angular", fit.angular);
  });
  if (const auto gains = fit.gains()) {
    if (const auto drive = mechanisms::differential_drive(*gains)) {
      json.object("plant", [&] {
        json.add("A", Eigen::MatrixXd(drive->A));
        json.add("B", Eigen::MatrixXd(drive->B));
      });
    }
  }
}

std::vector<Figure> drive_figures(const IdentifyResult& result) {
  const DriveReport& report = *result.drive;
  std::vector<Figure> figures;
  if (report.fit) {
    std::vector<std::pair<std::string, const FeedforwardFit*>> fits;
    for (const auto& [prefix, fit] :
         {std::pair{"linear ", &report.fit->linear}, std::pair{"angular ", &report.fit->angular}}) {
      if (*fit) {
        fits.emplace_back(prefix, &**fit);
      }
    }
    figures = interval_figures(fits);
  }
  for (std::size_t i = 0; i < report.runs.size(); ++i) {
    const FittedDriveRun& run = report.runs[i];
    figures.push_back(drive_figure(report, run, i));
    if (run.time.empty()) {
      continue;
    }
    const double begin = report.recording.runs[i].time.front();
    if (const auto stretch = transient_of(since(begin, run.time), run.left_velocity_hat)) {
      figures.push_back(transient(figures.back(), *stretch));
    }
  }
  return figures;
}

std::vector<AnswerFile> drive_files(const IdentifyResult& result) {
  const DriveReport& report = *result.drive;
  std::vector<AnswerFile> files;
  for (std::size_t i = 0; i < report.recording.runs.size(); ++i) {
    files.push_back({fmt::format("data/{}.csv", run_name("run", i, report.recording.runs[i])),
                     run_csv(report, i)});
  }
  return files;
}

}  // namespace flyball::study
