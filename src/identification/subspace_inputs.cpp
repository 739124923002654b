#include <algorithm>
#include <cmath>
#include <optional>

#include <flyball/identification/identification_error.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "core/try.hpp"
#include "identification/subspace_data.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// to = M from + to, in columns: what the compiler adds several numbers of at once.
void add_product(const MatrixXd& M, const double* from, double* to) {
  const Index rows = M.rows();
  for (Index l = 0; l < M.cols(); ++l) {
    const double* column = M.col(l).data();
    for (Index i = 0; i < rows; ++i) {
      to[i] += column[i] * from[l];
    }
  }
}

/// The regression's rows one after the other: take(row, target).
template <class Take>
void each_row(const ScaledSignals& record, const InnovationsModel& model, const MatrixXd& W,
              const SubspaceOptions& options, Index size, Take&& take) {
  const Index n = model.system.A.rows();
  const Index m = record.u.cols();
  const Index p = record.y.cols();
  const Index start = options.initial_state ? n : 0;
  const MatrixXd C_T = (W * model.system.C).transpose();
  const MatrixXd Phi = model.system.A - model.K * model.system.C;
  const MatrixXd Phi_T = Phi.transpose();
  const MatrixXd K_T = model.K.transpose();
  // A sample a column: its numbers lie side by side.
  const MatrixXd u = record.u.transpose();
  const MatrixXd y = record.y.transpose();
  // Columns: z of output r and input j at r m + j; then those of x0, Φᵀ^k Cᵀ; then K y's own x̂.
  const Index pairs = p * m;
  MatrixXd Z = MatrixXd::Zero(n, pairs + p + 1);
  Z.middleCols(pairs, p) = C_T;
  VectorXd row(size);
  VectorXd moved(n);
  // Loops over numbers: the products are too small for a matrix library.
  for (Index k = 0; k < y.cols(); ++k) {
    const double* in = u.col(k).data();
    const double* out = y.col(k).data();
    double* known = Z.col(pairs + p).data();
    for (Index r = 0; r < p; ++r) {
      double* to = row.data();
      to = std::copy_n(Z.col(pairs + r).data(), start, to);
      to = std::copy_n(Z.col(r * m).data(), m * n, to);
      for (Index j = 0; options.feedthrough && j < m; ++j, to += p) {
        for (Index i = 0; i < p; ++i) {
          to[i] = W(r, i) * in[j];
        }
        const double* z = Z.col(r * m + j).data();
        for (Index l = 0; l < n; ++l) {
          for (Index i = 0; i < p; ++i) {
            to[i] -= K_T(i, l) * z[l];
          }
        }
      }
      double target = 0.0;
      for (Index i = 0; i < p; ++i) {
        target += W(r, i) * out[i];
      }
      for (Index i = 0; i < n; ++i) {
        target -= C_T(i, r) * known[i];
      }
      take(row.data(), target);
    }
    for (Index column = 0; column < pairs + (start > 0 ? p : 0); ++column) {
      double* z = Z.col(column).data();
      if (column < pairs) {
        const double* c = C_T.col(column / m).data();
        for (Index i = 0; i < n; ++i) {
          moved(i) = in[column % m] * c[i];
        }
      } else {
        moved.setZero();
      }
      add_product(Phi_T, z, moved.data());
      std::copy_n(moved.data(), n, z);
    }
    moved.setZero();
    add_product(Phi, known, moved.data());
    add_product(model.K, out, moved.data());
    std::copy_n(moved.data(), n, known);
  }
}

/// Least squares by the sums of the rows' products, a block of rows at a time.
class NormalEquations {
 public:
  explicit NormalEquations(Index size)
      : block_(size + 1, 256), sums_(MatrixXd::Zero(size + 1, size + 1)) {}

  void add(const double* row, double target) {
    double* to = std::copy_n(row, block_.rows() - 1, block_.col(used_).data());
    *to = target;
    if (++used_ == block_.cols()) {
      fold();
    }
  }

  /// Nothing where squaring the rows has lost more than half of the digits.
  [[nodiscard]] std::optional<VectorXd> solve() {
    fold();
    const Index size = sums_.rows() - 1;
    const VectorXd unit = sums_.diagonal().head(size).unaryExpr(
        [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
    const MatrixXd equations =
        unit.asDiagonal() * sums_.topLeftCorner(size, size) * unit.asDiagonal();
    const std::optional<MatrixXd> L = detail::cholesky_of(equations);
    constexpr double least = 1e-8;
    if (!L || !(L->diagonal().array().square() > least).all()) {
      return std::nullopt;
    }
    const MatrixXd right = unit.cwiseProduct(sums_.col(size).head(size));
    return VectorXd(unit.cwiseProduct(detail::solve_symmetric(equations, right).col(0)));
  }

 private:
  void fold() {
    sums_ += detail::product_transposed(block_.leftCols(used_), block_.leftCols(used_));
    used_ = 0;
  }

  MatrixXd block_;  ///< A row a column, the target last.
  MatrixXd sums_;
  Index used_ = 0;
};

}  // namespace

Expected<VectorXd> regress_inputs(const ScaledSignals& record, const InnovationsModel& model,
                                  const MatrixXd& W, const SubspaceOptions& options, bool noisy) {
  const Index n = model.system.A.rows();
  const Index m = record.u.cols();
  const Index p = record.y.cols();
  const Index size = (options.initial_state ? n : 0) + n * m + (options.feedthrough ? p * m : 0);
  if (noisy) {
    NormalEquations normal(size);
    each_row(record, model, W, options, size,
             [&](const double* row, double target) { normal.add(row, target); });
    if (auto found = normal.solve(); found && found->allFinite()) {
      return *std::move(found);
    }
  }
  FLYBALL_TRY(auto stream, StreamedLeastSquares::create(size));
  each_row(record, model, W, options, size,
           [&](const double* row, double target) { stream.add(row, target); });
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
