#pragma once

#include <Eigen/Core>

#include <flyball/core/function_ref.hpp>
#include <flyball/optimization/solver/solution.hpp>

#include "optimization/solver/bound_kernel.hpp"
#include "optimization/solver/program.hpp"

namespace flyball::optimization::detail {

/// Mehrotra's predictor-corrector method for programs whose cost is quadratic and whose rows are
/// linear: min ½ wᵀHw + gᵀw subject to A w + c₀ = 0, lower ≤ w ≤ upper. No allocation after
/// construction.
/// Source: Mehrotra (1992); Nocedal, Wright (2006), sections 14.2 and 16.6; certificates: Farkas's
/// lemma.
class QuadraticMethod {
 public:
  /// @param program  Must outlive this.
  explicit QuadraticMethod(Program& program);

  using Watch = FunctionRef<bool(const Iteration&)>;
  /// @return no_progress where it is not convex, or rounding wins.
  /// @param warm  From what w, λ and z are now.
  [[nodiscard]] SolveStatus run(const SolverOptions& options, Watch watch, bool warm);

  [[nodiscard]] const Eigen::VectorXd& w() const noexcept { return w_; }
  [[nodiscard]] const Eigen::VectorXd& lambda() const noexcept { return lambda_; }
  [[nodiscard]] const Eigen::VectorXd& lower_multipliers() const noexcept { return zl_; }
  [[nodiscard]] const Eigen::VectorXd& upper_multipliers() const noexcept { return zu_; }
  [[nodiscard]] const Eigen::VectorXd& constraint_values() const noexcept { return c_; }
  /// Weights of the rows that no point satisfies, or a direction of descent without end.
  [[nodiscard]] const Eigen::VectorXd& certificate() const noexcept { return certificate_; }
  [[nodiscard]] double objective() const noexcept { return f_; }
  [[nodiscard]] const Iteration& last() const noexcept { return last_; }
  [[nodiscard]] const SolverCounts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] bool take_constants();
  [[nodiscard]] bool factor(bool is_convex);
  [[nodiscard]] bool settle(const SolverOptions& options);
  [[nodiscard]] bool begin(bool warm);
  void residuals();
  void distances();
  [[nodiscard]] bool converged(double tolerance);
  /// @param refined  Whether what the system leaves is solved for again.
  void solve(Eigen::VectorXd& dw, Eigen::VectorXd& dl, bool refined);
  [[nodiscard]] bool proves_infeasible();
  [[nodiscard]] bool proves_unbounded();

  Program& program_;
  [[nodiscard]] BoundArrays bound_arrays();

  Eigen::VectorXd w_, lambda_, zl_, zu_, sl_, su_, free_;
  Eigen::VectorXd low_, high_, has_low_, has_high_;  // as the sweeps over bounds take them
  Eigen::VectorXd g_, c0_, c_, rd_, diagonal_, D_, rw_, dw_, dl_, dzl_, dzu_, affine_w_, affine_l_;
  Eigen::VectorXd residual_w_, residual_c_, fix_w_, fix_c_, hw_, hc_, certificate_, low_target_,
      high_target_, il_, iu_;
  Eigen::VectorXd middle_w_, middle_lambda_, middle_zl_, middle_zu_;  // where the next run begins
  bool has_middle_ = false;
  BoundErrors errors_;
  double f_ = 0.0, f0_ = 0.0, mu_ = 0.0, size_ = 1.0;
  int pairs_ = 0;
  bool has_curvature_ = false;
  bool refined_ = false;
  Iteration last_;
  SolverCounts counts_;
};

}  // namespace flyball::optimization::detail
