#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "systems/mode_distance.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

template <class Scalar>
using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <class Scalar>
using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

/// The n x n triangle R of M = [0 R] Qᴴ, row by row from below: a reflection I - τvvᴴ from the
/// right leaves of each row its last entry up to the diagonal.
/// @param from  The first entry of each row that is not zero.
template <class Scalar>
Matrix<Scalar> triangle_from_right(Matrix<Scalar> M, Eigen::VectorX<Index> from) {
  const Index n = M.rows();
  const Index more = M.cols() - n;
  Vector<Scalar> v;
  Vector<Scalar> products;
  for (Index i = n - 1; i >= 0; --i) {
    const Index last = more + i;
    const Index first = std::min(from(i), last);
    const Index count = last - first;
    from.head(i) = from.head(i).cwiseMin(first);
    if (count == 0) {
      continue;
    }
    // The row x becomes β eᵀ: x (I - τ v vᴴ) with v = (x - β e)ᴴ scaled to v_last = 1.
    v = Vector<Scalar>(M.row(i).segment(first, count + 1).adjoint());
    const double others = v.head(count).norm();
    if (others == 0.0) {
      continue;
    }
    const Scalar alpha = v(count);
    const double size = std::hypot(std::abs(alpha), others);
    const Scalar phase = alpha == Scalar(0.0) ? Scalar(1.0) : Scalar(alpha / std::abs(alpha));
    const Scalar head = alpha + phase * size;
    v.head(count) /= head;
    v(count) = Scalar(1.0);
    const double tau = 2.0 / v.squaredNorm();
    auto block = M.block(0, first, i + 1, count + 1);
    products = Vector<Scalar>(Vector<Scalar>::Zero(i + 1));
    for (Index j = 0; j <= count; ++j) {
      products += block.col(j) * v(j);
    }
    for (Index j = 0; j <= count; ++j) {
      block.col(j) -= products * (tau * Eigen::numext::conj(v(j)));
    }
  }
  return M.rightCols(n);
}

/// w = (R Rᴴ)⁻¹ u; a diagonal entry that is nothing beside `floor` counts as `floor`.
template <class Scalar>
Vector<Scalar> solve_twice(const Matrix<Scalar>& R, Vector<Scalar> u, double floor) {
  const Index n = R.rows();
  const auto pivot = [&](Index j) { return std::abs(R(j, j)) > floor ? R(j, j) : Scalar(floor); };
  for (Index j = n - 1; j >= 0; --j) {
    u(j) /= pivot(j);
    u.head(j) -= R.col(j).head(j) * u(j);
  }
  for (Index j = 0; j < n; ++j) {
    u(j) = (u(j) - R.col(j).head(j).dot(u.head(j))) / Eigen::numext::conj(pivot(j));
  }
  return u;
}

/// The largest eigenvalue of a symmetric tridiagonal matrix, by bisection of its negative pivots,
/// and its vector by inverse iteration. Cost: O(k), where a whole decomposition is O(k³).
struct LargestPair {
  double value = 0.0;
  Eigen::VectorXd vector;
};
LargestPair largest_pair(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& beside, Index k) {
  double high = diagonal(0);
  double low = diagonal.head(k).maxCoeff();  // no more than the eigenvalue
  for (Index i = 0; i < k; ++i) {
    const double before = i > 0 ? std::abs(beside(i - 1)) : 0.0;
    const double behind = i + 1 < k ? std::abs(beside(i)) : 0.0;
    high = std::max(high, diagonal(i) + before + behind);
  }
  // Whether μ - T has positive pivots alone, which are kept.
  Eigen::VectorXd pivots(k);
  const auto is_above = [&](double mu) {
    for (Index i = 0; i < k; ++i) {
      pivots(i) = mu - diagonal(i);
      if (i > 0) {
        pivots(i) -= beside(i - 1) * beside(i - 1) / pivots(i - 1);
      }
      if (!(pivots(i) > 0.0)) {
        return false;
      }
    }
    return true;
  };
  high += 2.0 * epsilon * std::abs(high);
  for (int halving = 0; halving < 60 && high - low > 2.0 * epsilon * std::abs(high); ++halving) {
    const double middle = 0.5 * low + 0.5 * high;
    (is_above(middle) ? high : low) = middle;
  }
  LargestPair found{high, Eigen::VectorXd::Ones(k)};
  // Rounding can take the last pivot; it needs them all.
  double step = 4.0 * epsilon * std::abs(high);
  for (int more = 0; more < 40 && !is_above(high); ++more, step *= 2.0) {
    high += step;
  }
  for (int pass = 0; pass < 3; ++pass) {
    Eigen::VectorXd& v = found.vector;
    for (Index i = 1; i < k; ++i) {
      v(i) += beside(i - 1) / pivots(i - 1) * v(i - 1);
    }
    v(k - 1) /= pivots(k - 1);
    for (Index i = k - 1; i-- > 0;) {
      v(i) = (v(i) + beside(i) * v(i + 1)) / pivots(i);
    }
    v.normalize();
  }
  return found;
}

