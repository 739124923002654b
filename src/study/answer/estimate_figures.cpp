#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/wpilog.hpp>

#include "study/answer/drawing.hpp"
#include "study/answer/estimate_parts.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using SignalRow = std::vector<double>;

constexpr double band = 2.0;  ///< Standard deviations that are shown.

SignalRow row(const MatrixXd& M, Index i) {
  const Eigen::VectorXd values = M.row(i);
  return {values.begin(), values.end()};
}

std::string file_name(const std::string& run) {
  std::string name = run;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

/// The output that is the state itself at the run's end; -1: none.
Index output_of(const Estimation& result, const EstimatedRun& run, Index state) {
  const AnyModel& model = result.model;
  const Index last = run.filtered.cols() - 1;
  const Eigen::VectorXd x = run.filtered.col(last);
  const Eigen::VectorXd u = run.inputs.col(last);
  MatrixXd C(model.outputs(), model.states());
  MatrixXd D(model.outputs(), model.inputs());
  model.output_jacobians(x, u, C, D);
  C.col(state).array() -= 1.0;
  const Eigen::VectorXd y = model.output(x, u);
  for (Index i = 0; i < y.size(); ++i) {
    if (y(i) == x(state) && C.row(i).isZero(0.0) && D.row(i).isZero(0.0)) {
      return i;
    }
  }
  return -1;
}

/// "States", of one of several runs "States, run 2".
std::string title(const char* what, const Estimation& result, const EstimatedRun& run) {
  return result.runs.size() == 1 ? what : fmt::format("{}, {}", what, run.name);
}

Figure states_figure(const Estimation& result, const EstimatedRun& run) {
  Figure figure =
      over_time("states", "states_" + file_name(run.name), title("States", result, run),
                fmt::format("Estimated states of {} with bands of two standard "
                            "deviations{}.",
                            result.model.names().name,
                            is_smoothed(run) ? ", of the filter and of the smoother" : ""));
  const std::vector<Coordinate>& states = result.model.names().states;
  const SignalRow time = since(run.time.front(), run.time);
  figure.plot.clock = run.name;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto k = static_cast<Index>(i);
    PlotPanel shown = panel(states[i], {});
    if (const Index output = output_of(result, run, k); output >= 0) {
      PlotLine readings{.label = "measured", .style = LineStyle::points, .color = quiet_color};
      for (std::size_t s = 0; s < run.time.size(); ++s) {
        if (const double y = run.measured(output, static_cast<Index>(s)); !std::isnan(y)) {
          readings.x.push_back(time[s]);
          readings.y.push_back(y);
        }
      }
      shown.lines.push_back(std::move(readings));
    }
    const auto add = [&](const char* name, const MatrixXd& x, const MatrixXd& std, int color) {
      shown.lines.push_back(line(name, time, row(x, k), color));
      shown.bands.push_back({"± 2 σ", time, row(x - band * std, k), row(x + band * std, k), color});
    };
    add("filter", run.filtered, run.filtered_std, simulated_color);
    if (is_smoothed(run)) {
      add("smoother", run.smoothed, run.smoothed_std, measured_color);
    }
    figure.plot.panels.push_back(std::move(shown));
  }
  return figure;
}

Figure innovations_figure(const Estimation& result, const EstimatedRun& run) {
  Figure figure = over_time("residuals", "innovations_" + file_name(run.name),
                            title("Innovations", result, run),
                            "What each reading differs from the filter's prediction, in standard "
                            "deviations: 95 % of right ones are between the lines.");
  const std::vector<Coordinate>& outputs = result.model.names().outputs;
  figure.plot.clock = run.name;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    PlotLine points{.style = LineStyle::points, .color = measured_color};
    for (std::size_t k = 0; k < run.time.size(); ++k) {
      const double value = run.innovations(static_cast<Index>(i), static_cast<Index>(k));
      if (!std::isnan(value)) {
        points.x.push_back(run.time[k] - run.time.front());
        points.y.push_back(value);
      }
    }
    PlotPanel shown{.y_label = outputs[i].name + " (σ)", .lines = {std::move(points)}};
    constexpr double two_sided = 1.96;
    for (const double at : {-two_sided, 0.0, two_sided}) {
      shown.marks.push_back({at, "", false});
    }
    figure.plot.panels.push_back(std::move(shown));
  }
  return figure;
}

/// Every column of a run: names with their units, values on its time.
template <class Add>
void for_each_column(const Estimation& result, const EstimatedRun& run, const Add& add) {
  const ModelDescription& names = result.model.names();
  const auto each = [&](const std::vector<Coordinate>& list, const MatrixXd& M,
                        const std::string& before, const std::string& after, bool has_unit) {
    for (std::size_t i = 0; i < list.size() && M.size() != 0; ++i) {
      add(before + list[i].name + after, has_unit ? list[i].unit : std::string(),
          row(M, static_cast<Index>(i)));
    }
  };
  each(names.inputs, run.inputs, "", "", true);
  each(names.outputs, run.measured, "measured_", "", true);
  each(names.states, run.filtered, "filter_", "", true);
  each(names.states, run.filtered_std, "filter_", "_std", true);
  each(names.states, run.smoothed, "smoother_", "", true);
  each(names.states, run.smoothed_std, "smoother_", "_std", true);
  each(names.outputs, run.innovations, "innovation_", "", false);
  add("nis", "", run.nis);
  add("weight", "", run.weight);
}

AnswerFile csv_of(const Estimation& result, const EstimatedRun& run) {
  TimeSeries series(run.time);
  for_each_column(result, run,
                  [&](const std::string& name, const std::string& unit, SignalRow values) {
                    // As many as there are times, so that none is refused.
                    static_cast<void>(series.add(name, unit, std::move(values)));
                  });
  return {"data/" + file_name(run.name) + ".csv", to_csv(series)};
}

/// The log's own clock; values that are missing are left out.
std::vector<AnswerFile> wpilog_of(const Estimation& result) {
  Log log;
  for (const EstimatedRun& run : result.runs) {
    for_each_column(
        result, run, [&](const std::string& name, const std::string& unit, SignalRow values) {
          const std::string channel = "flyball/" + name;
          auto found = std::find_if(log.signals.begin(), log.signals.end(),
                                    [&](const Signal& signal) { return signal.name == channel; });
          if (found == log.signals.end()) {
            log.signals.push_back({channel, unit, {}, {}});
            found = log.signals.end() - 1;
          }
          for (std::size_t k = 0; k < values.size(); ++k) {
            if (!std::isnan(values[k])) {
              found->time.push_back(run.time[k]);
              found->value.push_back(values[k]);
            }
          }
        });
  }
  // Times that the format cannot hold (negative ones) leave the CSV files as they are.
  auto bytes = to_wpilog(log);
  return bytes ? std::vector<AnswerFile>{{"data/estimate.wpilog", *std::move(bytes)}}
               : std::vector<AnswerFile>{};
}

}  // namespace

std::vector<Figure> figures_of(const Estimation& result) {
  std::vector<Figure> figures;
  for (const EstimatedRun& run : result.runs) {
    figures.push_back(states_figure(result, run));
    figures.push_back(innovations_figure(result, run));
  }
  return figures;
}

std::vector<AnswerFile> data_files(const Estimation& result) {
  std::vector<AnswerFile> files;
  for (const EstimatedRun& run : result.runs) {
    files.push_back(csv_of(result, run));
  }
  append(files, wpilog_of(result));
  return files;
}

}  // namespace flyball::study
