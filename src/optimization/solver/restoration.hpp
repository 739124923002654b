#pragma once

#include <Eigen/Core>

#include "optimization/solver/program.hpp"

namespace flyball::optimization::detail {

class InteriorPoint;

/// The least violation of a program's constraints near a point: min ρ Σ (p + n) + ζ/2 |D (w -
/// w_R)|² subject to c(w) - p + n = 0, p, n ≥ 0 and the bounds of w.
///
/// p and n are eliminated, which leaves a KKT system of the program's own structure with a diagonal
/// in the place of its zero.
/// Source: Wächter, Biegler (2006), section 3.3.
class RestorationProgram final : public Program {
 public:
  explicit RestorationProgram(Program& program);

  void set_reference(const Eigen::VectorXd& w, double mu);
  /// Sets the start of a solver of this: p and n that balance c at the barrier μ.
  void begin(const Eigen::VectorXd& w, const Eigen::VectorXd& c, double mu,
             const Eigen::VectorXd& zl, const Eigen::VectorXd& zu, InteriorPoint& solver);

  [[nodiscard]] bool values(const Eigen::VectorXd& w, double& f, Eigen::VectorXd& c) override;
  [[nodiscard]] bool derivatives(const Eigen::VectorXd& w, const Eigen::VectorXd& lambda,
                                 double objective, Eigen::VectorXd& gradient) override;
  void multiply(const Eigen::VectorXd& dw, const Eigen::VectorXd& dl, Eigen::VectorXd& out_w,
                Eigen::VectorXd& out_c) override;
  void transpose_multiply(const Eigen::VectorXd& lambda, Eigen::VectorXd& out) override;
  [[nodiscard]] bool factor(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& D,
                            bool with_hessian) override;
  void solve(const Eigen::VectorXd& rw, const Eigen::VectorXd& rc, Eigen::VectorXd& dw,
             Eigen::VectorXd& dl) override;

 private:
  Program& program_;
  Eigen::Index n_;
  Eigen::Index m_;
  double zeta_ = 0.0;
  Eigen::VectorXd reference_, weight_;               // n: w_R, D²
  Eigen::VectorXd part_, part_gradient_;             // n
  Eigen::VectorXd diagonal_, rw_, dw_;               // n
  Eigen::VectorXd D_, rc_, dl_, sigma_p_, sigma_n_;  // m
};

}  // namespace flyball::optimization::detail
