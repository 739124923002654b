#include <algorithm>
#include <atomic>
#include <iterator>
#include <thread>

#include <fmt/format.h>

#include "report/figures.hpp"
#include "report/format.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

using identification::FittedRun;
using identification::PreparedRun;
using mechanisms::MechanismKind;
using study::DesignResult;
using study::IdentifyResult;

constexpr int measured_color = 0;
constexpr int simulated_color = 1;
constexpr int quiet_color = 2;

PlotPanel panel(std::string y_label, std::vector<PlotLine> lines) {
  PlotPanel made;
  made.y_label = std::move(y_label);
  made.lines = std::move(lines);
  return made;
}

PlotLine line(std::string label, const std::vector<double>& x, const std::vector<double>& y,
              int color, LineStyle style = LineStyle::solid) {
  return {std::move(label), x, y, style, color};
}

std::string run_name(std::string_view prefix, std::size_t source, identification::TestKind kind) {
  return fmt::format("{}_{}_{}", prefix, source + 1, to_string(kind));
}

Figure fitted_figure(const IdentifyResult& result, const FittedRun& run) {
  const std::string rate = result.unit + "/s";
  Figure figure;
  figure.section = "gains";
  figure.name = run_name("fit", run.source, run.kind);
  figure.title = fmt::format("Run {}: {}", run.source + 1, to_string(run.kind));
  figure.description = fmt::format(
      "Measured velocity against the velocity simulated in free run from the recorded voltage, "
      "their difference, and the voltage, over {}.",
      seconds(run.time.empty() ? 0.0 : run.time.back() - run.time.front()));
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  PlotPanel velocity = panel(fmt::format("Velocity ({})", rate),
                             {line("measured", run.time, run.velocity, measured_color),
                              line("simulated", run.time, run.velocity_hat, simulated_color)});
  PlotPanel residual =
      panel(fmt::format("Residual ({})", rate),
            {line("measured − simulated", run.time, run.velocity_residual, quiet_color)});
  residual.marks.push_back({0.0, "", false});
  PlotPanel voltage = panel("Voltage (V)", {line("", run.time, run.voltage, 3)});
  voltage.marks.push_back({0.0, "", false});
  figure.plot.panels = {std::move(velocity), std::move(residual), std::move(voltage)};
  return figure;
}

Figure recorded_figure(const IdentifyResult& result, const PreparedRun& prepared) {
  const identification::TestRun& run = prepared.run;
  Figure figure;
  figure.section = "data";
  figure.name = run_name("recorded", prepared.source, run.kind);
  figure.title = fmt::format("Run {}: {}, as recorded", prepared.source + 1, to_string(run.kind));
  figure.description = "Voltage, velocity and position as the log has them.";
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  figure.plot.panels.push_back(panel("Voltage (V)", {line("", run.time, run.voltage, 3)}));
  if (!run.velocity.empty()) {
    figure.plot.panels.push_back(panel(fmt::format("Velocity ({}/s)", result.unit),
                                       {line("", run.time, run.velocity, measured_color)}));
  }
  if (!run.position.empty()) {
    figure.plot.panels.push_back(panel(fmt::format("Position ({})", result.unit),
                                       {line("", run.time, run.position, measured_color)}));
  }
  return figure;
}

/// The lines of a panel for the columns that the response has.
std::vector<PlotLine> response_lines(
    const TimeSeries& series,
    std::initializer_list<std::tuple<const char*, const char*, int, LineStyle>> wanted) {
  std::vector<PlotLine> lines;
  for (const auto& [column, label, color, style] : wanted) {
    if (const std::vector<double>* values = series.find(column)) {
      lines.push_back(line(label, series.time(), *values, color, style));
    }
  }
  return lines;
}

Figure response_figure(const DesignResult& result) {
  const study::PlantDescription& plant = result.job.plant;
  const bool flywheel = plant.kind == MechanismKind::flywheel;
  Figure figure;
  figure.section = "motion";
  figure.name = "closed_loop";
  figure.title = flywheel ? "Closed loop: a ramp of the speed" : "Closed loop: a trapezoid";
  figure.description =
      "Reference, truth and estimate of the simulated closed loop with noise, delay and battery "
      "sag, and the voltage it takes.";
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  const TimeSeries& series = result.response;
  if (!flywheel) {
    figure.plot.panels.push_back(panel(
        fmt::format("Position ({})", plant.unit),
        response_lines(series,
                       {{"position", "truth", measured_color, LineStyle::solid},
                        {"estimated_position", "estimate", quiet_color, LineStyle::solid},
                        {"reference_position", "reference", simulated_color, LineStyle::dashed}})));
  }
  figure.plot.panels.push_back(panel(
      fmt::format("Velocity ({}/s)", plant.unit),
      response_lines(series,
                     {{"velocity", "truth", measured_color, LineStyle::solid},
                      {"estimated_velocity", "estimate", quiet_color, LineStyle::solid},
                      {"reference_velocity", "reference", simulated_color, LineStyle::dashed}})));
  PlotPanel volts = panel(
      "Voltage (V)", response_lines(series, {{"voltage", "asked for", 3, LineStyle::steps},
                                             {"motor_voltage", "at the motor", 4, LineStyle::solid},
                                             {"rail_voltage", "battery", 5, LineStyle::dashed}}));
  volts.marks.push_back({result.job.controller.max_voltage, "limit", false});
  volts.marks.push_back({-result.job.controller.max_voltage, "", false});
  figure.plot.panels.push_back(std::move(volts));
  return figure;
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> out(std::min(a.size(), b.size()));
  std::transform(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(out.size()), b.begin(),
                 out.begin(), [](double x, double y) { return x - y; });
  return out;
}

