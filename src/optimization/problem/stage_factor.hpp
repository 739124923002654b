#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "optimization/ocp/riccati_kernel.hpp"

namespace flyball::optimization::detail {

/// The sparse pattern in which stages are looked for.
struct SparsePattern {
  int variables = 0;
  int rows = 0;
  const std::vector<int>& row_start;  ///< Of c by x, by rows.
  const std::vector<int>& columns;
  const std::vector<double>& linear;            ///< Coefficients of the linear parts.
  const std::vector<unsigned char>& is_linear;  ///< Whether an entry is of the linear part alone.
  const std::vector<unsigned char>& equality;   ///< Of each row.
  const std::vector<int>& hessian_rows;         ///< Lower triangle.
  const std::vector<int>& hessian_columns;
  const std::vector<unsigned char>& fixed;  ///< Of each variable.
};

/// A sparse KKT system that is one of stages, factorised along them.
///
/// Stages are found from the fixed variables that come first: what shares rows with a stage's
/// states is its inputs and the next states. Between two stages each row must give one next state
/// from the stage before; all else must stay within a stage.
class StageFactor {
 public:
  /// @return whether there are stages, at least four of them, of at most 24 variables each.
  [[nodiscard]] bool find(const SparsePattern& pattern);

  /// New numbers of the Hessian's and the rows' entries, in the pattern's order.
  void set_values(const std::vector<double>& hessian, const std::vector<double>& rows);

  /// Factorises [H + diag, Aᵀ; A, -D] of the variables and rows of the pattern (slacks eliminated).
  /// @param diagonal  Of the variables first. @param D  Of each row, positive.
  /// @param soft  Whether D of rows between stages is more than a regularisation.
  [[nodiscard]] bool factor(const double* diagonal, const double* D, bool soft, bool with_hessian);
  /// @param rw  Of the variables. @param rc  Of the rows, slacks eliminated. Solves for (-rw, -rc).
  void solve(const double* rw, const double* rc, double* dw, double* dl);
  /// The forward sweep of the last `solve` again, stage by stage: inputs by its feedback, but not
  /// beyond their bounds; where a next state would leave its own, an input that is still within its
  /// bounds keeps it there. @return whether any was kept, as Program::roll.
  [[nodiscard]] bool roll(const double* w, const double* lower, const double* upper, double* side,
                          double* dw);

  [[nodiscard]] std::size_t stages() const noexcept { return system_.stages; }

 private:
  struct Move {
    std::uint32_t from;
    std::uint32_t to;
    double factor;
  };

  [[nodiscard]] bool find_levels(const SparsePattern& pattern);
  [[nodiscard]] bool join_by_inequalities(const SparsePattern& p, std::size_t known);
  [[nodiscard]] bool find_roles(const SparsePattern& pattern);
  [[nodiscard]] bool lay_out(const SparsePattern& pattern);

  std::vector<int> level_;              // of a variable, then its stage
  std::vector<int> output_;             // of a row: the next state that it gives, or -1
  std::vector<std::size_t> place_;      // of a variable among stages x size
  std::vector<int> variable_;           // of a place, or -1; made by the first `roll`
  std::vector<std::size_t> row_place_;  // of a row: among defects, or among the stages' own rows
  std::vector<double> scale_;           // of a row: -1 / coefficient of its output; 1 of others
  std::vector<Move> hessian_moves_, defect_moves_, row_moves_;
  StageSystem system_;
  std::vector<double> H_, AB_, G_, P_, E_, L_, pivots_, scratch_, diagonal_, D_, weight_, weighted_;
  std::vector<double> h_, b_, dz_, dl_, p_, g_;
  std::vector<std::size_t> first_row_;
  std::vector<unsigned char> fixed_;
};

}  // namespace flyball::optimization::detail
