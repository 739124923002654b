#include <flyball/math/equations/matrix_equation.hpp>

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/equations/lyapunov_kernel.hpp"
#include "math/equations/sylvester_kernel.hpp"
#include "math/extended/double_double.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

enum class Domain { continuous, discrete };

bool is_triangular(const MatrixXd& M) {
  for (Index j = 0; j + 1 < M.cols(); ++j) {
    if (!M.col(j).tail(M.rows() - j - 1).isZero(0.0)) {
      return false;
    }
  }
  return true;
}

/// As a product CᵀC is, whose entries are summed in different orders.
bool is_symmetric_but_for_rounding(const MatrixRef& Q) {
  for (Index j = 0; j < Q.cols(); ++j) {
    for (Index i = 0; i < j; ++i) {
      const double size = std::max(std::abs(Q(i, j)), std::sqrt(std::abs(Q(i, i) * Q(j, j))));
      if (!(std::abs(Q(i, j) - Q(j, i)) <= 16.0 * epsilon * size)) {
        return false;
      }
    }
  }
  return true;
}

/// M = D U T Uᴴ D⁻¹ with D powers of two.
struct Factor {
  Eigen::VectorXd d;
  MatrixXcd T;
  MatrixXcd U;
  bool converged = false;
  double uncertainty = 0.0;  ///< Of the eigenvalues, by rounding.
};

Factor factorize(const MatrixXd& M) {
  Factor f;
  f.d = detail::balance_of(M);
  const MatrixXd balanced = f.d.cwiseInverse().asDiagonal() * M * f.d.asDiagonal();
  if (is_triangular(balanced)) {
    f.T = balanced.cast<Complex>();
    f.U = MatrixXcd::Identity(M.rows(), M.cols());
    f.converged = true;
    return f;
  }
  detail::ComplexSchur schur = detail::complex_schur_of(balanced);
  f.T = std::move(schur.T);
  f.U = std::move(schur.U);
  f.converged = schur.converged;
  f.uncertainty = epsilon * balanced.norm();
  return f;
}

/// The factor of Mᵀ = D⁻¹ conj(U) Tᵀ Uᵀ D, with the order reversed so that it is upper triangular.
Factor transposed(const Factor& f) {
  return {f.d.cwiseInverse(), f.T.transpose().reverse(), f.U.conjugate().rowwise().reverse(),
          f.converged, f.uncertainty};
}

/// A X ± … as an operator on X, with its inverse by the triangular factors.
class Equation {
 public:
  Equation(Domain domain, const MatrixRef& A, const MatrixRef& B)
      : domain_(domain), A_(A), B_(B), a_(factorize(A)), b_(factorize(B)) {}

  /// The Lyapunov equation: B = Aᵀ shares the factors.
  Equation(Domain domain, const MatrixRef& A)
      : domain_(domain), A_(A), B_(A.transpose()), a_(factorize(A)), b_(transposed(a_)) {}

  [[nodiscard]] Expected<void> check(std::string_view where) const {
    if (!a_.converged || !b_.converged) {
      return tl::unexpected(
          Error(MatrixEquationError::no_convergence).in(std::string(where)).about("eigenvalues"));
    }
    double smallest = std::numeric_limits<double>::infinity();
    Complex worst_a;
    Complex worst_b;
    for (const Complex& a : a_.T.diagonal()) {
      for (const Complex& b : b_.T.diagonal()) {
        const bool continuous = domain_ == Domain::continuous;
        const double gap = continuous ? std::abs(a + b) : std::abs(a * b - 1.0);
        const double size = continuous ? std::abs(a) + std::abs(b) : std::abs(a * b) + 1.0;
        const double blur = continuous
                                ? a_.uncertainty + b_.uncertainty
                                : a_.uncertainty * std::abs(b) + b_.uncertainty * std::abs(a);
        const double ratio = gap == 0.0 ? 0.0 : gap / (epsilon * size + blur);
        if (ratio < smallest) {
          smallest = ratio;
          worst_a = a;
          worst_b = b;
        }
      }
    }
    if (smallest > 4.0) {
      return {};
    }
    return tl::unexpected(
        Error(MatrixEquationError::no_unique_solution)
            .in(std::string(where))
            .got(domain_ == Domain::continuous ? "two eigenvalues with the sum zero"
                                               : "two eigenvalues with the product one")
            .with("eigenvalue", std::vector<double>{worst_a.real(), worst_a.imag()})
            .with("eigenvalue of the other side",
                  std::vector<double>{worst_b.real(), worst_b.imag()}));
  }

