#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "core/constants.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/schur_kernel.hpp"
#include "math/dense/spectral_blocks.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Of square matrices only: what JacobiSVD prepares others by is made anew in place, and destroyed
/// twice where memory is too short for it.
using SquareSvd = Eigen::JacobiSVD<MatrixXd, Eigen::NoQRPreconditioner>;

/// R of a decomposition of a matrix that is not wide.
MatrixXd triangle(const MatrixXd& qr) {
  return qr.topRows(qr.cols()).triangularView<Eigen::Upper>();
}

/// The largest entry, by which squares neither overflow nor vanish.
double scale_of(const MatrixRef& A) {
  const double largest = A.size() > 0 ? A.cwiseAbs().maxCoeff() : 0.0;
  return largest > 0.0 ? largest : 1.0;
}

/// Each column of D V times a power of two that leaves its largest entry near one.
void give_units(Eigen::MatrixXcd& V, const Eigen::VectorXi& d) {
  for (Index j = 0; j < V.cols(); ++j) {
    int largest = std::numeric_limits<int>::min();
    for (Index i = 0; i < V.rows(); ++i) {
      const double size = std::abs(V(i, j));
      largest = size > 0.0 ? std::max(largest, std::ilogb(size) + d(i)) : largest;
    }
    for (Index i = 0; i < V.rows(); ++i) {
      if (V(i, j) != 0.0) {
        V(i, j) = {std::ldexp(V(i, j).real(), d(i) - largest),
                   std::ldexp(V(i, j).imag(), d(i) - largest)};
      }
    }
  }
}

}  // namespace

