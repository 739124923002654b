#include <cmath>
#include <complex>
#include <vector>

#include <flyball/math/equations/matrix_equation.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/equations/sylvester_operator.hpp"
#include "math/extended/double_double.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

bool is_triangular(const MatrixXd& M) {
  for (Index j = 0; j + 1 < M.cols(); ++j) {
    if (!M.col(j).tail(M.rows() - j - 1).isZero(0.0)) {
      return false;
    }
  }
  return true;
}

TriangularFactor factorize(const MatrixXd& M) {
  TriangularFactor f;
  f.d = balance_of(M);
  const MatrixXd balanced = f.d.cwiseInverse().asDiagonal() * M * f.d.asDiagonal();
  if (is_triangular(balanced)) {
    f.T = balanced.cast<Complex>();
    f.U = MatrixXcd::Identity(M.rows(), M.cols());
    f.converged = true;
    return f;
  }
  // Single shifts, by rotations, keep more of the small entries of a graded matrix than the real
  // form.
  ComplexSchur schur = complex_schur_of_complex(balanced.cast<Complex>());
  f.T = std::move(schur.T);
  f.U = std::move(schur.U);
  f.converged = schur.converged;
  f.uncertainty = epsilon * balanced.norm();
  return f;
}

/// The factor of Mᵀ = D⁻¹ conj(U) Tᵀ Uᵀ D, with the order reversed so that it is upper triangular.
TriangularFactor transposed(const TriangularFactor& f) {
  return {f.d.cwiseInverse(), f.T.transpose().reverse(), f.U.conjugate().rowwise().reverse(),
          f.converged, f.uncertainty};
}

/// The largest of |M_ij| / |S_ij|, where an S_ij below `least` of what its row and its column have
/// elsewhere counts as that; NaN where an entry is.
double largest_share(const MatrixXd& M, const MatrixXd& S, double least) {
  const Eigen::RowVectorXd column = S.cwiseAbs().colwise().maxCoeff();
  double worst = 0.0;
  for (Index i = 0; i < S.rows(); ++i) {
    double row = 0.0;
    for (Index j = 0; j < S.cols(); ++j) {
      row = column(j) > 0.0 ? std::max(row, std::abs(S(i, j)) / column(j)) : row;
    }
    for (Index j = 0; j < S.cols(); ++j) {
      if (M(i, j) != 0.0) {
        const double size = std::max(std::abs(S(i, j)), least * row * column(j));
        const double share = std::abs(M(i, j)) / size;
        if (std::isnan(share)) {
          return share;
        }
        worst = std::max(worst, share);
      }
    }
  }
  return worst;
}

}  // namespace

MatrixXd sylvester_residual(Domain domain, const MatrixXd& A, const MatrixXd& B, const MatrixXd& X,
                            const MatrixXd& F) {
  using Matrix = DoubleDoubleMatrix;
  if (domain == Domain::continuous) {
    const Matrix rest = add_product(Matrix(F), -1.0, Matrix(A), Matrix(X));
    return add_product(rest, -1.0, Matrix(X), Matrix(B)).rounded();
  }
  const Matrix rest = sum(Matrix(F), 1.0, Matrix(X));
  return add_product(rest, -1.0, Matrix(A), product(Matrix(X), Matrix(B))).rounded();
}

MatrixXd sylvester_terms(Domain domain, const MatrixXd& A, const MatrixXd& B, const MatrixXd& X,
                         const MatrixXd& F) {
  const MatrixXd size = X.cwiseAbs();
  const MatrixXd right = product(size, B.cwiseAbs());
  if (domain == Domain::continuous) {
    return product(A.cwiseAbs(), size) + right + F.cwiseAbs();
  }
  return product(A.cwiseAbs(), right) + size + F.cwiseAbs();
}

SylvesterOperator::SylvesterOperator(Domain domain, const MatrixRef& A, const MatrixRef& B)
    : domain_(domain), A_(A), B_(B), a_(factorize(A)), b_(factorize(B)) {}

SylvesterOperator::SylvesterOperator(Domain domain, const MatrixRef& A)
    : domain_(domain), A_(A), B_(A.transpose()), a_(factorize(A)), b_(transposed(a_)) {}

SylvesterOperator::Pair SylvesterOperator::closest_pair() const {
  Pair pair;
  for (const Complex& a : a_.T.diagonal()) {
    for (const Complex& b : b_.T.diagonal()) {
      const bool continuous = domain_ == Domain::continuous;
      const double gap = continuous ? std::abs(a + b) : std::abs(a * b - 1.0);
      const double size = continuous ? std::abs(a) + std::abs(b) : std::abs(a * b) + 1.0;
      const double blur = continuous ? a_.uncertainty + b_.uncertainty
                                     : a_.uncertainty * std::abs(b) + b_.uncertainty * std::abs(a);
      const double distance = gap == 0.0 ? 0.0 : gap / (epsilon * size + blur);
      if (distance < pair.distance) {
        pair = {a, b, distance, gap == 0.0 ? 0.0 : gap / size};
      }
    }
  }
  return pair;
}

