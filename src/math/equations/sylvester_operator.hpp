#pragma once

#include <complex>
#include <limits>
#include <optional>
#include <string_view>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball::detail {

enum class Domain { continuous, discrete };

/// M = D U T Uᴴ D⁻¹ with D powers of two.
struct TriangularFactor {
  Eigen::VectorXd d;
  Eigen::MatrixXcd T;
  Eigen::MatrixXcd U;
  bool converged = false;
  double uncertainty = 0.0;  ///< Of the eigenvalues, by rounding.
};

/// F minus A X + X B or A X B - X, in twice the working precision.
[[nodiscard]] Eigen::MatrixXd sylvester_residual(Domain domain, const Eigen::MatrixXd& A,
                                                 const Eigen::MatrixXd& B, const Eigen::MatrixXd& X,
                                                 const Eigen::MatrixXd& F);
/// |A||X| + |X||B| + |F|, or |A||X||B| + |X| + |F|: what the terms of each entry add up to.
[[nodiscard]] Eigen::MatrixXd sylvester_terms(Domain domain, const Eigen::MatrixXd& A,
                                              const Eigen::MatrixXd& B, const Eigen::MatrixXd& X,
                                              const Eigen::MatrixXd& F);

/// The largest entry of a residual beside the terms of that entry: the relative change of A, B and
/// F of which X is the exact solution, entry by entry.
struct BackwardError {
  double strict = std::numeric_limits<double>::infinity();
  /// Where an entry whose terms are below a thousandth of what its row and its column have
  /// elsewhere counts as if they were that.
  double in_context = std::numeric_limits<double>::infinity();
};

/// A X + X B (continuous) or A X B - X (discrete) as an operator on X, with its inverse by the
/// triangular factors (Bartels and Stewart, Comm. ACM 15 (1972)). A and B of ordinary size.
class SylvesterOperator {
 public:
  SylvesterOperator(Domain domain, const MatrixRef& A, const MatrixRef& B);
  /// The Lyapunov operator: B = Aᵀ shares the factors.
  SylvesterOperator(Domain domain, const MatrixRef& A);

  /// That no two eigenvalues cancel but for rounding.
  /// @errors MatrixEquationError::no_convergence, and those of `not_solved`.
  [[nodiscard]] Expected<void> check(std::string_view where) const;

  /// MatrixEquationError::no_unique_solution with the two eigenvalues that cancel, or not_accurate
  /// with those that rounding cannot tell from it.
  [[nodiscard]] Error not_solved(std::string_view where) const;

  /// The X of A X + X B = F, or of A X B - X = F.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& F) const;

  [[nodiscard]] Eigen::MatrixXd residual(const Eigen::MatrixXd& X, const Eigen::MatrixXd& F) const {
    return sylvester_residual(domain_, A_, B_, X, F);
  }
  [[nodiscard]] Eigen::MatrixXd terms(const Eigen::MatrixXd& X, const Eigen::MatrixXd& F) const {
    return sylvester_terms(domain_, A_, B_, X, F);
  }

  [[nodiscard]] BackwardError backward_error(const Eigen::MatrixXd& X,
                                             const Eigen::MatrixXd& F) const;

  [[nodiscard]] Domain domain() const noexcept { return domain_; }
  [[nodiscard]] const Eigen::MatrixXd& A() const noexcept { return A_; }
  [[nodiscard]] const Eigen::MatrixXd& B() const noexcept { return B_; }

 private:
  /// An eigenvalue of A and one of B.
  struct Pair {
    std::complex<double> a;
    std::complex<double> b;
    double distance = std::numeric_limits<double>::infinity();  ///< From cancelling, in roundings.
    double gap = 0.0;                                           ///< The same beside their size.
  };
  [[nodiscard]] Pair closest_pair() const;
  [[nodiscard]] Eigen::MatrixXcd transform(const Eigen::MatrixXd& F) const;

  Domain domain_;
  Eigen::MatrixXd A_;
  Eigen::MatrixXd B_;
  TriangularFactor a_;
  TriangularFactor b_;
};

/// The same equation as one of n m unknowns, by LU in twice the working precision: for data whose
/// entries lie so far apart that no orthogonal transformation keeps them. O(n³m³).
struct KroneckerSolution {
  Eigen::MatrixXd X;
  /// How much relative errors of single entries of the data grow in X's; infinite, and no X, where
  /// the operator is singular to twice the working precision.
  double condition = std::numeric_limits<double>::infinity();
};
/// Nothing for more than a hundred unknowns.
[[nodiscard]] std::optional<KroneckerSolution> solve_kronecker(const SylvesterOperator& equation,
                                                               const Eigen::MatrixXd& F);

}  // namespace flyball::detail
