#include <cmath>
#include <complex>

#include "control/placement.hpp"

namespace flyball::detail {

template <class Scalar>
UnreachedRows<Scalar>::UnreachedRows(const PlacementProblem& problem, Scalar pole)
    : rank_(problem.rank), first_(problem.first) {
  const Eigen::Index n = problem.A.rows();
  const Eigen::Index rows = n - rank_;
  N_ = problem.A.bottomRows(rows).template cast<Scalar>();
  N_.rightCols(rows).diagonal().array() -= pole;
  reflections_ = Matrix::Zero(n, rows);
  // From the last row up, each onto its diagonal: what lies right of that is zero already.
  for (Eigen::Index i = rows - 1; i >= 0; --i) {
    const Eigen::Index first = first_[static_cast<std::size_t>(rank_ + i)];
    const Eigen::Index width = rank_ + i - first + 1;
    Vector v = N_.row(i).segment(first, width).adjoint();
    const double length = v.norm();
    if (length == 0.0) {
      continue;
    }
    const double size = std::abs(v(width - 1));
    v(width - 1) += size > 0.0 ? v(width - 1) / size * length : Scalar(length);
    v /= v.norm();
    const Vector along = N_.block(0, first, i + 1, width) * v;
    N_.block(0, first, i + 1, width).noalias() -= 2.0 * along * v.adjoint();
    reflections_.col(i).segment(first, width) = v;
  }
}

template <class Scalar>
auto UnreachedRows<Scalar>::turned(Matrix M) const -> Matrix {
  for (Eigen::Index i = 0; i < reflections_.cols(); ++i) {
    const Eigen::Index first = first_[static_cast<std::size_t>(rank_ + i)];
    const Eigen::Index width = rank_ + i - first + 1;
    const auto v = reflections_.col(i).segment(first, width);
    const Eigen::Matrix<Scalar, 1, Eigen::Dynamic> along = v.adjoint() * M.middleRows(first, width);
    M.middleRows(first, width).noalias() -= 2.0 * v * along;
  }
  return M;
}

template <class Scalar>
auto UnreachedRows<Scalar>::null_space() const -> Matrix {
  return turned(Matrix::Identity(reflections_.rows(), rank_));
}

template <class Scalar>
auto UnreachedRows<Scalar>::solve(const Vector& right) const -> Vector {
  const Eigen::Index rows = reflections_.cols();
  Vector x = Vector::Zero(reflections_.rows());
  x.tail(rows) = right;
  for (Eigen::Index i = rows - 1; i >= 0; --i) {
    const Scalar value = x(rank_ + i) / N_(i, rank_ + i);
    x(rank_ + i) = value;
    x.segment(rank_, i) -= value * N_.col(rank_ + i).head(i);
  }
  return turned(std::move(x));
}

template class UnreachedRows<double>;
template class UnreachedRows<std::complex<double>>;

}  // namespace flyball::detail
