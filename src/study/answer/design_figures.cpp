// Pictures and tables of a designed loop.
#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/mechanism_animation.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

/// Of the pictures of one simulated motion.
constexpr const char* motion_clock = "motion";

/// A column of the response, and how it is drawn.
struct Curve {
  std::string column;
  std::string label;
  int color;
  LineStyle style = LineStyle::solid;
};

/// A panel of the columns that the response has.
PlotPanel response_panel(const TimeSeries& series, const Coordinate& shown,
                         const std::vector<Curve>& curves) {
  PlotPanel made = panel(shown, {});
  for (const Curve& curve : curves) {
    if (const std::vector<double>* values = series.find(curve.column)) {
      made.lines.push_back(line(curve.label, series.time(), *values, curve.color, curve.style));
    }
  }
  return made;
}

/// What of position and velocity a mechanism's loop controls.
std::vector<Coordinate> controlled(const PlantDescription& plant) {
  std::vector<Coordinate> states{{"velocity", plant.unit + "/s"}};
  if (!controls_velocity(plant.kind)) {
    states.insert(states.begin(), {"position", plant.unit});
  }
  return states;
}

Figure response_figure(const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  const TimeSeries& series = result.response;
  Figure figure = over_time("motion", "closed_loop",
                            controls_velocity(plant.kind) ? "Closed loop: a ramp of the speed"
                                                          : "Closed loop: a trapezoid",
                            "Reference, truth and estimate of the simulated closed loop with "
                            "noise, delay and battery sag, and the voltage it takes.");
  figure.plot.clock = motion_clock;
  std::vector<PlotPanel>& panels = figure.plot.panels;
  for (const Coordinate& state : controlled(plant)) {
    panels.push_back(response_panel(
        series, {text::capitalized(state.name), state.unit},
        {{state.name, "truth", measured_color},
         {"estimated_" + state.name, "estimate", quiet_color, LineStyle::dotted},
         {"reference_" + state.name, "reference", simulated_color, LineStyle::dashed}}));
  }
  panels.push_back(response_panel(series, {"Voltage", "V"},
                                  {{"voltage", "asked for", voltage_color, LineStyle::steps},
                                   {"motor_voltage", "at the motor", 4},
                                   {"rail_voltage", "battery", 5, LineStyle::dashed}}));
  panels.back().marks.push_back({result.job.controller.max_voltage, "limit", false});
  panels.back().marks.push_back({-result.job.controller.max_voltage, "", false});
  return figure;
}

Figure estimate_figure(const DesignResult& result) {
  const TimeSeries& series = result.response;
  Figure figure = over_time("motion", "estimate", "Estimate against truth",
                            "Errors of the simulated closed loop: the estimate less the truth, and "
                            "the reference less the truth.");
  figure.plot.clock = motion_clock;
  for (const Coordinate& state : controlled(result.job.plant)) {
    const std::vector<double>* truth = series.find(state.name);
    if (truth == nullptr) {
      continue;
    }
    PlotPanel errors =
        panel({text::capitalized(state.name) + " error", state.unit}, {}, /*zero=*/true);
    const auto add = [&](const std::string& column, const std::string& what, int color) {
      if (const std::vector<double>* values = series.find(column)) {
        std::vector<double> error(truth->size());
        std::transform(values->begin(), values->end(), truth->begin(), error.begin(),
                       std::minus<>());
        errors.lines.push_back(line(what + " − truth", series.time(), error, color));
      }
    };
    add("estimated_" + state.name, "estimate", quiet_color);
    add("reference_" + state.name, "reference", simulated_color);
    figure.plot.panels.push_back(std::move(errors));
  }
  return figure;
}

Figure pole_figure(const DesignResult& result) {
  const auto list = [](const Eigen::VectorXcd& values) {
    return std::vector<std::complex<double>>(values.begin(), values.end());
  };
  const std::string title = "Poles in the z plane";
  return {
      "controller", "poles", title,
      "Poles of the loop as it runs, with observer and delay, beside those of the design and of "
      "the estimator; inside the unit circle is stable, nearer to the origin is faster. The grey "
      "grid: equal damping ratios ζ, and natural frequencies of 0.2, 0.4, … of half the sampling "
      "frequency.",
      pole_plot(title,
                {{"running loop", list(result.loop.poles), {}},
                 {"undelayed design", list(result.poles), {}},
                 {"estimator", list(result.estimator_poles), {}}},
                true)};
}

}  // namespace

std::vector<Figure> figures_of(const DesignResult& result) {
  std::vector<Figure> figures{pole_figure(result)};
  append(figures, loop_figures(result));
  if (result.response.rows() > 0) {
    figures.push_back(response_figure(result));
    const std::string& shown = controlled(result.job.plant).back().name;
    if (const std::vector<double>* truth = result.response.find(shown)) {
      if (const auto stretch = transient_of(result.response.time(), *truth)) {
        figures.push_back(transient(figures.back(), *stretch));
      }
    }
    figures.push_back(estimate_figure(result));
  }
  return figures;
}

std::vector<Animation> animations_of(const DesignResult& result) {
  return mechanism_animation(drawn(result.job.plant, "motion", motion_clock), result.response);
}

std::vector<AnswerFile> data_files(const DesignResult& result) {
  std::vector<AnswerFile> files;
  if (!result.loop.step.empty()) {
    TimeSeries step(result.loop.step_time);
    static_cast<void>(step.add("share_of_step", "", result.loop.step));
    files.push_back({"data/small_step.csv", to_csv(step)});
  }
  if (!result.frequency_response.empty()) {
    std::string loop = "frequency_rad_per_s,gain,phase_rad\n";
    for (const FrequencyPoint& point : result.frequency_response) {
      loop += fmt::format("{},{},{}\n", text::exact(point.frequency), text::exact(point.gain),
                          text::exact(point.phase));
    }
    files.push_back({"data/loop_response.csv", std::move(loop)});
  }
  if (result.response.rows() > 0) {
    files.push_back({"data/closed_loop.csv", to_csv(result.response)});
  }
  if (!result.robustness.empty()) {
    std::string grid =
        "inertia_factor,kA,gain_factor,delay_factor,stable,spectral_radius,overshoot\n";
    for (const RobustnessPoint& point : result.robustness) {
      grid += fmt::format("{},{},{},{},{},{},{}\n",
                          std::isnan(point.inertia_factor) ? "" : text::exact(point.inertia_factor),
                          text::exact(point.kA), text::exact(point.gain_factor),
                          text::exact(point.delay_factor), point.stable ? "true" : "false",
                          text::exact(point.spectral_radius), text::exact(point.overshoot));
    }
    files.push_back({"data/robustness.csv", std::move(grid)});
  }
  return files;
}

}  // namespace flyball::study
