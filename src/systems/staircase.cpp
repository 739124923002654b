#include <algorithm>

#include "math/dense.hpp"
#include "systems/staircase.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;

Staircase staircase_of(const MatrixRef& A, const MatrixRef& B, double tolerance) {
  const Index n = A.rows();
  Staircase s;
  s.A = A;
  s.B = B;
  s.Q = MatrixXd::Identity(n, n);
  const double size_A = A.norm();
  MatrixXd block = B;
  double unit = B.norm();
  while (s.rank < n && block.cols() > 0) {
    if (!(unit > 0.0)) {
      break;
    }
    const SingularValues svd = svd_of(block);
    Index step = 0;
    while (step < svd.values.size() && svd.values(step) > tolerance * unit) {
      s.smallest_step = std::min(s.smallest_step, svd.values(step) / unit);
      ++step;
    }
    if (step < svd.values.size()) {
      s.largest_rest = std::max(s.largest_rest, svd.values(step) / unit);
    }
    if (step == 0) {
      break;
    }
    const Index rest = n - s.rank;
    const Index done = s.rank;
    s.A.bottomRows(rest) = transposed_product(svd.U, s.A.bottomRows(rest));
    s.A.rightCols(rest) = product(s.A.rightCols(rest), svd.U);
    s.Q.rightCols(rest) = product(s.Q.rightCols(rest), svd.U);
    if (done == 0) {
      s.B = transposed_product(svd.U, s.B);
      s.B.bottomRows(n - step).setZero();
    } else {
      // Below the new stair the previous one's columns vanish.
      const Index before = s.stairs.back();
      s.A.block(done + step, done - before, n - done - step, before).setZero();
    }
    s.stairs.push_back(step);
    s.rank += step;
    block = s.A.block(s.rank, s.rank - step, n - s.rank, step);
    unit = size_A;
  }
  if (s.rank < n && s.rank > 0) {
    s.A.bottomLeftCorner(n - s.rank, s.rank).setZero();
  }
  return s;
}

}  // namespace flyball::detail
