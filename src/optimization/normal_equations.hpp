#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <flyball/optimization/factor_graph.hpp>

namespace flyball::optimization::detail {

using Eigen::Index;
using Eigen::VectorXd;

/// H = Σ w JᵀJ and g = Σ w Jᵀr of a graph's factors, w the slope of their losses, in an order of
/// the variables of least fill. The pattern is found once; `linearize` fills it anew.
class NormalEquations {
 public:
  /// Sets the graph's offsets: a step is in the order of the elimination.
  explicit NormalEquations(GraphFunctions& graph);

  /// H and g at the values of now. @return  Whether all is finite; else `failed` is the factor.
  [[nodiscard]] bool linearize(std::size_t& failed);
  [[nodiscard]] double cost() const noexcept { return cost_; }
  [[nodiscard]] const VectorXd& gradient() const noexcept { return gradient_; }
  [[nodiscard]] Index unknowns() const noexcept { return gradient_.size(); }

  /// step = -(H + λ diag(H))⁻¹ g. @return  Whether that is positive definite.
  [[nodiscard]] bool solve(double damping, VectorXd& step);
  /// What (H + λ diag H) adds for a step: λ stepᵀ diag(H) step.
  [[nodiscard]] double damping_part(double damping, const VectorXd& step) const;
  /// The variable of an entry of a step.
  [[nodiscard]] int variable_of(Index entry) const;
  /// The first entry whose pivot is lost in rounding, or -1: H is singular to working precision.
  [[nodiscard]] Index lost_pivot();
  /// The entries of a factor of H.
  [[nodiscard]] Index factor_nonzeros() const;
  /// The diagonal blocks of H⁻¹ by variable; after `solve(0.0, …)`.
  [[nodiscard]] std::vector<Eigen::MatrixXd> inverse_blocks() const;

 private:
  /// Where the product of a factor's Jacobians of two of its variables stands in H.
  struct Place {
    int row_variable, column_variable;  ///< Among the factor's own.
    int row_begin, column_begin;        ///< In the factor's Jacobian.
    int row_size, column_size;
    Index value;   ///< Of the first entry among the values of H.
    Index stride;  ///< From a column to the next.
  };

  void order();
  void lay_out();

  GraphFunctions& graph_;
  std::vector<int> position_;      ///< Of each variable in the order of elimination.
  Eigen::SparseMatrix<double> H_;  ///< Upper triangle by blocks, in the order of elimination.
  std::vector<Index> diagonal_;    ///< Of H among its values.
  std::vector<Place> places_;      ///< One factor after the other.
  std::vector<std::size_t> first_place_;
  VectorXd gradient_, diagonal_of_H_;
  double cost_ = 0.0;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper, Eigen::NaturalOrdering<int>>
      cholesky_;
};

}  // namespace flyball::optimization::detail
