#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <flyball/optimization/problem/expression.hpp>

/// Absolute values, minima and maxima, stated without kinks.
namespace flyball::optimization::detail {

/// A problem in which |e|, √(e²), max(a, b) and min(a, b) are variables t with t ≥ ±e, t ≥ a and b,
/// or t ≤ a and b, where that says the same: where nothing is won by a t beyond them, as in a sum
/// that is minimised.
/// Source: Boyd, Vandenberghe, "Convex optimization" (2004), section 4.1.3.
class KinkFree {
 public:
  /// Nothing that is kept refers to the arguments. A kink keeps its variable when it is lifted
  /// again.
  /// @return whether there was one to be lifted; if not, `cost` and `constraints` are empty.
  [[nodiscard]] bool state(ExpressionGraph& graph, const Expression& of_cost, double sign,
                           const Constraints& of_constraints);
  /// Gives the variables the values that their kinks have at the others'.
  void start(ExpressionGraph& graph) const;
  /// Whether a variable of the graph is one of them.
  [[nodiscard]] bool is_own(const ExpressionGraph& graph, std::size_t variable) const;

  Expression cost{};
  Constraints constraints{};  ///< Those that were given, then those of the variables.

 private:
  std::vector<std::uint32_t> kinks_;                              // nodes, of the last statement
  std::unordered_map<std::uint32_t, std::uint32_t> variable_of_;  // nodes, of a kink's node
};

}  // namespace flyball::optimization::detail