  /// The X of A X + X B = F, or of A X B - X = F.
  [[nodiscard]] MatrixXd solve(const MatrixXd& F) const {
    MatrixXcd Y = transform(F);
    const MatrixXcd& S = a_.T;
    const MatrixXcd& T = b_.T;
    Eigen::VectorXcd known(Y.rows());
    for (Index j = 0; j < Y.cols(); ++j) {
      // Column j of S Y + Y T, or of S Y T - Y, by back substitution.
      const Complex t = T(j, j);
      const bool continuous = domain_ == Domain::continuous;
      if (continuous) {
        for (Index k = 0; k < j; ++k) {
          Y.col(j) -= T(k, j) * Y.col(k);
        }
      } else {
        known.setZero();
        for (Index k = 0; k < j; ++k) {
          known += T(k, j) * Y.col(k);
        }
        for (Index k = 0; k < S.cols(); ++k) {
          Y.col(j).head(k + 1) -= known(k) * S.col(k).head(k + 1);
        }
      }
      for (Index k = Y.rows() - 1; k >= 0; --k) {
        const Complex pivot = continuous ? S(k, k) + t : S(k, k) * t - 1.0;
        const Complex y = Y(k, j) / pivot;
        Y(k, j) = y;
        Y.col(j).head(k) -= (continuous ? y : y * t) * S.col(k).head(k);
      }
    }
    const MatrixXcd left = detail::complex_product(a_.U, Y);
    const MatrixXd X = detail::complex_product(left, b_.U.adjoint()).real();
    return a_.d.asDiagonal() * X * b_.d.cwiseInverse().asDiagonal();
  }

  /// F minus the operator applied to X, in twice the working precision.
  [[nodiscard]] MatrixXd residual(const MatrixXd& X, const MatrixXd& F) const {
    using detail::add_product;
    using Matrix = detail::DoubleDoubleMatrix;
    if (domain_ == Domain::continuous) {
      const Matrix rest = add_product(Matrix(F), -1.0, Matrix(A_), Matrix(X));
      return add_product(rest, -1.0, Matrix(X), Matrix(B_)).rounded();
    }
    const Matrix rest = sum(Matrix(F), 1.0, Matrix(X));
    return add_product(rest, -1.0, Matrix(A_), detail::product(Matrix(X), Matrix(B_))).rounded();
  }

  /// The same in working precision.
  [[nodiscard]] MatrixXd defect(const MatrixXd& X, const MatrixXd& F) const {
    if (domain_ == Domain::continuous) {
      return F - detail::product(A_, X) - detail::product(X, B_);
    }
    return F + X - detail::product(A_, detail::product(X, B_));
  }

  /// The sum of the norms of the equation's terms.
  [[nodiscard]] double scale(const MatrixXd& X, const MatrixXd& F) const {
    if (domain_ == Domain::continuous) {
      return detail::product(A_, X).norm() + detail::product(X, B_).norm() + F.norm();
    }
    return detail::product(A_, detail::product(X, B_)).norm() + X.norm() + F.norm();
  }

 private:
  [[nodiscard]] MatrixXcd transform(const MatrixXd& F) const {
    const MatrixXd scaled = a_.d.cwiseInverse().asDiagonal() * F * b_.d.asDiagonal();
    const MatrixXcd left = detail::complex_product(a_.U.adjoint(), scaled.cast<Complex>());
    return detail::complex_product(left, b_.U);
  }

  Domain domain_;
  MatrixXd A_;
  MatrixXd B_;
  Factor a_;
  Factor b_;
};

Expected<LinearMatrixSolution> solve(const Equation& equation, const MatrixXd& F, bool symmetric,
                                     std::string_view where) {
  FLYBALL_CHECK(equation.check(where));
  LinearMatrixSolution solution;
  MatrixXd& X = solution.X;
  X = equation.solve(F);
  double previous = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 10 && X.allFinite(); ++pass) {
    const MatrixXd correction = equation.solve(equation.residual(X, F));
    const double step = correction.norm();
    if (!std::isfinite(step) || !(step < 0.5 * previous)) {
      break;
    }
    X += correction;
    if (symmetric) {
      X = detail::symmetrized(X);
    }
    // The next step would be as much smaller than this one as this one is than X.
    if (step <= 1e-12 * X.norm()) {
      break;
    }
    previous = step;
  }
  if (!X.allFinite()) {
    return tl::unexpected(Error(MatrixEquationError::overflow).in(std::string(where)));
  }
  const double scale = equation.scale(X, F);
  solution.residual = scale > 0.0 ? equation.defect(X, F).norm() / scale : 0.0;
  // ‖L⁻¹‖ from two matrices of signs, which no direction is orthogonal to.
  double gain = 0.0;
  for (const Index stride : {1, 3}) {
    MatrixXd signs(X.rows(), X.cols());
    for (Index k = 0; k < signs.size(); ++k) {
      signs(k) = (k * stride + k / 5) % 2 == 0 ? 1.0 : -1.0;
    }
    gain = std::max(gain, equation.solve(signs).norm() / signs.norm());
  }
  solution.condition = X.norm() > 0.0 ? std::max(1.0, gain * scale / X.norm()) : gain;
  return solution;
}

