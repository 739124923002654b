#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "math/extended/quad_double.hpp"
#include "math/riccati/riccati_iteration.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

template <class Matrix>
Equation<Matrix> equation_of(const RiccatiProblem& p) {
  return {Matrix(p.A), Matrix(p.B), Matrix(p.Q), Matrix(p.R), Matrix(p.N), p.continuous};
}

}  // namespace

double riccati_residual(const RiccatiProblem& p, const MatrixXd& X, const MatrixXd& K) {
  using Matrix = DoubleDoubleMatrix;
  // Not the squares, which may be too small for doubles.
  const auto size = [](const MatrixXd& M) { return M.cwiseAbs().maxCoeff(); };
  const Matrix x(X);
  const Matrix k(K);
  const Matrix closed_loop = add_product(Matrix(p.A), -1.0, Matrix(p.B), k);
  const Matrix XS = product(x, closed_loop);
  const Matrix XB = product(x, Matrix(p.B));
  const Matrix cost = product(k.transpose(), product(Matrix(p.R), k));
  const Matrix cross = product(Matrix(p.N), k);
  // With Z = [I; -K]: SᵀXS - X or SᵀX + XS, and ZᵀWZ.
  Matrix left = add_product(Matrix(p.Q), 1.0, k.transpose(), product(Matrix(p.R), k));
  left = sum(sum(std::move(left), -1.0, cross), -1.0, cross.transpose());
  const MatrixXd S = closed_loop.rounded().cwiseAbs();
  const MatrixXd magnitude = X.cwiseAbs();
  double terms = size(p.Q) + size(cost.hi) + 2.0 * size(cross.hi);
  // (R + BᵀXB)K - (BᵀXA + Nᵀ) = RK - Nᵀ - BᵀXS, or RK - Nᵀ - BᵀX.
  Matrix gain = add_product(Matrix(-p.N.transpose()), 1.0, Matrix(p.R), k);
  const MatrixXd BX = p.B.cwiseAbs().transpose() * magnitude;
  MatrixXd gain_terms = p.R.cwiseAbs() * K.cwiseAbs() + p.N.transpose().cwiseAbs();
  if (p.continuous) {
    left = sum(sum(std::move(left), 1.0, XS), 1.0, XS.transpose());
    terms += 2.0 * size(magnitude * S);
    gain = sum(std::move(gain), -1.0, XB.transpose());
    gain_terms += BX;
  } else {
    const Matrix SXS = product(closed_loop.transpose(), XS);
    left = sum(sum(std::move(left), 1.0, SXS), -1.0, x);
    terms += size(S.transpose() * magnitude * S) + size(X);
    gain = add_product(std::move(gain), -1.0, Matrix(p.B.transpose()), XS);
    gain_terms += BX * (p.A.cwiseAbs() + p.B.cwiseAbs() * K.cwiseAbs());
  }
  if (!left.all_finite() || !gain.all_finite()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto share = [](double part, double whole) { return part == 0.0 ? 0.0 : part / whole; };
  return std::max(share(size(left.hi), terms), share(size(gain.hi), size(gain_terms)));
}

std::optional<ExtendedRiccati> solve_riccati_extended(const RiccatiProblem& p) {
  // Where a mode grows a thousandfold a step, or hangs on the inputs by 1e-6, the terms of F cancel
  // to the square of that for each state: 31 digits are not enough. With more states it would take
  // seconds.
  constexpr Index most_states = 20;
  Progress progress{.work = p.work};
  if (auto found =
          solve_with(equation_of<DoubleDoubleMatrix>(p), shifts, cayley_parameters, progress)) {
    return std::move(found->rounded);
  }
  if (progress.converged && p.A.rows() <= most_states) {
    if (auto found = solve_with(equation_of<QuadDoubleMatrix>(p), std::span(shifts).first(2),
                                std::span(cayley_parameters).first(1), progress)) {
      found->rounded.cancels = true;
      return std::move(found->rounded);
    }
  }
  if (progress.idle > 0) {  // by chance, then: another start may end below the bar
    if (auto found = solve_with(equation_of<DoubleDoubleMatrix>(p), shifts, cayley_parameters,
                                progress, std::numeric_limits<int>::max() / 2)) {
      return std::move(found->rounded);
    }
  }
  return std::nullopt;
}

}  // namespace flyball::detail
