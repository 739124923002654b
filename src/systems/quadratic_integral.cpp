#include <cmath>
#include <limits>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

Expected<MatrixXd> quadratic_integral(const MatrixRef& F, const MatrixRef& W, double T) {
  const Eigen::VectorXd d = balance_of(F);
  const Eigen::VectorXd inverse = d.cwiseInverse();
  const MatrixXd G = inverse.asDiagonal() * F * d.asDiagonal();
  const double norm = norm1(G) * T;
  if (!std::isfinite(norm)) {
    return MatrixXd(
        MatrixXd::Constant(F.rows(), F.cols(), std::numeric_limits<double>::infinity()));
  }
  const int doublings = norm > 0.5 ? static_cast<int>(std::ceil(std::log2(norm / 0.5))) : 0;
  const double h = std::ldexp(T, -doublings);

  // Σ_j h^{j+1}/(j+1)! L^j(W) with L(X) = G X + X Gᵀ. ‖L‖h <= 2‖G‖h <= 1, so 20 terms leave 1/21!
  // of the first.
  MatrixXd term = h * (inverse.asDiagonal() * symmetrized(W) * inverse.asDiagonal());
  MatrixXd sum = term;
  for (int j = 2; j <= 20; ++j) {
    const MatrixXd once = product(G, term);
    term = (h / j) * (once + once.transpose());
    sum += term;
  }
  FLYBALL_TRY(auto Phi, expm(G * h));
  for (int k = 0; k < doublings; ++k) {
    sum += product_transposed(product(Phi, sum), Phi);
    sum = symmetrized(sum);
    Phi = product(Phi, Phi);
  }
  return MatrixXd(d.asDiagonal() * sum * d.asDiagonal());
}

}  // namespace flyball::detail
