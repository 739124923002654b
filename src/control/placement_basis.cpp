#include <cmath>
#include <limits>

#include "control/placement.hpp"

namespace flyball::detail {

Eigen::MatrixXcd null_space_of(const ComplexMatrixRef& M) {
  // Householder reflections that take the columns of Mᴴ, one after the other, to a triangle: the
  // last columns of their product are orthogonal to all of them.
  using Complex = std::complex<double>;
  Eigen::MatrixXcd work = M.adjoint();
  const Eigen::Index size = work.rows();
  const Eigen::Index count = work.cols();
  Eigen::MatrixXcd reflections = Eigen::MatrixXcd::Zero(size, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::VectorXcd v = work.col(k).tail(size - k);
    const double length = v.norm();
    if (length == 0.0) {
      continue;
    }
    const double first = std::abs(v(0));
    const Complex phase = first > 0.0 ? v(0) / first : Complex(1.0);
    v(0) += phase * length;
    v /= v.norm();
    const Eigen::RowVectorXcd along = v.adjoint() * work.bottomRightCorner(size - k, count - k);
    work.bottomRightCorner(size - k, count - k).noalias() -= 2.0 * v * along;
    reflections.col(k).tail(size - k) = v;
  }
  Eigen::MatrixXcd basis = Eigen::MatrixXcd::Zero(size, size - count);
  basis.bottomRows(size - count).setIdentity();
  for (Eigen::Index k = count - 1; k >= 0; --k) {
    const Eigen::VectorXcd v = reflections.col(k);
    const Eigen::RowVectorXcd along = v.adjoint() * basis;
    basis.noalias() -= 2.0 * v * along;
  }
  return basis;
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
