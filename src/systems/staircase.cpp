#include <algorithm>
#include <cmath>
#include <utility>

#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "systems/mode_distance.hpp"
#include "systems/staircase.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// An orthogonal U with Uᵀ block zero but for its first `rank` rows: reflections I - τvvᵀ, and then
/// a matrix that turns the first rows among themselves.
struct Turned {
  Eigen::VectorXd values;   ///< The singular values of the block.
  Index rank = 0;           ///< How many are above the threshold.
  bool triangular = false;  ///< Whether Uᵀ block is upper triangular besides.
  MatrixXd v;
  Eigen::VectorXd tau;
  MatrixXd turn;  ///< Empty: the identity.

  /// Uᵀ M.
  void from_left(Eigen::Ref<MatrixXd> M) const {
    for (Index k = 0; k < v.cols(); ++k) {
      const auto w = v.col(k).tail(v.rows() - k);
      auto rows = M.bottomRows(v.rows() - k);
      const Eigen::RowVectorXd products = tau(k) * (w.transpose() * rows);
      rows.noalias() -= w * products;
    }
    if (turn.size() > 0) {
      M.topRows(turn.rows()) = transposed_product(turn, M.topRows(turn.rows()));
    }
  }
  /// M U.
  void from_right(Eigen::Ref<MatrixXd> M) const {
    for (Index k = 0; k < v.cols(); ++k) {
      const auto w = v.col(k).tail(v.rows() - k);
      auto columns = M.rightCols(v.rows() - k);
      const Eigen::VectorXd products = tau(k) * (columns * w);
      columns.noalias() -= products * w.transpose();
    }
    if (turn.size() > 0) {
      M.leftCols(turn.rows()) = product(M.leftCols(turn.rows()), turn);
    }
  }
};

Turned turned_of(const MatrixXd& block, double threshold) {
  const Index rows = block.rows();
  const Index count = std::min(rows, block.cols());
  Turned t;
  t.v = MatrixXd::Zero(rows, block.cols() < rows ? count : 0);
  t.tau = Eigen::VectorXd::Zero(t.v.cols());
  MatrixXd R = block;
  for (Index k = 0; k < t.v.cols(); ++k) {
    auto x = R.col(k).tail(rows - k);
    const double size = x.norm();
    if (size == 0.0) {
      continue;
    }
    const double head = x(0) + std::copysign(size, x(0));
    auto w = t.v.col(k).tail(rows - k);
    w = x / head;
    w(0) = 1.0;
    t.tau(k) = 2.0 / w.squaredNorm();
    auto right = R.bottomRightCorner(rows - k, R.cols() - k);
    const Eigen::RowVectorXd products = t.tau(k) * (w.transpose() * right);
    right.noalias() -= w * products;
  }
  R = MatrixXd(R.topRows(count));
  if (t.v.cols() > 0) {
    R.triangularView<Eigen::StrictlyLower>().setZero();
  }
  t.values = coarse_singular_values_of(R);
  t.rank = (t.values.array() > threshold).count();
  t.triangular = t.rank == count && t.v.cols() > 0;
  if (t.rank > 0 && t.rank < count) {
    t.turn = svd_of(R).U;
  }
  return t;
}

}  // namespace

Staircase staircase_of(const MatrixRef& A, const MatrixRef& B, double tolerance) {
  return staircase_of(A, B, tolerance, {A.norm(), B.norm()});
}