/// What the kernel makes of A X + X B = F or A X B - X = F, B null: Aᵀ; false where it does not
/// vouch for it.
bool solve_quickly(Domain domain, const MatrixRef& A, const MatrixRef* B, const MatrixXd& F,
                   bool symmetric, LinearMatrixSolution& solution) {
  if (A.outerStride() != A.rows() || (B != nullptr && B->outerStride() != B->rows())) {
    return false;
  }
  solution.X.resize(F.rows(), F.cols());
  detail::SylvesterAnswer answer{solution.X.data()};
  if (!detail::solve_sylvester_quickly(
          {static_cast<int>(F.rows()), static_cast<int>(F.cols()), domain == Domain::continuous,
           symmetric, A.data(), B == nullptr ? nullptr : B->data(), F.data()},
          answer) ||
      !solution.X.allFinite()) {
    return false;
  }
  solution.residual = answer.residual;
  solution.condition = answer.condition;
  return true;
}

Expected<LinearMatrixSolution> solve_lyapunov(Domain domain, const MatrixRef& A, const MatrixRef& Q,
                                              std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .shape(Q, A.rows(), A.rows(), "Q", "states x states")
                    .finite(A, "A")
                    .finite(Q, "Q"));
  const bool symmetric = Q == Q.transpose();
  LinearMatrixSolution solution;
  if (is_symmetric_but_for_rounding(Q) && A.outerStride() == A.rows() &&
      Q.outerStride() == Q.rows()) {
    solution.X.resize(A.rows(), A.rows());
    detail::LyapunovAnswer answer{solution.X.data()};
    if (detail::solve_stable_lyapunov(
            {static_cast<int>(A.rows()), domain == Domain::continuous, A.data(), Q.data()},
            answer)) {
      solution.residual = answer.residual;
      solution.condition = answer.condition;
      return solution;
    }
  }
  const MatrixXd F = -Q;
  if (solve_quickly(domain, A, nullptr, F, symmetric, solution)) {
    return solution;
  }
  return solve(Equation(domain, A), F, symmetric, where);
}

Expected<LinearMatrixSolution> solve_sylvester(Domain domain, const MatrixRef& A,
                                               const MatrixRef& B, const MatrixRef& C,
                                               std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .square(B, "B")
                    .shape(C, A.rows(), B.rows(), "C", "rows of A x columns of B")
                    .finite(A, "A")
                    .finite(B, "B")
                    .finite(C, "C"));
  const double sign = domain == Domain::continuous ? 1.0 : -1.0;
  const MatrixXd F = sign * C;
  LinearMatrixSolution solution;
  if (solve_quickly(domain, A, &B, F, false, solution)) {
    return solution;
  }
  return solve(Equation(domain, A, B), F, false, where);
}

}  // namespace

ErrorInfo error_info(MatrixEquationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_unique_solution", "the equation has no unique solution", ErrorKind::no_answer},
      {"no_convergence", "the eigenvalues could not be computed", ErrorKind::no_answer},
      {"overflow", "the solution exceeds the largest double", ErrorKind::no_answer},
  };
  return detail::info_of(code, "matrix_equation", rows);
}

Expected<LinearMatrixSolution> lyapunov(const MatrixRef& A, const MatrixRef& Q) {
  return solve_lyapunov(Domain::continuous, A, Q, "lyapunov");
}

Expected<LinearMatrixSolution> discrete_lyapunov(const MatrixRef& A, const MatrixRef& Q) {
  return solve_lyapunov(Domain::discrete, A, Q, "discrete_lyapunov");
}

Expected<LinearMatrixSolution> sylvester(const MatrixRef& A, const MatrixRef& B,
                                         const MatrixRef& C) {
  return solve_sylvester(Domain::continuous, A, B, C, "sylvester");
}

Expected<LinearMatrixSolution> discrete_sylvester(const MatrixRef& A, const MatrixRef& B,
                                                  const MatrixRef& C) {
  return solve_sylvester(Domain::discrete, A, B, C, "discrete_sylvester");
}

}  // namespace flyball
