#include <flyball/systems/sampled_cost.hpp>

#include <cmath>
#include <utility>

#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/wide_matrix.hpp"
#include "systems/hold_units.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// ∫₀ᵀ e^{Fᵀt} W e^{Ft} dt of F = [A B; 0 0], W = [Q N; Nᵀ R].
Expected<MatrixXd> held_cost(const MatrixRef& A, const MatrixRef& B, const MatrixRef& W, double T) {
  const Index n = A.rows();
  const Index m = B.cols();
  MatrixXd F_transposed = MatrixXd::Zero(n + m, n + m);
  F_transposed.topLeftCorner(n, n) = A.transpose();
  F_transposed.bottomLeftCorner(m, n) = B.transpose();
  return detail::quadratic_integral(F_transposed, W, T);
}

/// The same with exponents of their own for all numbers: a weight far from the plant's units.
/// ∫₀ʰ = Σ W_k h^{k+1}/(k + 1)!, W_{k+1} = FᵀW_k + W_k F, then doubled: M(2h) = M(h) + EᵀM(h)E.
detail::WideMatrix held_cost_widely(const MatrixXd& F, const detail::WideMatrix& W) {
  using detail::WideMatrix;
  constexpr int terms = 26;
  const double norm = detail::norm1(F);
  const int squarings = norm > 0.125 ? std::ilogb(norm) + 4 : 0;
  const double h = std::ldexp(1.0, -squarings);
  const WideMatrix f{F};
  const WideMatrix f_transposed = f.transpose();
  WideMatrix E = WideMatrix::identity(F.rows());
  WideMatrix power = E;
  WideMatrix term = scaled(W, h);
  WideMatrix M = term;
  for (int k = 1; k < terms; ++k) {
    term = scaled(add_product(product(f_transposed, term), 1.0, term, f), h / (k + 1));
    M = sum(std::move(M), 1.0, term);
    power = scaled(product(f, power), h / k);
    E = sum(std::move(E), 1.0, power);
  }
  for (int k = 0; k < squarings; ++k) {
    M = add_product(M, 1.0, product(E.transpose(), M), E);
    E = product(E, E);
  }
  return M;
}

/// The same in units in which doubles do: x = diag(2^states) x', u = diag(2^inputs) u'.
Expected<MatrixXd> held_cost_in_other_units(const MatrixRef& A, const MatrixRef& B,
                                            const MatrixRef& W, double T) {
  const detail::HoldUnits units = detail::hold_units_of(A, B, T);
  Eigen::VectorXi d(A.rows() + B.cols());
  d << units.states, units.inputs;
  constexpr Index most_states = 20;
  constexpr double most_norm = 0x1p200;
  const int power = std::ilogb(T);
  MatrixXd F = MatrixXd::Zero(d.size(), d.size());
  F.topRows(A.rows()) << units.A, units.B;
  if (d.size() <= most_states && detail::norm1(F) < most_norm) {
    const detail::WideMatrix there =
        held_cost_widely(F, detail::WideMatrix(W).times_powers(d, d, 0));
    return scaled(there, std::ldexp(T, -power)).times_powers(-d, -d, power).rounded();
  }
  const int weight = W.isZero(0.0) ? 0 : detail::largest_exponent(W, d, d);
  FLYBALL_TRY(const auto there,
              held_cost(units.A, units.B, detail::times_powers(W, d, d, -weight), 1.0));
  return detail::times_powers(std::ldexp(T, -power) * there, -d, -d, weight + power);
}

}  // namespace

Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                   const MatrixRef& R, const MatrixRef& N, Time period) {
  constexpr std::string_view where = "sampled_cost";
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Index n = A.rows();
  const Index m = B.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(B, n, m, "B", "states x inputs")
                    .shape(Q, n, n, "Q", "states x states")
                    .shape(R, m, m, "R", "inputs x inputs")
                    .shape(N, n, m, "N", "states x inputs")
                    .finite(A, "A")
                    .finite(B, "B")
                    .finite(Q, "Q")
                    .finite(R, "R")
                    .finite(N, "N")
                    .positive(period.si(), "period", "s")
                    .symmetric(Q, "Q")
                    .symmetric(R, "R"));
  FLYBALL_TRY(auto held, discretize_zoh(A, B, period));
  const double T = period.si();
  const bool far = n > 0 && detail::needs_hold_units(A, B, T);
  // u in a unit in which B is of A's size.
  const double size_B = detail::norm1(B);
  const double size_A = std::max(detail::norm1(A), 1.0 / T);
  const double unit =
      !far && size_B > 0.0 ? std::exp2(std::round(std::log2(size_A / size_B))) : 1.0;
  MatrixXd W(n + m, n + m);
  W << Q, unit * N, unit * N.transpose(), unit * unit * R;
  FLYBALL_TRY(const auto integral,
              far ? held_cost_in_other_units(A, B, W, T) : held_cost(A, unit * B, W, T));
  if (!integral.allFinite()) {
    return refusal(ArgumentError::not_finite, where, "the sampled cost")
        .got("too large for a double")
        .hint("shorten the period");
  }
  return SampledCost{std::move(held.A), std::move(held.B), integral.topLeftCorner(n, n),
                     integral.bottomRightCorner(m, m) / (unit * unit),
                     integral.topRightCorner(n, m) / unit};
}

Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                   const MatrixRef& R, Time period) {
  return sampled_cost(A, B, Q, R, MatrixXd::Zero(B.rows(), B.cols()), period);
}

}  // namespace flyball
