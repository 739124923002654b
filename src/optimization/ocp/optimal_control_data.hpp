#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/error.hpp>
#include <flyball/math/expression/lagrangian.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

namespace flyball::optimization::detail {

/// What an OptimalControlProblem was told. States are followed by shared parameters, as states
/// that stay.
struct OptimalControlData {
  struct Row {
    expression::Lagrangian functions{};
    Eigen::VectorXd lower{}, upper{};
    int first = 0, last = 0;
    std::string name{};
  };

  /// Functions of some stages, in place of those of all.
  struct Piece {
    expression::Lagrangian functions{};
    int first = 0, last = 0;
  };

  int states = 0, inputs = 0, intervals = 0, parameters = 0, data_size = 0;
  std::optional<expression::Lagrangian> dynamics{};  ///< Of states and parameters.
  std::optional<expression::Lagrangian> cost{}, terminal_cost{};
  std::vector<Piece> dynamics_at{}, cost_at{};  ///< Later ones count.
  std::vector<Row> rows{};
  Eigen::MatrixXd lower{}, upper{};  ///< (states + parameters + inputs) x (N + 1).
  Eigen::MatrixXd start{};           ///< Likewise.
  Eigen::MatrixXd data{};            ///< data_size x (N + 1).
  std::optional<Error> error{};      ///< The first thing that was wrong.

  [[nodiscard]] int size() const noexcept { return states + parameters + inputs; }
};

}  // namespace flyball::optimization::detail
