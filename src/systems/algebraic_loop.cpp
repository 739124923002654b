#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <flyball/systems/system_error.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/extended/wide_matrix.hpp"
#include "systems/algebraic_loop.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXi;

namespace {

/// Powers of two d for which the largest entries beside the diagonal of each row of D⁻¹TD and of
/// its column are alike (Osborne's balancing): units of the signals that are the loop's own.
VectorXi units_of(const WideMatrix& T) {
  constexpr int most_sweeps = 100;
  constexpr int furthest = 100'000;
  const Index m = T.rows();
  VectorXi d = VectorXi::Zero(m);
  bool changed = true;
  for (int sweep = 0; changed && sweep < most_sweeps; ++sweep) {
    changed = false;
    for (Index i = 0; i < m; ++i) {
      std::optional<long> row;
      std::optional<long> column;
      for (Index j = 0; j < m; ++j) {
        if (j != i && T(i, j).hi != 0.0) {
          row = std::max(row.value_or(-furthest), T(i, j).exponent + d(j) - d(i));
        }
        if (j != i && T(j, i).hi != 0.0) {
          column = std::max(column.value_or(-furthest), T(j, i).exponent + d(i) - d(j));
        }
      }
      // One that leads on and not around may have any units: those in which it is of size one.
      const long power = row && column ? (*row - *column) / 2
                         : row         ? std::max(*row, 0L)
                         : column      ? std::min(-*column, 0L)
                                       : 0;
      if (power != 0 && std::abs(d(i) + power) < furthest) {
        d(i) += static_cast<int>(power);
        changed = true;
      }
    }
  }
  return d;
}

tl::unexpected<Error> singular(const AlgebraicLoop& loop, std::string_view where, double distance) {
  return refusal(SystemError::algebraic_loop, where, loop.subject)
      .got("singular")
      .expected("invertible")
      .hint(std::string(loop.hint))
      .with("distance from singular", distance);
}

/// 1/ρ of a matrix that is not negative.
double reciprocal_radius(const WideMatrix& M) {
  const WideMatrix units = balanced(M);
  const long exponent = units.exponent();
  const MatrixXd scaled = units.rounded(-exponent);
  if (!scaled.allFinite()) {
    return 0.0;
  }
  double radius = eigenvalues_of(scaled).cwiseAbs().maxCoeff();
  if (!std::isfinite(radius)) {
    radius = norm1(scaled);  // at least
  }
  constexpr long far = 2000;
  return std::ldexp(1.0 / radius, static_cast<int>(std::clamp(-exponent, -far, far)));
}

}  // namespace

Expected<MatrixXd> solve_algebraic_loop(const AlgebraicLoop& loop, const MatrixXd& R,
                                        std::string_view where) {
  const bool two = loop.G.size() > 0;
  if (loop.F.size() == 0 || loop.F.isZero(0.0) || (two && loop.G.isZero(0.0))) {
    return R;
  }
  const WideMatrix F(loop.F);
  const WideMatrix gain = two ? product(F, WideMatrix(loop.G)) : F;
  const WideMatrix size =
      two ? product(F.magnitudes(), WideMatrix(loop.G).magnitudes()) : F.magnitudes();
  const WideMatrix one = WideMatrix::identity(gain.rows());
  const WideMatrix terms = sum(one, 1.0, size);
  const VectorXi d = units_of(terms);
  const WideMatrix L = sum(one, loop.sign, gain).times_powers(-d, d, 0);
  const WideMatrix right = beside(WideMatrix(R).times_powers(-d, VectorXi::Zero(R.cols()), 0), one);
  const std::optional<WideMatrix> solved = solve(L, right);
  if (!solved || !solved->all_finite()) {
    return singular(loop, where, 0.0);
  }
  const double distance = reciprocal_radius(
      product(solved->right(gain.rows()).magnitudes(), terms.times_powers(-d, d, 0)));
  constexpr double roundings = 10.0 * std::numeric_limits<double>::epsilon();
  MatrixXd X = solved->left(R.cols()).times_powers(d, VectorXi::Zero(R.cols()), 0).rounded();
  if (!(distance > roundings) || !X.allFinite()) {
    return singular(loop, where, distance);
  }
  return X;
}

}  // namespace flyball::detail