namespace {

/// The eigenvector of a quasi-triangular T to an eigenvalue λ, from row `top` up: what its last
/// entries, which are known, leave of (T - λI) y = 0.
/// @param y  Its columns are the real and the imaginary part. @param least  Of a pivot.
void substitute_up(const Eigen::Ref<const MatrixXd, 0, Eigen::OuterStride<>>& T,
                   std::complex<double> lambda, Index top, double least,
                   Eigen::Ref<Eigen::MatrixX2d> y) {
  using Complex = std::complex<double>;
  const auto take = [&](Index i, Complex value, Index rows) {
    y(i, 0) = value.real();
    y(i, 1) = value.imag();
    y.col(0).head(rows) -= value.real() * T.col(i).head(rows);
    y.col(1).head(rows) -= value.imag() * T.col(i).head(rows);
  };
  const auto at = [&](Index i) { return Complex(y(i, 0), y(i, 1)); };
  const auto pivot = [](Complex d, double size) { return std::abs(d) > size ? d : size; };
  for (Index i = top; i >= 0; --i) {
    if (i == 0 || T(i, i - 1) == 0.0) {
      take(i, at(i) / pivot(T(i, i) - lambda, least), i);
      continue;
    }
    const Complex p = T(i - 1, i - 1) - lambda;
    const Complex s = T(i, i) - lambda;
    const double q = T(i - 1, i);
    const double r = T(i, i - 1);
    const Complex det = pivot(p * s - q * r, least * (std::abs(q) + std::abs(r)));
    const Complex first = at(i - 1);
    const Complex second = at(i);
    take(i, (p * second - r * first) / det, i - 1);
    take(i - 1, (s * first - q * second) / det, i - 1);
    --i;
  }
}

/// Of a balanced matrix of ordinary size by the kernels of the house, which small ones do not pay
/// for; false where they do not converge, or vectors grow beyond what doubles tell apart.
bool eigensystem_quickly(const MatrixXd& M, Eigensystem& system) {
  constexpr Index small = 64;
  const Index n = M.rows();
  if (n < small || n > std::numeric_limits<int>::max() / 4) {
    return false;
  }
  MatrixXd H = MatrixXd::Zero(schur_rows(static_cast<int>(n)), n);
  H.topRows(n) = M;
  MatrixXd U(H.rows(), n);
  MatrixXd work(H.rows(), 3);
  if (!FLYBALL_RUN_KERNEL(schur_form, static_cast<int>(n), H.data(), U.data(), work.data())) {
    return false;
  }
  const auto T = H.topRows(n);
  system.values.resize(n);
  MatrixXd re = MatrixXd::Zero(n, n);
  MatrixXd im = MatrixXd::Zero(n, n);
  const double least = epsilon * std::max(M.cwiseAbs().maxCoeff(), 1e-300);
  Eigen::MatrixX2d y(n, 2);
  for (Index k = 0; k < n; ++k) {
    y.setZero();
    if (k + 1 == n || T(k + 1, k) == 0.0) {
      system.values(k) = T(k, k);
      y.col(0).head(k) = -T.col(k).head(k);
      y(k, 0) = 1.0;
      substitute_up(T, T(k, k), k - 1, least, y);
      re.col(k) = y.col(0) / y.cwiseAbs().maxCoeff();
      continue;
    }
    const double b = T(k, k + 1);
    const double c = T(k + 1, k);
    const std::complex<double> lambda(T(k, k), std::sqrt(std::abs(b)) * std::sqrt(std::abs(c)));
    // (b, jω) or (jω, c), the larger entry as one.
    const bool upper = std::abs(b) >= std::abs(c);
    y.col(upper ? 0 : 1).head(k) = (upper ? -1.0 : -lambda.imag() / c) * T.col(k).head(k);
    y.col(upper ? 1 : 0).head(k) = (upper ? -lambda.imag() / b : -1.0) * T.col(k + 1).head(k);
    y(k, upper ? 0 : 1) = upper ? 1.0 : lambda.imag() / c;
    y(k + 1, upper ? 1 : 0) = upper ? lambda.imag() / b : 1.0;
    substitute_up(T, lambda, k - 1, least, y);
    const double size = y.cwiseAbs().maxCoeff();
    re.col(k) = y.col(0) / size;
    im.col(k) = y.col(1) / size;
    system.values(k) = lambda;
    system.values(k + 1) = std::conj(lambda);
    ++k;
  }
  const MatrixXd basis = U.topRows(n);
  re = product(basis, re);
  im = product(basis, im);
  system.vectors.resize(n, n);
  system.vectors.real() = re;
  system.vectors.imag() = im;
  for (Index k = 0; k < n; ++k) {
    if (system.values(k).imag() > 0.0) {
      system.vectors.col(k + 1) = system.vectors.col(k).conjugate();
    }
  }
  return re.allFinite() && im.allFinite();
}

}  // namespace

Eigensystem eigensystem_of(const MatrixRef& A) {
  const BalancedMatrix balanced = balanced_of(A);
  const auto none = [&] {
    return Eigensystem{Eigen::VectorXcd::Constant(A.rows(), nan),
                       Eigen::MatrixXcd::Constant(A.rows(), A.cols(), nan)};
  };
  if (!balanced.M.allFinite()) {
    return none();
  }
  Eigensystem system;
  if (!eigensystem_quickly(balanced.M, system)) {
    const Eigen::EigenSolver<MatrixXd> solver(balanced.M);
    if (solver.info() != Eigen::Success) {
      return none();
    }
    system = {solver.eigenvalues(), solver.eigenvectors()};
  }
  system.values = times_power(system.values, balanced.unit);
  if (balanced.far) {
    give_units(system.vectors, balanced.d);
  } else {
    for (Index i = 0; i < A.rows(); ++i) {
      system.vectors.row(i) *= std::ldexp(1.0, balanced.d(i));
    }
  }
  system.vectors.colwise().normalize();
  return system;
}

