#include <cmath>
#include <limits>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball::detail {

using Eigen::MatrixXd;

Expected<MatrixXd> quadratic_integral(const MatrixRef& F, const MatrixRef& W, double T) {
  // F = 2^unit D G D⁻¹: the integral over t is 2^-unit times that over 2^unit t.
  BalancedMatrix balanced;
  bool far = is_far(F) || is_far(T);
  if (!far) {
    balanced = balanced_of(F);
    far = balanced.far;
  }
  if (far) {
    balanced.unit = -std::ilogb(T);
    balanced.d = units_within(F, -balanced.unit, 0.0);
    balanced.M = balanced.there(F, -balanced.unit);
  }
  const MatrixXd& G = balanced.M;
  const Eigen::VectorXi& d = balanced.d;
  const double T_there = std::ldexp(T, balanced.unit);
  const double norm = norm1(G) * T_there;
  if (!std::isfinite(norm)) {
    return MatrixXd(
        MatrixXd::Constant(F.rows(), F.cols(), std::numeric_limits<double>::infinity()));
  }
  const int doublings = norm > 0.5 ? static_cast<int>(std::ceil(std::log2(norm / 0.5))) : 0;
  const double h = std::ldexp(T_there, -doublings);

  // Σ_j h^{j+1}/(j+1)! L^j(W) with L(X) = G X + X Gᵀ. ‖L‖h <= 2‖G‖h <= 1, so 20 terms leave 1/21!
  // of the first in these units. In the given ones what is left may count: paths through many
  // states that weak feedback has made small in the units that balance it.
  constexpr int enough = 20;
  constexpr double rounding = 1e-17;
  const int weight = far && !W.isZero(0.0) ? largest_exponent(W, -d, -d) : 0;
  const auto given = [&](const MatrixXd& M) {
    return times_powers(M, d, d, weight - balanced.unit);
  };
  const auto counts = [&](const MatrixXd& last, const MatrixXd& all) {
    return given(last).cwiseAbs().maxCoeff() > rounding * given(all).cwiseAbs().maxCoeff();
  };
  const bool has_units = !d.isZero();
  const int most = enough + 4 * static_cast<int>(F.rows());
  MatrixXd term = h * times_powers(symmetrized(W), -d, -d, -weight);
  MatrixXd sum = term;
  for (int j = 2; j <= enough || (has_units && j <= most && counts(term, sum)); ++j) {
    const MatrixXd once = product(G, term);
    term = (h / j) * (once + once.transpose());
    sum += term;
  }
  // Taken of F itself, which is balanced there with regard to the given units.
  MatrixXd Phi;
  if (far) {
    FLYBALL_TRY(Phi, expm(G * h));
  } else {
    FLYBALL_TRY(const auto step, expm(F * std::ldexp(T, -doublings)));
    Phi = balanced.there(step);
  }
  for (int k = 0; k < doublings; ++k) {
    sum += product_transposed(product(Phi, sum), Phi);
    sum = symmetrized(sum);
    Phi = product(Phi, Phi);
  }
  return given(sum);
}

}  // namespace flyball::detail
