#pragma once

#include <vector>

#include <Eigen/Core>

namespace flyball::optimization::detail {

/// K = L D Lᵀ of a sparse symmetric matrix whose pattern stays, in an order of little fill.
///
/// The order does not look at values: factors exist for quasi-definite matrices, and for others
/// wherever no pivot vanishes; the signs of D are the matrix's inertia (Sylvester).
/// Source: Davis, "Algorithm 849: a concise sparse Cholesky factorization package" (2005);
/// Amestoy, Davis, Duff (1996), the order; Vanderbei, "Symmetric quasidefinite matrices" (1995).
class SparseLdlt {
 public:
  /// @param rows, columns  Of each entry; of (i, j) and (j, i) one is given. Entries of one place
  /// are added. @param size  Of the matrix. All of its diagonal must be among the entries.
  void analyze(int size, const std::vector<int>& rows, const std::vector<int>& columns);

  /// @param values  In the order of `analyze`'s entries. @return whether no pivot vanished.
  /// Cost: O(Σ column counts²); no allocation.
  [[nodiscard]] bool factor(const double* values);
  [[nodiscard]] int negative_pivots() const noexcept { return negative_; }
  /// x ← K⁻¹ x. No allocation.
  void solve(double* x);
  [[nodiscard]] std::size_t factor_entries() const noexcept { return li_.size(); }

 private:
  int size_ = 0;
  int negative_ = 0;
  std::vector<int> order_;    // new place of an old index
  std::vector<int> place_;    // of an entry among the values of the upper triangle
  std::vector<int> ap_, ai_;  // upper triangle, by columns
  std::vector<double> ax_;
  std::vector<int> lp_, li_, parent_, count_, flag_, pattern_;
  std::vector<double> lx_, d_, y_;
};

}  // namespace flyball::optimization::detail
