#include <algorithm>

#include "control/placement.hpp"
#include "core/constants.hpp"

namespace flyball::detail {

ControllableStaircase controllable_staircase(const MatrixRef& A, const MatrixRef& B) {
  const Eigen::Index n = A.rows();
  // An input counts however weak it is made: only its direction is judged.
  ControllableStaircase form{Eigen::MatrixXd::Identity(n, n), A, B, 0, 0, {}};
  const double tolerance =
      20.0 * static_cast<double>(n) * epsilon * std::max(form.A.norm(), 1e-300);
  for (Eigen::Index j = 0; j < form.B.cols(); ++j) {
    const double size = form.B.col(j).norm();
    if (size > 0.0) {
      form.B.col(j) /= size;
    }
  }
  Eigen::MatrixXd entering = form.B;
  double threshold = 20.0 * static_cast<double>(n) * epsilon;
  Eigen::Index done = 0;
  while (done < n) {
    // What the states reached so far (or the inputs) drive among the rest.
    const SingularValues parts = svd_of(entering);
    Eigen::Index rank = 0;
    while (rank < parts.values.size() && parts.values(rank) > threshold) {
      ++rank;
    }
    if (rank == 0) {
      break;
    }
    const Eigen::Index rest = n - done;
    const Eigen::MatrixXd& U = parts.U;
    form.A.bottomRows(rest) = transposed_product(U, form.A.bottomRows(rest));
    form.A.rightCols(rest) = product(form.A.rightCols(rest), U);
    form.Q.rightCols(rest) = product(form.Q.rightCols(rest), U);
    if (done > 0) {
      const Eigen::Index before = entering.cols();
      form.A.block(done + rank, done - before, rest - rank, before).setZero();
    }
    form.first.insert(form.first.end(), static_cast<std::size_t>(rank),
                      done > 0 ? done - entering.cols() : 0);
    if (done == 0) {
      form.rank = rank;
    }
    done += rank;
    entering = Eigen::MatrixXd(form.A.block(done, done - rank, n - done, rank));
    threshold = tolerance;
  }
  form.controllable = done;
  form.first.insert(form.first.end(), static_cast<std::size_t>(n - done), done);
  form.B = transposed_product(form.Q, B);
  form.B.bottomRows(n - form.rank).setZero();
  if (done < n && done > 0) {
    form.A.bottomLeftCorner(n - done, done).setZero();
  }
  return form;
}

}  // namespace flyball::detail