Figure estimate_figure(const DesignResult& result) {
  const study::PlantDescription& plant = result.job.plant;
  const TimeSeries& series = result.response;
  Figure figure;
  figure.section = "motion";
  figure.name = "estimate";
  figure.title = "Estimate against truth";
  figure.description =
      "Errors of the simulated closed loop: the estimate less the truth, and the reference less "
      "the truth.";
  figure.plot.title = figure.title;
  figure.plot.x_label = "Time (s)";
  const auto add = [&](const std::string& state, const std::string& unit) {
    const std::vector<double>* truth = series.find(state);
    const std::vector<double>* estimate = series.find("estimated_" + state);
    const std::vector<double>* reference = series.find("reference_" + state);
    if (truth == nullptr) {
      return;
    }
    std::vector<PlotLine> lines;
    if (estimate != nullptr) {
      lines.push_back(
          line("estimate − truth", series.time(), difference(*estimate, *truth), quiet_color));
    }
    if (reference != nullptr) {
      lines.push_back(line("reference − truth", series.time(), difference(*reference, *truth),
                           simulated_color));
    }
    PlotPanel errors =
        panel(fmt::format("{} error ({})", state == "position" ? "Position" : "Velocity", unit),
              std::move(lines));
    errors.marks.push_back({0.0, "", false});
    figure.plot.panels.push_back(std::move(errors));
  };
  if (plant.kind != MechanismKind::flywheel) {
    add("position", plant.unit);
  }
  add("velocity", plant.unit + "/s");
  return figure;
}

std::vector<std::complex<double>> list(const Eigen::VectorXcd& values) {
  return {values.data(), values.data() + values.size()};
}

Figure pole_figure(const DesignResult& result) {
  Figure figure;
  figure.section = "controller";
  figure.name = "poles";
  figure.title = "Poles in the z plane";
  figure.description =
      "Closed-loop and estimator poles with the unit circle; inside it is stable, nearer to the "
      "origin is faster.";
  figure.plot = pole_plot(
      figure.title,
      {{"closed loop", list(result.poles), {}}, {"estimator", list(result.estimator_poles), {}}},
      true);
  return figure;
}

}  // namespace

std::vector<Figure> figures_of(const IdentifyResult& result) {
  std::vector<Figure> figures;
  for (const PreparedRun& prepared : shown_runs(result)) {
    const FittedRun* fitted = nullptr;
    if (result.report.fit) {
      for (const FittedRun& run : result.report.fit->runs) {
        fitted = run.source == prepared.source ? &run : fitted;
      }
    }
    const bool simulated = fitted != nullptr && fitted->used && !fitted->time.empty() &&
                           fitted->velocity_hat.size() == fitted->time.size();
    figures.push_back(simulated ? fitted_figure(result, *fitted)
                                : recorded_figure(result, prepared));
  }
  return figures;
}

std::vector<Figure> figures_of(const DesignResult& result) {
  std::vector<Figure> figures{pole_figure(result)};
  if (result.response.rows() > 0) {
    figures.push_back(response_figure(result));
    figures.push_back(estimate_figure(result));
  }
  return figures;
}

std::vector<Figure> figures_of(const study::TuneResult& result) {
  std::vector<Figure> figures = figures_of(result.identification);
  if (result.design && *result.design) {
    std::vector<Figure> more = figures_of(**result.design);
    std::move(more.begin(), more.end(), std::back_inserter(figures));
  }
  return figures;
}

std::vector<RenderedFigure> render(std::vector<Figure> figures, bool png) {
  std::vector<RenderedFigure> rendered(figures.size());
  for (std::size_t i = 0; i < figures.size(); ++i) {
    rendered[i].figure = std::move(figures[i]);
  }
  const std::size_t jobs = rendered.size() * (png ? 2 : 1);
  std::vector<std::string> problems(jobs);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t job = next++; job < jobs; job = next++) {
      const bool raster = job >= rendered.size();
      RenderedFigure& target = rendered[job % rendered.size()];
      Expected<std::string> picture =
          raster ? render_png(target.figure.plot) : render_svg(target.figure.plot);
      if (!picture) {
        problems[job] = to_string(picture.error());
      } else if (raster) {
        target.png = *std::move(picture);
      } else {
        target.svg = *std::move(picture);
      }
    }
  };
  // Each picture is a process of its own; waiting for one costs nothing.
  std::vector<std::jthread> workers;
  const std::size_t threads =
      std::min<std::size_t>(jobs, std::clamp(std::thread::hardware_concurrency(), 1U, 8U));
  for (std::size_t i = 1; i < threads; ++i) {
    workers.emplace_back(work);
  }
  work();
  workers.clear();
  for (std::size_t i = 0; i < rendered.size(); ++i) {
    rendered[i].problem = problems[i];
  }
  return rendered;
}

}  // namespace flyball::report
