// Pictures and tables of what a linear system is like.
#include <algorithm>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "report/figures.hpp"
#include "report/files.hpp"
#include "report/sections.hpp"

namespace flyball::report {

namespace {

using study::ModelAnalysis;
using study::ModelFile;

constexpr std::size_t most_panels = 8;  ///< Of a picture that is looked at.

Figure pole_figure(const std::string& section, const ModalAnalysis& modes, bool continuous) {
  Figure figure;
  figure.section = section;
  figure.name = section == "poles" ? "poles" : "poles_sampled";
  figure.title = continuous ? "Poles in the s plane" : "Poles in the z plane";
  figure.description =
      continuous ? "Left of the vertical line a mode decays, the faster the farther left; away "
                   "from the horizontal line it oscillates."
                 : "Inside the circle a mode decays, the faster the nearer to the centre.";
  PolePlotGroup group;
  for (const Mode& mode : modes.modes) {
    group.poles.push_back(mode.pole);
  }
  figure.plot = pole_plot(figure.title, {group}, !continuous);
  return figure;
}

}  // namespace

std::vector<Figure> figures_of(const ModelAnalysis& result) {
  const bool continuous = result.model.domain == TimeDomain::continuous;
  const ModelFile& model = result.model;
  std::vector<Figure> figures{pole_figure("poles", result.modes, continuous)};
  if (result.sampled) {
    figures.push_back(pole_figure("sampling", result.sampled->modes, false));
  }
  Figure steps;
  steps.section = "response";
  steps.name = "step_response";
  steps.title = "Step responses";
  const std::size_t panels = std::min(model.outputs.size(), most_panels);
  steps.description = fmt::format(
      "Each output after a unit step of {}, from rest{}{}.",
      result.steps.size() == 1 ? model.inputs.front() : std::string("each input in turn"),
      panels < model.outputs.size()
          ? fmt::format("; the first {} of {} outputs", panels, model.outputs.size())
          : "",
      result.steps.size() < model.inputs.size()
          ? fmt::format("; the first {} of {} inputs", result.steps.size(), model.inputs.size())
          : "");
  steps.plot.title = result.steps.size() == 1 ? "Unit step of " + model.inputs[0] : steps.title;
  steps.plot.x_label = "Time (s)";
  for (std::size_t output = 0; output < panels; ++output) {
    PlotPanel panel;
    panel.y_label = capitalized(model.outputs[output]);
    for (std::size_t input = 0; input < result.steps.size(); ++input) {
      const study::StepResponse& step = result.steps[input];
      PlotLine line;
      line.label = result.steps.size() == 1 ? "" : "after " + model.inputs[input];
      line.x.assign(step.time.begin(), step.time.end());
      const auto column = step.y.col(static_cast<Eigen::Index>(output));
      line.y.assign(column.begin(), column.end());
      line.style = continuous ? LineStyle::solid : LineStyle::steps;
      panel.lines.push_back(std::move(line));
    }
    steps.plot.panels.push_back(std::move(panel));
  }
  figures.push_back(std::move(steps));
  return figures;
}

std::vector<ReportFile> data_files(const ModelAnalysis& result) {
  const Eigen::VectorXd& time = result.steps.front().time;
  TimeSeries series({time.begin(), time.end()});
  for (std::size_t input = 0; input < result.steps.size(); ++input) {
    const Eigen::MatrixXd& y = result.steps[input].y;
    for (Eigen::Index output = 0; output < y.cols(); ++output) {
      const auto column = y.col(output);
      static_cast<void>(series.add(
          fmt::format("{} after {}", result.model.outputs[static_cast<std::size_t>(output)],
                      result.model.inputs[input]),
          "", {column.begin(), column.end()}));
    }
  }
  return {{"data/step_response.csv", to_csv(series)}};
}

}  // namespace flyball::report
