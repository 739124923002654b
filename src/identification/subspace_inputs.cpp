#include <algorithm>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "core/try.hpp"
#include "identification/subspace_data.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Expected<VectorXd> regress_inputs(const ScaledSignals& record, const InnovationsModel& model,
                                  const MatrixXd& W, const SubspaceOptions& options) {
  const Index n = model.system.A.rows();
  const Index m = record.u.cols();
  const Index p = record.y.cols();
  const MatrixXd C_T = (W * model.system.C).transpose();
  const MatrixXd Phi = model.system.A - model.K * model.system.C;
  const Index start = options.initial_state ? n : 0;
  const Index direct = options.feedthrough ? p * m : 0;
  const Index size = start + n * m + direct;
  FLYBALL_TRY(auto stream, StreamedLeastSquares::create(size));
  // Columns: z of output r and input j at r m + j; then those of x0, Φᵀ^k Cᵀ; then K y's own x̂.
  const Index pairs = p * m;
  MatrixXd Z = MatrixXd::Zero(n, pairs + p + 1);
  Z.middleCols(pairs, p) = C_T;
  VectorXd row(size);
  VectorXd moved(n);
  // Loops over numbers: the products are too small for a matrix library.
  for (Index k = 0; k < record.y.rows(); ++k) {
    double* known = Z.col(pairs + p).data();
    for (Index r = 0; r < p; ++r) {
      double* to = row.data();
      const double* free = Z.col(pairs + r).data();
      for (Index i = 0; i < start; ++i) {
        *to++ = free[i];
      }
      for (Index j = 0; j < m; ++j) {
        const double* z = Z.col(r * m + j).data();
        for (Index i = 0; i < n; ++i) {
          *to++ = z[i];
        }
      }
      for (Index j = 0; direct > 0 && j < m; ++j) {
        const double* z = Z.col(r * m + j).data();
        for (Index i = 0; i < p; ++i) {
          double through = 0.0;
          for (Index l = 0; l < n; ++l) {
            through += model.K(l, i) * z[l];
          }
          *to++ = W(r, i) * record.u(k, j) - through;
        }
      }
      double target = 0.0;
      for (Index i = 0; i < p; ++i) {
        target += W(r, i) * record.y(k, i);
      }
      for (Index i = 0; i < n; ++i) {
        target -= C_T(i, r) * known[i];
      }
      stream.add(row.data(), target);
    }
    for (Index column = 0; column < pairs + p; ++column) {
      if (column >= pairs && start == 0) {
        break;
      }
      double* z = Z.col(column).data();
      const double in = column < pairs ? record.u(k, column % m) : 0.0;
      const double* c = C_T.col(column < pairs ? column / m : 0).data();
      for (Index i = 0; i < n; ++i) {
        double sum = in * c[i];
        for (Index l = 0; l < n; ++l) {
          sum += Phi(l, i) * z[l];
        }
        moved(i) = sum;
      }
      std::copy(moved.data(), moved.data() + n, z);
    }
    moved.setZero();
    for (Index l = 0; l < n; ++l) {
      for (Index i = 0; i < n; ++i) {
        moved(i) += Phi(i, l) * known[l];
      }
    }
    for (Index l = 0; l < p; ++l) {
      for (Index i = 0; i < n; ++i) {
        moved(i) += model.K(i, l) * record.y(k, l);
      }
    }
    std::copy(moved.data(), moved.data() + n, known);
  }
  const MatrixXd R = stream.factor();
  VectorXd unit = R.leftCols(size).colwise().norm();
  unit = unit.unaryExpr([](double norm) { return norm > 0.0 ? 1.0 / norm : 0.0; });
  const MatrixXd found =
      detail::solve_least_squares(R.leftCols(size) * unit.asDiagonal(), R.col(size + 1));
  if (!found.allFinite()) {
    return refusal(IdentificationError::singular, "fit_subspace")
        .hint("excite every input, or take a smaller order");
  }
  return VectorXd(unit.cwiseProduct(found.col(0)));
}

}  // namespace flyball::identification
