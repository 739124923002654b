#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/tape.hpp>
#include <flyball/optimization/problem/expression.hpp>

namespace flyball::optimization::detail {

/// A function that several terms share but for their variables and numbers: inputs are its
/// variables, then its numbers.
struct Shape {
  expression::Tape tape{};
  std::size_t variables = 0;
  std::size_t numbers = 0;
  /// Of each term: its variables, its numbers, the row it belongs to (-1: the cost), its factor.
  std::vector<int> columns{};
  std::vector<double> data{};
  std::vector<int> rows{};
  std::vector<double> factors{};
};

/// What a problem states, flat: cost, rows c(x) = 0 or c(x) ≥ 0, bounds; linear parts as numbers,
/// the rest as terms of few shapes.
struct FlatProblem {
  int variables = 0;
  std::vector<double> lower{}, upper{};              ///< Of the variables.
  std::vector<int> lower_from{}, upper_from{};       ///< The constraint that said so, or -1.
  std::vector<double> lower_slope{}, upper_slope{};  ///< Its slope by the variable.
  /// Rows: linear coefficients by rows, offsets, and which constraint each is.
  std::vector<int> row_start{0}, columns{};
  std::vector<double> coefficients{}, offsets{};
  std::vector<unsigned char> equality{};
  std::vector<int> constraint{};
  std::vector<double> cost_coefficients{};  ///< One a variable.
  double cost_offset = 0.0;
  double sign = 1.0;  ///< -1 where the cost was to be maximised.
  std::vector<Shape> shapes{};
  Degree cost_degree = Degree::constant;
  Degree equality_degree = Degree::constant;
  Degree inequality_degree = Degree::constant;
  /// A constraint that no point satisfies by itself (0 ≥ 1, or bounds that cross), and by how much.
  int impossible = -1;
  double impossible_by = 0.0;
  int not_finite = -1;  ///< A constraint with a number that is not; -2: the cost.

  [[nodiscard]] int rows() const noexcept { return static_cast<int>(offsets.size()); }
};

/// @param cost  May be a constant. @param sign  -1: maximise.
[[nodiscard]] FlatProblem flatten(const ExpressionGraph& graph, const Expression& cost, double sign,
                                  const Constraints& constraints);

}  // namespace flyball::optimization::detail
