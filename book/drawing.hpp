#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/quantity.hpp>
#include <flyball/systems/system.hpp>

#include "book/figures.hpp"

/// What the figures share, so that each file holds the control engineering and nothing else.
namespace flyball::book {

/// The entries of a vector or a row.
template <class Derived>
[[nodiscard]] std::vector<double> values(const Eigen::MatrixBase<Derived>& row) {
  std::vector<double> entries;
  entries.reserve(static_cast<std::size_t>(row.size()));
  for (Eigen::Index i = 0; i < row.size(); ++i) {
    entries.push_back(row(i));
  }
  return entries;
}

/// One of the panels of a closed loop's response: the column "reference_<column>" dashed, if there
/// is one, and <column> solid.
struct ResponsePanel {
  std::string y_label;  ///< With its unit: "Position (m)".
  std::string column;
  std::string label = "State";
  std::string reference_label = "Reference";
};

/// Panels above each other over the first column, time.
[[nodiscard]] Plot response_plot(const FigureResult& figure,
                                 const std::vector<ResponsePanel>& panels);

/// A state of a plant as a figure shows it.
struct StateLabel {
  std::string name;   ///< Of its column: "velocity".
  std::string unit;   ///< "m/s"
  std::string label;  ///< Of its axis: "Velocity".
};

/// Appends the columns "reference_<name>" and "<name>" of each state.
/// @param r, x  States x samples. @return A panel for each state.
[[nodiscard]] std::vector<ResponsePanel> add_states(FigureResult& figure,
                                                    const std::vector<StateLabel>& states,
                                                    const Eigen::MatrixXd& r,
                                                    const Eigen::MatrixXd& x);

/// "K" of a single state; "K_p" and "K_d" of a position and its velocity.
[[nodiscard]] std::string gain_name(const std::vector<StateLabel>& states, std::size_t state);

/// Volts for each unit of a state: "V/m", "V/(m/s)".
[[nodiscard]] std::string gain_unit(const StateLabel& state);

/// A column, what it is called in the legend, and how it is drawn.
struct PlotColumn {
  std::string column;
  std::string label;
  LineStyle style = LineStyle::solid;
  int color = -1;  ///< As of a PlotLine.
};

/// What a controller should reach: dashed and of this colour in every figure.
constexpr int reference_color = 1;
constexpr int state_color = 0;

/// Columns over the first one, time, in one panel.
[[nodiscard]] Plot line_plot(const FigureResult& figure, const std::string& y_label,
                             const std::vector<PlotColumn>& columns);

/// The output of a system at rest whose first input is 1 from the first sample on.
[[nodiscard]] Eigen::VectorXd unit_step(const DiscreteSystem<>& system, Eigen::Index samples);

/// The reference of the book's step responses: `height` for 0.1 s <= t < 5.1 s, otherwise 0, until
/// 10.2 s. One column a sample; the first state gets it, the others stay 0.
[[nodiscard]] Eigen::MatrixXd pulse_reference(double height, Eigen::Index states, Time period);

/// The references of a position and its velocity along a profile, one column a sample.
[[nodiscard]] Eigen::MatrixXd profile_reference(const TimeSeries& profile);

}  // namespace flyball::book