namespace {

/// Of a balanced matrix of ordinary size by the kernels of the house, which small ones do not pay
/// for; false where they do not converge.
bool eigenvalues_quickly(const MatrixXd& M, Eigen::Ref<Eigen::VectorXcd> values) {
  constexpr Index small = 64;
  const Index n = M.rows();
  if (n < small || n > std::numeric_limits<int>::max() / 4) {
    return false;
  }
  MatrixXd H = MatrixXd::Zero(schur_rows(static_cast<int>(n)), n);
  H.topRows(n) = M;
  MatrixXd work(H.rows(), 3);
  return FLYBALL_RUN_KERNEL(schur_values, static_cast<int>(n), H.data(), work.data(),
                            values.data());
}

}  // namespace

Eigen::VectorXcd eigenvalues_of(const MatrixRef& A) {
  Eigen::VectorXcd values(A.rows());
  Eigen::Index done = 0;
  for (const MatrixXd& block : spectral_blocks(A)) {
    const Eigen::Index n = block.rows();
    if (n == 0) {
      continue;
    }
    const BalancedMatrix balanced = balanced_of(block);
    if (balanced.M.allFinite() && eigenvalues_quickly(balanced.M, values.segment(done, n))) {
      values.segment(done, n) = times_power(values.segment(done, n), balanced.unit);
      done += n;
      continue;
    }
    Eigen::EigenSolver<MatrixXd> solver(n);
    if (!balanced.M.allFinite() || solver.compute(balanced.M, false).info() != Eigen::Success) {
      return Eigen::VectorXcd::Constant(A.rows(), std::numeric_limits<double>::quiet_NaN());
    }
    values.segment(done, n) = times_power(solver.eigenvalues(), balanced.unit);
    done += n;
  }
  return values;
}

SymmetricEigensystem symmetric_eigensystem_of(const MatrixRef& S) {
  if (const int unit = unit_of(S); unit != 0) {
    SymmetricEigensystem system = symmetric_eigensystem_of(times_power(S, -unit));
    system.values = times_power(system.values, unit);
    return system;
  }
  if (!S.allFinite()) {
    const MatrixXd none = MatrixXd::Constant(S.rows(), S.cols(), std::nan(""));
    return {none.col(0), none};
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(S);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SingularValues svd_of(const MatrixRef& A) {
  const Index m = A.rows();
  const Index n = A.cols();
  if (m < n) {
    SingularValues turned = svd_of(A.transpose());
    return {std::move(turned.V), std::move(turned.values), std::move(turned.U)};
  }
  if (m == n) {
    const SquareSvd svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
  }
  // A P = Q R and R = U S Vᵀ.
  const double scale = scale_of(A);
  const Eigen::FullPivHouseholderQR<MatrixXd> qr(A / scale);
  const SquareSvd svd(triangle(qr.matrixQR()), Eigen::ComputeFullU | Eigen::ComputeFullV);
  MatrixXd U = qr.matrixQ();
  U.leftCols(n) *= svd.matrixU();
  return {std::move(U), svd.singularValues() * scale, qr.colsPermutation() * svd.matrixV()};
}

Eigen::VectorXd singular_values_of(const MatrixRef& A) {
  if (A.rows() < A.cols()) {
    return singular_values_of(A.transpose());
  }
  if (A.rows() == A.cols()) {
    return SquareSvd(A).singularValues();
  }
  const double scale = scale_of(A);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A / scale);
  return SquareSvd(triangle(qr.matrixQR())).singularValues() * scale;
}

Eigen::VectorXd singular_values_of_complex(const ComplexMatrixRef& A) {
  // [Re -Im; Im Re] has the same singular values, each twice.
  const Eigen::Index m = A.rows();
  const Eigen::Index n = A.cols();
  MatrixXd doubled(2 * m, 2 * n);
  doubled << A.real(), -A.imag(), A.imag(), A.real();
  const Eigen::VectorXd twice = singular_values_of(doubled);
  Eigen::VectorXd values(twice.size() / 2);
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    values(k) = twice(2 * k);
  }
  return values;
}

}  // namespace flyball::detail
