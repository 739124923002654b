// Pictures and tables of what a linear system is like.
#include <algorithm>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/frequency_figures.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

Figure pole_figure(const std::string& section, const ModalAnalysis& modes, bool continuous) {
  PolePlotGroup group;
  for (const Mode& mode : modes.modes) {
    group.poles.push_back(mode.pole);
  }
  const std::string title = continuous ? "Poles in the s plane" : "Poles in the z plane";
  return {section, section == "poles" ? "poles" : "poles_sampled", title,
          continuous ? "Left of the vertical line a mode decays, the faster the farther left; away "
                       "from the horizontal line it oscillates."
                     : "Inside the circle a mode decays, the faster the nearer to the centre.",
          pole_plot(title, {group}, !continuous)};
}

std::vector<double> list(const auto& values) {
  return {values.begin(), values.end()};
}

Figure step_figure(const ModelAnalysis& result) {
  const std::vector<std::string> inputs = labels(result.model.inputs);
  const std::vector<Coordinate>& outputs = result.model.outputs;
  const bool single = result.steps.size() == 1;
  const bool continuous = result.model.domain == TimeDomain::continuous;
  const std::size_t panels = std::min(outputs.size(), most_panels);
  Figure figure = over_time(
      "response", "step_response", "Step responses",
      fmt::format(
          "Each output after a unit step of {}, from rest{}{}.",
          single ? inputs.front() : std::string("each input in turn"),
          panels < outputs.size()
              ? fmt::format("; the first {} of {} outputs", panels, outputs.size())
              : "",
          result.steps.size() < inputs.size()
              ? fmt::format("; the first {} of {} inputs", result.steps.size(), inputs.size())
              : ""));
  if (single) {
    figure.plot.title = "Unit step of " + inputs.front();
  }
  for (std::size_t output = 0; output < panels; ++output) {
    std::vector<PlotLine> lines;
    for (std::size_t input = 0; input < result.steps.size(); ++input) {
      const StepResponse& step = result.steps[input];
      lines.push_back(line(single ? "" : "after " + inputs[input], list(step.time),
                           list(step.y.col(static_cast<Eigen::Index>(output))), -1,
                           continuous ? LineStyle::solid : LineStyle::steps));
    }
    figure.plot.panels.push_back(
        panel({text::capitalized(outputs[output].name), outputs[output].unit}, std::move(lines)));
  }
  return figure;
}

/// Gain and phase of the channels; of a single one its curve in the plane, too.
std::vector<Figure> frequency_figures(const ModelAnalysis& result) {
  const std::vector<ChannelResponse>& channels = result.frequency_responses;
  if (channels.empty()) {
    return {};
  }
  const std::vector<Coordinate>& inputs = result.model.inputs;
  const std::vector<Coordinate>& outputs = result.model.outputs;
  const std::size_t all = inputs.size() * outputs.size();
  Figure bode{
      "response", "bode", "Bode plot",
      fmt::format(
          "Gain and phase from {} to {}{}. The gain is of the units that the system "
          "is written in.",
          inputs.size() == 1 ? inputs.front().name : "each input",
          outputs.size() == 1 ? outputs.front().name : "each output",
          channels.size() < all ? fmt::format("; {} of {} channels", channels.size(), all) : ""),
      bode_plot("Bode plot")};
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const ChannelResponse& channel = channels[i];
    add_response(bode.plot, channel.response,
                 all == 1 ? ""
                          : fmt::format("{} after {}",
                                        outputs[static_cast<std::size_t>(channel.output)].name,
                                        inputs[static_cast<std::size_t>(channel.input)].name),
                 static_cast<int>(i));
  }
  std::vector<Figure> figures{std::move(bode)};
  if (all == 1) {
    figures.push_back(
        {"response", "nyquist", "Nyquist curve",
         "The same in the complex plane, cut off far from the origin. Fed back with a gain of one, "
         "the loop is as far from its limit of stability as the curve is from −1.",
         nyquist_plot("Nyquist curve", "G", channels.front().response)});
  }
  return figures;
}

}  // namespace

std::vector<Figure> figures_of(const ModelAnalysis& result) {
  std::vector<Figure> figures{
      pole_figure("poles", result.modes, result.model.domain == TimeDomain::continuous)};
  if (result.sampled) {
    figures.push_back(pole_figure("sampling", result.sampled->modes, false));
  }
  if (!result.steps.empty()) {
    figures.push_back(step_figure(result));
  }
  append(figures, frequency_figures(result));
  return figures;
}

std::vector<AnswerFile> data_files(const ModelAnalysis& result) {
  if (result.steps.empty()) {
    return {};
  }
  TimeSeries series(list(result.steps.front().time));
  for (std::size_t input = 0; input < result.steps.size(); ++input) {
    for (std::size_t output = 0; output < result.model.outputs.size(); ++output) {
      static_cast<void>(
          series.add(fmt::format("{} after {}", label(result.model.outputs[output]),
                                 label(result.model.inputs[input])),
                     "", list(result.steps[input].y.col(static_cast<Eigen::Index>(output)))));
    }
  }
  return {{"data/step_response.csv", to_csv(series)}};
}

}  // namespace flyball::study
