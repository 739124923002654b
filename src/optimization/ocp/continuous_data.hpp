#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/error.hpp>
#include <flyball/math/expression/tape.hpp>
#include <flyball/optimization/ocp/continuous_problem.hpp>

namespace flyball::optimization::detail {

/// lower ≤ g ≤ upper.
struct ContinuousRow {
  expression::Tape g{};
  Eigen::VectorXd lower{}, upper{};
  std::string name{};
};

/// A phase as it was told; tapes are of (x, u, T).
struct ContinuousPhase {
  std::optional<expression::Tape> derivative{}, running_cost{}, jump{};
  std::vector<ContinuousRow> path{}, start_rows{}, end_rows{};
  Eigen::VectorXd state_lower{}, state_upper{}, input_lower{}, input_upper{};
  Eigen::VectorXd end{};                        ///< NaN: free.
  double least = 0.0, most = 0.0, guess = 0.0;  ///< Duration; equal: fixed.
  int shared_with = -1;                         ///< Whose duration it has.
  Eigen::VectorXd guess_shares{};               ///< Empty: none.
  Eigen::MatrixXd guess_states{}, guess_inputs{};
};

struct ContinuousData {
  int states = 0, inputs = 0;
  std::vector<ContinuousPhase> phases{};
  std::optional<expression::Tape> final_cost{};
  Eigen::VectorXd start{};  ///< NaN: free.
  double time_weight = 0.0;
  std::optional<Error> error{};  ///< The first thing that was wrong.
};

/// What a tape computes, of expressions.
[[nodiscard]] ExpressionVector replay(const expression::Tape& tape, const ExpressionVector& x,
                                      const ExpressionVector& u, const ExpressionVector& T);

}  // namespace flyball::optimization::detail