Error SylvesterOperator::not_solved(std::string_view where) const {
  const Pair pair = closest_pair();
  constexpr double near = 1e-6;
  const bool cancel = pair.gap <= near;
  const bool continuous = domain_ == Domain::continuous;
  return Error(cancel ? MatrixEquationError::no_unique_solution : MatrixEquationError::not_accurate)
      .in(std::string(where))
      .got(cancel ? (continuous ? "two eigenvalues with the sum zero"
                                : "two eigenvalues with the product one")
                  : "entries too far apart for sixteen digits")
      .with("eigenvalue", std::vector<double>{pair.a.real(), pair.a.imag()})
      .with("eigenvalue of the other side", std::vector<double>{pair.b.real(), pair.b.imag()});
}

Expected<void> SylvesterOperator::check(std::string_view where) const {
  if (!a_.converged || !b_.converged) {
    return refusal(MatrixEquationError::no_convergence, where, "eigenvalues");
  }
  constexpr double roundings = 4.0;
  if (!(closest_pair().distance > roundings)) {
    return tl::unexpected(not_solved(where));
  }
  return {};
}

MatrixXd SylvesterOperator::solve(const MatrixXd& F) const {
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
  const MatrixXcd left = complex_product(a_.U, Y);
  const MatrixXd X = complex_product(left, b_.U.adjoint()).real();
  return a_.d.asDiagonal() * X * b_.d.cwiseInverse().asDiagonal();
}

BackwardError SylvesterOperator::backward_error(const MatrixXd& X, const MatrixXd& F) const {
  const MatrixXd R = residual(X, F);
  const MatrixXd T = terms(X, F);
  return {largest_share(R, T, 0.0), largest_share(R, T, 1e-3)};
}

MatrixXcd SylvesterOperator::transform(const MatrixXd& F) const {
  const MatrixXd scaled = a_.d.cwiseInverse().asDiagonal() * F * b_.d.asDiagonal();
  const MatrixXcd left = complex_product(a_.U.adjoint(), scaled.cast<Complex>());
  return complex_product(left, b_.U);
}

std::optional<KroneckerSolution> solve_kronecker(const SylvesterOperator& equation,
                                                 const MatrixXd& F) {
  constexpr Index most_unknowns = 100;
  const Index n = F.rows();
  const Index m = F.cols();
  if (n * m > most_unknowns) {
    return std::nullopt;
  }
  const MatrixXd& A = equation.A();
  const MatrixXd& B = equation.B();
  const bool continuous = equation.domain() == Domain::continuous;
  // Each entry is a sum of two terms or of a product and one: exact in two doubles but for the
  // rounding of the second.
  auto M = DoubleDoubleMatrix::zero(n * m, n * m);
  for (Index j = 0; j < m; ++j) {
    for (Index l = 0; l < m; ++l) {
      for (Index i = 0; i < n; ++i) {
        for (Index k = 0; k < n; ++k) {
          double a = continuous ? (j == l ? A(i, k) : 0.0) : A(i, k) * B(l, j);
          const double low = continuous ? 0.0 : std::fma(A(i, k), B(l, j), -a);
          double b = continuous ? (i == k ? B(l, j) : 0.0) : (i == k && j == l ? -1.0 : 0.0);
          if (std::abs(a) < std::abs(b)) {
            std::swap(a, b);
          }
          const double sum = a + b;
          M.hi(i + j * n, k + l * n) = sum;
          M.lo(i + j * n, k + l * n) = (b - (sum - a)) + low;
        }
      }
    }
  }
  const Index size = n * m;
  MatrixXd rhs(size, size + 1);
  rhs << F.reshaped(), MatrixXd::Identity(size, size);
  const auto solved = detail::solve(std::move(M), DoubleDoubleMatrix(rhs));
  if (!solved || !solved->all_finite()) {
    return KroneckerSolution{};
  }
  const MatrixXd answer = solved->rounded();
  KroneckerSolution solution{answer.col(0).reshaped(n, m), 0.0};
  const MatrixXd growth =
      (answer.rightCols(size).cwiseAbs() * equation.terms(solution.X, F).reshaped()).reshaped(n, m);
  solution.condition = largest_share(growth, solution.X, 1e-3);
  return solution;
}

}  // namespace flyball::detail
