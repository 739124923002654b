#include <cmath>
#include <limits>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

/// Householder reflections that take the columns of Mᴴ, one after the other, to a triangle: the
/// last columns of their product are orthogonal to all of them.
template <class Matrix>
Matrix null_space(const Matrix& M) {
  using Scalar = typename Matrix::Scalar;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Row = Eigen::Matrix<Scalar, 1, Eigen::Dynamic>;
  Matrix work = M.adjoint();
  const Eigen::Index size = work.rows();
  const Eigen::Index count = work.cols();
  Matrix reflections = Matrix::Zero(size, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    Vector v = work.col(k).tail(size - k);
    const double length = v.norm();
    if (length == 0.0) {
      continue;
    }
    const double first = std::abs(v(0));
    v(0) += first > 0.0 ? Scalar(v(0) / first * length) : Scalar(length);
    v /= v.norm();
    const Row along = v.adjoint() * work.bottomRightCorner(size - k, count - k);
    work.bottomRightCorner(size - k, count - k).noalias() -= 2.0 * v * along;
    reflections.col(k).tail(size - k) = v;
  }
  Matrix basis = Matrix::Zero(size, size - count);
  basis.bottomRows(size - count).setIdentity();
  for (Eigen::Index k = count - 1; k >= 0; --k) {
    const auto v = reflections.col(k).tail(size - k);
    const Row along = v.adjoint() * basis.bottomRows(size - k);
    basis.bottomRows(size - k).noalias() -= 2.0 * v * along;
  }
  return basis;
}

}  // namespace

Eigen::MatrixXcd null_space_of(const ComplexMatrixRef& M) {
  if (M.imag().isZero(0.0)) {
    return null_space<Eigen::MatrixXd>(M.real()).cast<std::complex<double>>();
  }
  return null_space<Eigen::MatrixXcd>(M);
}

Eigen::MatrixXcd leading_directions(const ComplexMatrixRef& M, Eigen::Index count) {
  const Eigen::Index r = M.cols();
  Eigen::MatrixXcd gram = complex_product(M.adjoint(), M);
  Eigen::MatrixXcd directions(r, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    // A Hermitian G = X + iY acts on [a; b] as the symmetric [X -Y; Y X].
    Eigen::MatrixXd embedded(2 * r, 2 * r);
    embedded << gram.real(), -gram.imag(), gram.imag(), gram.real();
    const SymmetricEigensystem system = symmetric_eigensystem_of(symmetrized(embedded));
    Eigen::VectorXcd v(r);
    v.real() = system.vectors.col(2 * r - 1).head(r);
    v.imag() = system.vectors.col(2 * r - 1).tail(r);
    for (Eigen::Index i = 0; i < k; ++i) {
      v -= directions.col(i) * directions.col(i).dot(v);
    }
    v.normalize();
    directions.col(k) = v;
    // Found directions go below every other, so that the next one is theirs no more.
    gram -= (system.values(2 * r - 1) + 1.0 + gram.norm()) * v * v.adjoint();
  }
  return directions;
}

double norm2(const ComplexMatrixRef& M) {
  // Entries of any size: the Gram matrix squares them.
  const double size = M.cwiseAbs().maxCoeff();
  if (!std::isfinite(size)) {
    return std::numeric_limits<double>::infinity();
  }
  if (size == 0.0) {
    return 0.0;
  }
  const Eigen::MatrixXcd scaled = M / size;
  return size * (scaled * leading_directions(scaled, 1).col(0)).norm();
}

}  // namespace flyball::detail