Staircase staircase_of(const MatrixRef& A, const MatrixRef& B, double tolerance, PairSizes sizes) {
  const Index n = A.rows();
  Staircase s;
  s.A = A;
  s.B = B;
  s.Q = MatrixXd::Identity(n, n);
  MatrixXd block = B;
  double unit = sizes.B;
  while (s.rank < n && block.cols() > 0) {
    if (!(unit > 0.0)) {
      break;
    }
    const Index rest = n - s.rank;
    const Index done = s.rank;
    const Turned turned = turned_of(block, tolerance * unit);
    const Index step = turned.rank;
    for (Index k = 0; k < turned.values.size(); ++k) {
      const double relative = turned.values(k) / unit;
      if (k < step) {
        s.smallest_step = std::min(s.smallest_step, relative);
      } else {
        s.largest_rest = std::max(s.largest_rest, relative);
      }
    }
    if (step == 0) {
      break;
    }
    turned.from_left(s.A.bottomRows(rest));
    turned.from_right(s.A.rightCols(rest));
    turned.from_right(s.Q.rightCols(rest));
    if (done == 0) {
      turned.from_left(s.B);
      s.B.bottomRows(n - step).setZero();
      if (turned.triangular) {
        s.B.triangularView<Eigen::StrictlyLower>().setZero();
      }
    } else {
      // Below the new stair the previous one's columns vanish.
      const Index before = s.stairs.back();
      s.A.block(done + step, done - before, n - done - step, before).setZero();
      if (turned.triangular) {
        s.A.block(done, done - before, step, before)
            .triangularView<Eigen::StrictlyLower>()
            .setZero();
      }
    }
    s.stairs.push_back(step);
    s.rank += step;
    block = MatrixXd(s.A.block(s.rank, s.rank - step, n - s.rank, step));
    unit = sizes.A;
  }
  if (s.rank < n && s.rank > 0) {
    s.A.bottomLeftCorner(n - s.rank, s.rank).setZero();
  }
  return s;
}

namespace {

/// The mode of the smallest distance, as columns that span its left vectors; none if each is above
/// the threshold.
MatrixXd cut_off_mode(const MatrixXd& A, const MatrixXd& B, double threshold) {
  MatrixXd directions(A.rows(), 0);
  const Eigen::VectorXcd modes = eigenvalues_of(A);
  if (!modes.allFinite()) {
    return directions;
  }
  const ModeDistance distances(A, B);
  double least = threshold;
  for (const std::complex<double>& lambda : modes) {
    if (lambda.imag() < 0.0) {
      continue;
    }
    PencilMinimum found = distances.near(lambda, threshold);
    MatrixXd left = found.left.real();
    if (lambda.imag() > 0.0) {
      // A real change cuts off the plane of a complex vector: the flatter that is, the larger.
      left.conservativeResize(Eigen::NoChange, 2);
      left.col(1) = found.left.imag();
      const double flatness = std::sqrt(2.0) * svd_of(left).values(1);
      if (found.value > threshold * flatness) {
        found = distances.near(lambda.real(), threshold);
        left = MatrixXd(found.left.real());
      } else {
        found.value /= flatness;
      }
    }
    if (found.value <= least) {
      least = found.value;
      directions = std::move(left);
    }
  }
  return directions;
}

}  // namespace

ReachedPart reached_part_of(const MatrixRef& A, const MatrixRef& B, double tolerance,
                            PairSizes sizes) {
  const double unit = sizes.A > 0.0 && sizes.B > 0.0 ? sizes.A / sizes.B : 1.0;
  const double threshold = tolerance * std::hypot(sizes.A, unit * sizes.B);
  ReachedPart part{A, B, MatrixXd::Identity(A.rows(), A.rows())};
  for (;;) {
    const Staircase stairs = staircase_of(part.A, part.B, tolerance, sizes);
    const Index r = stairs.rank;
    part.V = product(part.V, stairs.Q.leftCols(r));
    part.A = MatrixXd(stairs.A.topLeftCorner(r, r));
    part.B = MatrixXd(stairs.B.topRows(r));
    if (r == 0) {
      return part;
    }
    const MatrixXd left = cut_off_mode(part.A, unit * part.B, threshold);
    if (left.cols() == 0) {
      return part;
    }
    // wᵀA = λwᵀ, wᵀB = 0: what is orthogonal to w stays so.
    const MatrixXd rest = full_qr(left).Q.rightCols(r - left.cols());
    part.A = transposed_product(rest, product(part.A, rest));
    part.B = transposed_product(rest, part.B);
    part.V = product(part.V, rest);
  }
}

}  // namespace flyball::detail
