#include <algorithm>

#include <flyball/systems/response.hpp>

#include "book/drawing.hpp"

namespace flyball::book {

namespace {

const std::vector<double>* find_column(const FigureResult& figure, const std::string& name) {
  const auto found = std::ranges::find(figure.columns, name, &TimeSeries::Column::name);
  return found == figure.columns.end() ? nullptr : &found->values;
}

}  // namespace

Plot response_plot(const FigureResult& figure, const std::vector<ResponsePanel>& panels) {
  Plot plot;
  plot.title = figure.title;
  plot.x_label = "Time (s)";
  const std::vector<double>& time = figure.columns.front().values;
  for (const ResponsePanel& panel : panels) {
    PlotPanel drawn;
    drawn.y_label = panel.y_label;
    if (const auto* state = find_column(figure, panel.column)) {
      drawn.lines.push_back({.label = panel.label, .x = time, .y = *state, .color = state_color});
    }
    // Above the state, where its dashes show even if the two agree.
    if (const auto* reference = find_column(figure, "reference_" + panel.column)) {
      drawn.lines.push_back({.label = panel.reference_label,
                             .x = time,
                             .y = *reference,
                             .style = LineStyle::dashed,
                             .color = reference_color});
    }
    plot.panels.push_back(std::move(drawn));
  }
  return plot;
}

std::vector<ResponsePanel> add_states(FigureResult& figure, const std::vector<StateLabel>& states,
                                      const Eigen::MatrixXd& r, const Eigen::MatrixXd& x) {
  std::vector<ResponsePanel> panels;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto& [name, unit, label] = states[i];
    const auto row = static_cast<Eigen::Index>(i);
    figure.columns.push_back({"reference_" + name, unit, values(r.row(row))});
    figure.columns.push_back({name, unit, values(x.row(row))});
    panels.push_back({label + " (" + unit + ")", name});
  }
  return panels;
}

std::string gain_name(const std::vector<StateLabel>& states, std::size_t state) {
  return states.size() == 1 ? "K" : state == 0 ? "K_p" : "K_d";
}

std::string gain_unit(const StateLabel& state) {
  const bool quotient = state.unit.find('/') != std::string::npos;
  return quotient ? "V/(" + state.unit + ")" : "V/" + state.unit;
}

Plot line_plot(const FigureResult& figure, const std::string& y_label,
               const std::vector<PlotColumn>& columns) {
  PlotPanel panel{.y_label = y_label};
  for (const PlotColumn& column : columns) {
    if (const auto* values = find_column(figure, column.column)) {
      panel.lines.push_back({.label = column.label,
                             .x = figure.columns.front().values,
                             .y = *values,
                             .style = column.style,
                             .color = column.color});
    }
  }
  return {.title = figure.title, .x_label = "Time (s)", .panels = {std::move(panel)}};
}

Eigen::VectorXd unit_step(const DiscreteSystem<>& system, Eigen::Index samples) {
  return flyball::step_response(system, 0, ResponseTimes{system.period, samples}).value().y.col(0);
}

Eigen::MatrixXd pulse_reference(double height, Eigen::Index states, Time period) {
  const auto samples = static_cast<Eigen::Index>(10.2 / period.si() + 0.5);
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(states, samples);
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * period.si();
    r(0, k) = t >= 0.1 && t < 5.1 ? height : 0.0;
  }
  return r;
}

Eigen::MatrixXd profile_reference(const TimeSeries& profile) {
  const auto samples = static_cast<Eigen::Index>(profile.rows());
  Eigen::MatrixXd r(2, samples);
  r.row(0) = Eigen::RowVectorXd::Map(profile.find("position")->data(), samples);
  r.row(1) = Eigen::RowVectorXd::Map(profile.find("velocity")->data(), samples);
  return r;
}

}  // namespace flyball::book
