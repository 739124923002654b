#include <algorithm>
#include <cmath>

#include "math/dense/dense.hpp"
#include "math/verified/contraction.hpp"
#include "math/verified/definite.hpp"

namespace flyball::detail {

namespace {

/// T⁻¹ by substitution, T triangular or not.
Eigen::MatrixXd near_inverse(const Eigen::MatrixXd& T) {
  return solve_linear(T, Eigen::MatrixXd::Identity(T.rows(), T.cols()));
}

/// |centre| + Σ |slopes| + Σ |squares|, rounded up.
Eigen::MatrixXd magnitude_of(const MatrixFamily& family) {
  Eigen::MatrixXd sum = family.centre.cwiseAbs();
  for (const Eigen::MatrixXd& slope : family.slopes) {
    sum += slope.cwiseAbs();
  }
  for (const Eigen::MatrixXd& square : family.squares) {
    sum += square.cwiseAbs();
  }
  return sum * inflation;
}

/// The radius with what the sums of `vertex` and products with two further matrices round.
Eigen::MatrixXd radius_with_rounding(const MatrixFamily& family) {
  const double each = 2.0 * product_rounding(family.centre.rows()) +
                      2.0 * unit_roundoff * static_cast<double>(family.slopes.size() + 1);
  return (family.radius + each * magnitude_of(family)).array() * inflation + underflow;
}

}  // namespace

bool contracts(const MatrixFamily& family, const Eigen::MatrixXd& T) {
  const Eigen::Index n = T.rows();
  const Eigen::MatrixXd Z = near_inverse(T);
  if (!Z.allFinite()) {
    return false;
  }
  const Eigen::MatrixXd T_size = T.cwiseAbs();
  const Eigen::MatrixXd Z_size = Z.cwiseAbs();
  const Eigen::MatrixXd TZ_I = (T.lazyProduct(Z) - Eigen::MatrixXd::Identity(n, n)).cwiseAbs();
  const Eigen::MatrixXd TZ_size = T_size.lazyProduct(Z_size);
  const double delta = norm_above(TZ_I + product_rounding(n) * TZ_size) * inflation;
  const Eigen::MatrixXd radius = radius_with_rounding(family);
  const Eigen::MatrixXd left = T_size.lazyProduct(radius);
  double rest = norm_above(left.lazyProduct(Z_size)) * inflation;
  for (const Eigen::MatrixXd& square : family.squares) {
    // Its products' rounding is in the radius.
    const Eigen::MatrixXd TQ = T.lazyProduct(square);
    rest += TQ.lazyProduct(Z).norm() * inflation;
  }
  rest *= inflation;
  const double room = 1.0 - (delta + rest) * inflation - 4.0 * unit_roundoff;
  if (!(room > 0.0)) {
    return false;
  }
  const double bound = room * room * (1.0 - 4.0 * unit_roundoff);
  for (unsigned v = 0; v < family.vertices(); ++v) {
    const Eigen::MatrixXd TM = T.lazyProduct(family.vertex(v));
    const Eigen::MatrixXd W = TM.lazyProduct(Z);
    Eigen::MatrixXd S = -W.transpose().lazyProduct(W);
    const double size = -S.trace();
    S.diagonal().array() += bound;
    if (!surely_positive(std::move(S), product_rounding(n) * (size + 1.0))) {
      return false;
    }
  }
  return true;
}

bool surely_unstable(const MatrixFamily& family) {
  const Eigen::Index n = family.centre.rows();
  // P - MᵀPM = I in balanced coordinates, M = D N D⁻¹; a solution by Kronecker products.
  const Eigen::VectorXd d = balance_of(family.centre);
  const Eigen::MatrixXd N = d.cwiseInverse().asDiagonal() * family.centre * d.asDiagonal();
  Eigen::MatrixXd kron(n * n, n * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      kron.block(i * n, j * n, n, n) = -N(j, i) * N.transpose();
    }
  }
  kron.diagonal().array() += 1.0;
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd solved = solve_linear(kron, I.reshaped(n * n, 1));
  if (!solved.allFinite()) {
    return false;
  }
  const Eigen::MatrixXd P = symmetrized(Eigen::MatrixXd(solved.reshaped(n, n)));
  // xᵀPx < 0 for the computed eigenvector of the least eigenvalue.
  const SymmetricEigensystem eigen = symmetric_eigensystem_of(P);
  const Eigen::VectorXd x = eigen.vectors.col(0);
  const double form = x.dot(P.lazyProduct(x));
  const double form_error =
      product_rounding(2 * n) * x.cwiseAbs().dot(P.cwiseAbs().lazyProduct(x.cwiseAbs()));
  if (!(form + form_error * inflation < 0.0)) {
    return false;
  }
  // S = P - NᵀPN over the family, N within `R` of its computed centre. The scales d are powers of
  // two, so that balancing is exact.
  Eigen::MatrixXd R = family.radius;
  for (const Eigen::MatrixXd& slope : family.slopes) {
    R += slope.cwiseAbs();
  }
  for (const Eigen::MatrixXd& square : family.squares) {
    R += square.cwiseAbs();
  }
  R = (d.cwiseInverse().asDiagonal() * R * d.asDiagonal() * inflation);
  R.array() += underflow;
  const Eigen::MatrixXd size = N.cwiseAbs();
  const Eigen::MatrixXd P_size = P.cwiseAbs();
  const Eigen::MatrixXd reach = (size + R) * inflation;
  const Eigen::MatrixXd PR = P_size.lazyProduct(R);
  const Eigen::MatrixXd P_reach = P_size.lazyProduct(reach);
  const Eigen::MatrixXd error =
      2.0 * reach.transpose().lazyProduct(PR) +
      2.0 * product_rounding(2 * n) * (P_size + reach.transpose().lazyProduct(P_reach));
  const Eigen::MatrixXd PN = P.lazyProduct(N);
  const Eigen::MatrixXd S = symmetrized(P - N.transpose().lazyProduct(PN));
  return surely_positive(S, norm_above(error) * inflation);
}

}  // namespace flyball::detail
