#include <cmath>
#include <optional>
#include <utility>

#include "identification/subspace_states.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/panels.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd square_of(const MatrixXd& M) {
  MatrixXd square = MatrixXd::Zero(M.rows(), M.rows());
  detail::add_product_transposed(1.0, M, M, square);
  return square;
}

/// J, or nothing where the future is singular beside the inputs: data without noise.
std::optional<MatrixXd> future_factor(const Parts& parts) {
  if (parts.data.future.size() > 0) {
    MatrixXd J = parts.data.future;
    if (detail::cholesky_in_place(J)) {
      J.triangularView<Eigen::StrictlyUpper>().setZero();
      return J;
    }
  }
  MatrixXd both(parts.past() + parts.future(), parts.future());
  both << parts.L32().transpose(), parts.L33().transpose();
  MatrixXd J = detail::triangle_of(both).transpose();
  const VectorXd size = both.colwise().norm();
  if ((J.diagonal().cwiseAbs().array() > 1e-7 * size.array()).all()) {
    return J;
  }
  return std::nullopt;
}

/// C Cᵀ of the canonical correlations C = J⁻¹ L32: what J⁻¹ L33 leaves of I.
MatrixXd squared_correlations(const Parts& parts, const MatrixXd& J) {
  MatrixXd rest = parts.L33().transpose();
  detail::divide_by_transposed_triangle(rest, J);
  const MatrixXd turned = rest.transpose();
  MatrixXd square = MatrixXd::Identity(J.rows(), J.rows());
  detail::add_product_transposed(-1.0, turned, turned, square);
  return square;
}

VectorXd roots_of(const VectorXd& squares) {
  return squares.cwiseMax(0.0).cwiseSqrt();
}

/// The oblique projection, times an orthogonal matrix.
MatrixXd oblique(const Parts& parts) {
  MatrixXd past(parts.past(), parts.s * parts.m + parts.past());
  past << parts.L21(), parts.L22();
  // L32 L22⁺ [L21 L22]
  return detail::solve_least_squares(parts.L22().transpose(), parts.L32().transpose()).transpose() *
         past;
}

/// X of N X = AᵀB, beside noise where N = AᵀA has full rank; else what orthogonal factors make of
/// A.
template <class Otherwise>
MatrixXd solve_normal(bool noisy, MatrixXd N, const MatrixXd& right, Otherwise&& otherwise) {
  const VectorXd squares = N.diagonal();
  if (!noisy || !detail::cholesky_in_place(N) ||
      !(N.diagonal().array().square() > 1e-6 * squares.array()).all()) {
    return otherwise();
  }
  MatrixXd X = right.transpose();
  detail::divide_by_transposed_triangle(X, N);
  detail::divide_by_triangle(X, N);
  return X.transpose();
}

}  // namespace

Observed observe(const Parts& parts, SubspaceWeighting weighting, Index most) {
  Observed observed;
  std::optional<MatrixXd> J = future_factor(parts);
  observed.noisy = J.has_value();
  if (!J) {
    // Without the orthogonal factor of Mᵀ, which changes neither.
    const MatrixXd M =
        weighting == SubspaceWeighting::n4sid ? oblique(parts) : MatrixXd(parts.L32());
    detail::SingularValues svd = detail::svd_of(detail::triangle_of(M.transpose()).transpose());
    observed.U = std::move(svd.U);
    observed.values = std::move(svd.values);
    observed.correlations = observed.values;
    return observed;
  }
  observed.J = *std::move(J);
  // By squares, with half of the digits: those that noise leaves.
  detail::LeadingModes correlated = detail::leading_modes_of(
      squared_correlations(parts, observed.J), weighting == SubspaceWeighting::cva ? most : 0);
  observed.correlations = roots_of(correlated.values);
  observed.weighted = weighting == SubspaceWeighting::cva;
  if (observed.weighted) {
    observed.values = observed.correlations;
    observed.U = std::move(correlated.vectors);
    return observed;
  }
  MatrixXd square = square_of(parts.L32());
  if (weighting == SubspaceWeighting::n4sid) {
    MatrixXd through = parts.L32();
    detail::divide_by_triangle(through, parts.L22());
    MatrixXd inputs = MatrixXd::Zero(parts.future(), parts.s * parts.m);
    detail::add_product(1.0, through, parts.L21(), inputs);
    detail::add_product_transposed(1.0, inputs, inputs, square);
  }
  detail::LeadingModes modes = detail::leading_modes_of(std::move(square), most);
  observed.values = roots_of(modes.values);
  observed.U = std::move(modes.vectors);
  return observed;
}

StateSequence states_of(const Parts& parts, const Observed& observed, SubspaceWeighting weighting,
                        Index n) {
  const Index p = parts.p;
  const Index rest = (parts.s - 1) * p;
  const Index past = parts.past();
  // Γ = J U √S and X = √S⁻¹ Uᵀ J⁻¹ L32; one sample later Γ without its last block row.
  const VectorXd root = observed.values.head(n).cwiseSqrt().cwiseMax(1e-150);
  const VectorXd inverse = root.cwiseInverse();
  const MatrixXd U = observed.U.leftCols(n);
  StateSequence found;
  MatrixXd read = U.transpose();
  if (observed.weighted) {
    detail::divide_by_triangle(read, observed.J);
  }
  found.X = MatrixXd::Zero(n, past);
  detail::add_product(1.0, read, parts.L32(), found.X);
  found.X = inverse.asDiagonal() * found.X;

  // J is lower triangular: its first rows are those of the shorter Γ's.
  const MatrixXd top = U.topRows(rest);
  MatrixXd read_later = solve_normal(
      observed.noisy, detail::transposed_product(top, top), top.transpose(),
      [&] { return detail::solve_least_squares(top, MatrixXd::Identity(rest, rest)); });
  if (observed.weighted) {
    detail::divide_by_triangle(read_later, observed.J.topLeftCorner(rest, rest));
  }
  found.target = MatrixXd::Zero(n + p, past + p);
  detail::add_product(
      1.0, read_later,
      parts.data.L.block(parts.s * parts.m + past + p, parts.s * parts.m, rest, past + p),
      found.target.topRows(n));
  found.target.topRows(n) = inverse.asDiagonal() * found.target.topRows(n);
  found.target.bottomRows(p) << parts.L32().topRows(p), parts.L33().topLeftCorner(p, p);

  if (weighting == SubspaceWeighting::moesp) {
    found.A = inverse.asDiagonal() * (read_later * U.bottomRows(rest)) * root.asDiagonal();
    found.C = U.topRows(p) * root.asDiagonal();
    return found;
  }
  MatrixXd right = MatrixXd::Zero(n, n + p);
  detail::add_product_transposed(1.0, found.X, found.target.leftCols(past), right);
  const MatrixXd both = solve_normal(observed.noisy, square_of(found.X), right, [&] {
                          return detail::solve_least_squares(
                              found.X.transpose(), found.target.leftCols(past).transpose());
                        }).transpose();
  found.A = both.topRows(n);
  found.C = both.bottomRows(p);
  return found;
}

}  // namespace flyball::identification
