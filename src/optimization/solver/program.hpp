#pragma once

#include <Eigen/Core>

/// What the interior-point method sees of a problem.
namespace flyball::optimization::detail {

/// Minimise f(w) subject to c(w) = 0 and lower ≤ w ≤ upper. Inequalities have slacks among w.
///
/// A program knows the structure of its KKT matrix and factorises it; nothing here allocates after
/// construction. Entries of w whose bounds are equal are fixed: they stand at their bound, and the
/// program's steps leave them there.
class Program {
 public:
  virtual ~Program() = default;

  /// f and c at a point. @return whether all is finite.
  [[nodiscard]] virtual bool values(const Eigen::VectorXd& w, double& f, Eigen::VectorXd& c) = 0;

  /// ∇f (of the objective alone, times `objective`), and within the program ∂c/∂w and the Hessian
  /// of objective·f + λᵀc. @return whether all is finite.
  [[nodiscard]] virtual bool derivatives(const Eigen::VectorXd& w, const Eigen::VectorXd& lambda,
                                         double objective, Eigen::VectorXd& gradient) = 0;

  /// out_w = H dw + Aᵀ dλ, out_c = A dw.
  virtual void multiply(const Eigen::VectorXd& dw, const Eigen::VectorXd& dl,
                        Eigen::VectorXd& out_w, Eigen::VectorXd& out_c) = 0;
  /// out = Aᵀ λ.
  virtual void transpose_multiply(const Eigen::VectorXd& lambda, Eigen::VectorXd& out) = 0;

  /// Factorises [H + diag, Aᵀ; A, -D], H left out if not `with_hessian`; a program may put a small
  /// number for a zero of D. @return whether it has the inertia (n, m, 0) of a minimum.
  [[nodiscard]] virtual bool factor(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& D,
                                    bool with_hessian) = 0;
  /// Solves it for the right-hand side (-rw, -rc).
  virtual void solve(const Eigen::VectorXd& rw, const Eigen::VectorXd& rc, Eigen::VectorXd& dw,
                     Eigen::VectorXd& dl) = 0;

  /// What `solve` found last, but with each variable that would leave its bounds kept at the one it
  /// meets, and what follows from it with that: `side` of it becomes -1 or 1.
  /// @param w  Where dw begins. @param side  0: within its bounds. @return whether one was kept;
  /// false where the program knows no order in which variables follow from each other.
  [[nodiscard]] virtual bool roll(const Eigen::VectorXd& /*w*/, Eigen::VectorXd& /*side*/,
                                  Eigen::VectorXd& /*dw*/) {
    return false;
  }

  [[nodiscard]] Eigen::Index variables() const noexcept { return lower.size(); }
  [[nodiscard]] Eigen::Index constraints() const noexcept { return constraint_count; }

  Eigen::VectorXd lower{}, upper{};  ///< Of w.
  Eigen::Index constraint_count = 0;

 protected:
  Program() = default;
  Program(const Program&) = default;
  Program& operator=(const Program&) = default;
};

}  // namespace flyball::optimization::detail
