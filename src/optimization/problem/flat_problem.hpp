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
  /// Of each number of the terms: the node it is the value of; `factor_of_part`: what a part of a
  /// sum is multiplied by. Only where there are parameters.
  std::vector<std::uint32_t> data_nodes{};
};
inline constexpr std::uint32_t factor_of_part = 0xFFFFFFFFU;

/// slope x + offset ≥ 0, or = 0: a constraint that is a bound.
struct BoundStatement {
  int variable = 0;
  double slope = 0.0;
  double offset = 0.0;
  bool equality = false;
  int number = 0;  ///< Of the constraint.
};

/// A constraint whose numbers depend on parameters, and where they stand.
struct ParametricConstraint {
  int number = 0;
  int row = -1;               ///< Or -1: it is a bound.
  std::size_t bound = 0;      ///< Its statement.
  std::ptrdiff_t shape = -1;  ///< Of its term, or -1: it has none.
  std::size_t term = 0;
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

  std::vector<BoundStatement> bounds{};
  /// What depends on parameters, in the order in which it was found.
  std::vector<std::uint32_t> parametric_nodes{};  ///< Of constant degree.
  std::vector<double> numbers{};                  ///< Of the nodes of constant degree.
  std::vector<ParametricConstraint> parametric{};
  struct Term {
    std::size_t shape;
    std::size_t term;
  };
  std::vector<Term> cost_terms{};  ///< Where the cost depends on parameters.
  bool cost_is_parametric = false;
  bool structure_is_parametric = false;  ///< A parameter is an exponent.

  [[nodiscard]] int rows() const noexcept { return static_cast<int>(offsets.size()); }
};

/// @param cost  May be a constant. @param sign  -1: maximise.
[[nodiscard]] FlatProblem flatten(const ExpressionGraph& graph, const Expression& cost, double sign,
                                  const Constraints& constraints);

/// Gives a flat problem the numbers that it has with other values of the parameters.
/// @return false where that is not enough: a parameter is an exponent, a number is not finite, or
/// no point is within the bounds. The numbers are then half the old ones; `flatten` says more.
/// Cost: linear in the parts of what depends on parameters, and in the bounds.
[[nodiscard]] bool renew_numbers(const ExpressionGraph& graph, const Expression& cost,
                                 const Constraints& constraints, FlatProblem& flat);

}  // namespace flyball::optimization::detail