/// The largest eigenvalue of (R Rᴴ)⁻¹ by Lanczos's iteration, all vectors kept orthogonal; ended by
/// the residual of its eigenvector.
template <class Scalar>
PencilMinimum smallest_of(const Matrix<Scalar>& R) {
  const Index n = R.rows();
  const double size = R.norm();
  PencilMinimum found{0.0, Eigen::VectorXcd::Unit(n, 0)};
  if (!(size > 0.0)) {
    return found;
  }
  const double floor = 1e-3 * epsilon * size;
  const Index most = std::min<Index>(n, 60);
  Matrix<Scalar> basis(n, most);
  Eigen::VectorXd diagonal(most);
  Eigen::VectorXd beside(most);
  // Any vector will do that is not orthogonal to the one sought.
  Vector<Scalar> q(n);
  for (Index k = 0; k < n; ++k) {
    q(k) = Scalar(1.0 + 0.5 * std::cos(2.4 * static_cast<double>(k + 1)));
  }
  q.normalize();
  for (Index k = 0; k < most; ++k) {
    basis.col(k) = q;
    Vector<Scalar> w = solve_twice<Scalar>(R, q, floor);
    diagonal(k) = std::real(q.dot(w));
    const auto known = basis.leftCols(k + 1);
    const double before = w.norm();
    for (int pass = 0; pass < 2; ++pass) {
      for (Index j = 0; j <= k; ++j) {
        w -= known.col(j) * known.col(j).dot(w);
      }
    }
    const double rest = w.norm();
    const bool last = k + 1 == most || !(rest > 10.0 * epsilon * before);
    if (k > 0 || last) {
      const LargestPair ritz = largest_pair(diagonal, beside, k + 1);
      const double largest = ritz.value;
      // The error of an eigenvalue is the square of its vector's.
      constexpr double accuracy = 1e-7;
      if (last || rest * std::abs(ritz.vector(k)) <= accuracy * largest) {
        Vector<Scalar> u = Vector<Scalar>::Zero(n);
        for (Index j = 0; j <= k; ++j) {
          u += known.col(j) * ritz.vector(j);
        }
        // Where the other singular values are far larger, what is left of their vectors in u would
        // count in ‖Rᴴu‖; one solve more removes it. Nothing is lost there to the pivots' floor.
        u = solve_twice<Scalar>(R, u, floor);
        u.normalize();
        Vector<Scalar> image(n);
        for (Index j = 0; j < n; ++j) {
          image(j) = R.col(j).head(j + 1).dot(u.head(j + 1));
        }
        found.value = image.norm();
        found.left = u.template cast<Complex>();
        return found;
      }
    }
    q = w / rest;
    beside(k) = rest;
  }
  return found;
}

}  // namespace

ModeDistance::ModeDistance(const MatrixRef& A, const MatrixRef& B)
    : pencil_(A.rows(), A.cols() + B.cols()),
      from_(A.rows()),
      inputs_(B.cols()),
      size_A_(A.norm()) {
  pencil_.leftCols(inputs_) = B;
  pencil_.rightCols(A.cols()) = A;
  for (Index i = 0; i < A.rows(); ++i) {
    Index first = 0;
    while (first < inputs_ + i && pencil_(i, first) == 0.0) {
      ++first;
    }
    from_(i) = first;
  }
}

template <class Scalar>
PencilMinimum ModeDistance::minimum(Scalar lambda) const {
  Matrix<Scalar> M = pencil_.template cast<Scalar>();
  M.rightCols(M.rows()).diagonal().array() -= lambda;
  return smallest_of<Scalar>(triangle_from_right<Scalar>(std::move(M), from_));
}

PencilMinimum ModeDistance::at(Complex lambda) const {
  return lambda.imag() == 0.0 ? minimum<double>(lambda.real()) : minimum<Complex>(lambda);
}

PencilMinimum ModeDistance::near(Complex lambda, double enough) const {
  PencilMinimum best = at(lambda);
  const double suspicious = std::max(1e-5 * size_A_, 1e3 * enough);
  for (int pass = 0; pass < 4; ++pass) {
    if (best.value <= enough || best.value > suspicious) {
      break;
    }
    const Eigen::VectorXcd& u = best.left;
    const Complex better = u.dot(pencil_.rightCols(pencil_.rows()).cast<Complex>().lazyProduct(u));
    PencilMinimum tried = at(lambda.imag() == 0.0 ? Complex(better.real(), 0.0) : better);
    if (!(tried.value < 0.5 * best.value)) {
      break;
    }
    best = std::move(tried);
  }
  return best;
}

}  // namespace flyball::detail
