#pragma once

#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/function_ref.hpp>
#include <flyball/optimization/solver/solution.hpp>

#include "optimization/solver/filter.hpp"
#include "optimization/solver/program.hpp"

namespace flyball::optimization::detail {

/// A primal-dual interior-point method with a filter line search.
///
/// min f(w) - μ Σ ln(w - lower) - μ Σ ln(upper - w) subject to c(w) = 0 for μ → 0, by Newton's
/// method; second-order corrections, and a phase that restores feasibility where the line search
/// fails. All memory is allocated by the constructor (that of the restoration phase when it is
/// first needed).
/// Source: Wächter, Biegler (2006); Nocedal, Wright, "Numerical optimization" (2006), chapter 19.
class InteriorPoint {
 public:
  /// @param program  Must outlive this.
  explicit InteriorPoint(Program& program);
  ~InteriorPoint();
  InteriorPoint(const InteriorPoint&) = delete;
  InteriorPoint& operator=(const InteriorPoint&) = delete;

  /// Where to start: w is moved into the bounds' interior. Multipliers become zero.
  void start(const Eigen::VectorXd& w);
  /// Lets the next run begin, after a change of the program's numbers, at a point of the central
  /// path that the last run went through: at its end where that still holds, else at the smallest
  /// barrier that is not less than the violation which the change made, so that what the bounds
  /// leave of the first steps is most of them. Where the first step is short all the same, or
  /// three in a row are, the run goes back to a point of a larger barrier.
  /// @param mu  Not below this barrier; 0: any.
  /// @return false, and nothing done, if no run has been solved before.
  /// Source: Yildirim, Wright, "Warm-start strategies in interior-point methods for linear
  /// programming" (2002).
  [[nodiscard]] bool warm_start(double mu);

  /// After each accepted step; true: stop with `stopped`.
  using Watch = FunctionRef<bool(const Iteration&)>;
  [[nodiscard]] SolveStatus run(const SolverOptions& options, Watch watch);

  [[nodiscard]] const Eigen::VectorXd& w() const noexcept { return w_; }
  [[nodiscard]] const Eigen::VectorXd& lambda() const noexcept { return lambda_; }
  [[nodiscard]] const Eigen::VectorXd& lower_multipliers() const noexcept { return zl_; }
  [[nodiscard]] const Eigen::VectorXd& upper_multipliers() const noexcept { return zu_; }
  [[nodiscard]] const Eigen::VectorXd& constraint_values() const noexcept { return c_; }
  [[nodiscard]] const Iteration& last() const noexcept { return last_; }
  [[nodiscard]] double objective() const noexcept { return f_; }
  [[nodiscard]] const SolverCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] double mu() const noexcept { return mu_; }

 private:
  friend class RestorationProgram;
  struct Errors {
    double dual = 0.0;
    double primal = 0.0;
    double complementarity = 0.0;
    [[nodiscard]] double largest() const noexcept;
  };

  [[nodiscard]] Errors errors(double mu) const;
  [[nodiscard]] double barrier(const Eigen::VectorXd& w, double f) const;
  void distances();
  void dual_residual();
  [[nodiscard]] bool direction();
  void refine(Eigen::VectorXd& dw, Eigen::VectorXd& dl, const Eigen::VectorXd& rw,
              const Eigen::VectorXd& rc);
  [[nodiscard]] double primal_step(const Eigen::VectorXd& dw, double tau) const;
  [[nodiscard]] double dual_step(double tau) const;
  [[nodiscard]] bool search();
  void accept(double alpha, double alpha_dual);
  void damp(double theta, const Errors& error);
  [[nodiscard]] SolveStatus restore(const SolverOptions& options, double seconds_left, Watch watch);
  void begin_filter();
  void reset_filter();
  void bound_multipliers();

  Program& program_;
  Eigen::VectorXd w_, lambda_, zl_, zu_, sl_, su_, c_, gradient_, rd_, rw_;
  Eigen::VectorXd dw_, dl_, dzl_, dzu_, diagonal_, D_, residual_w_, residual_c_, fix_w_, fix_c_,
      fix_zl_, fix_zu_;
  Eigen::VectorXd trial_, trial_c_, corrected_c_, step_w_, step_l_, free_;
  double f_ = 0.0, trial_f_ = 0.0, mu_ = 0.1, theta_max_ = 0.0, theta_min_ = 0.0;
  double regularization_ = 0.0, last_regularization_ = 0.0, tau_ = 0.99;
  double regularization_growth_ = 4.0;
  double damping_ = 0.0;  // of the Hessian, where steps are cut short
  int cut_steps_ = 0;     // in a row
  bool was_damped_ = false;
  bool is_cut_ = false;  // whether the line search took less than half of what the bounds allow
  double first_primal_ = 0.0, first_mu_ = 0.0;
  bool derivatives_fresh_ = false;
  bool is_restoration_ = false;
  /// A point of the central path that a run went through.
  struct Level {
    double mu = 0.0;
    Eigen::VectorXd w{}, lambda{}, zl{}, zu{};
  };
  void keep_level();
  void load_level(const Level& level);
  [[nodiscard]] bool evaluate();
  [[nodiscard]] bool choose_level(const SolverOptions& options);
  [[nodiscard]] bool retreat();
  static constexpr int most_levels = 12;
  std::vector<Level> levels_;  // of falling barriers, the last run's end last
  int level_count_ = 0;
  int level_at_ = 0;  // where a warm run began
  bool is_warm_ = false;
  double least_level_ = 0.0;
  Filter filter_;
  Iteration last_;
  SolverCounts counts_;
  struct Restoration;
  std::unique_ptr<Restoration> restoration_;
};

}  // namespace flyball::optimization::detail
