#include <flyball/systems/sampled_cost.hpp>

#include <cmath>

#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;

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
  // Fᵀ of F = [A B; 0 0], with u in a unit in which B is of A's size.
  const double T = period.si();
  const double size_B = detail::norm1(B);
  const double size_A = std::max(detail::norm1(A), 1.0 / T);
  const double unit = size_B > 0.0 ? std::exp2(std::round(std::log2(size_A / size_B))) : 1.0;
  MatrixXd F_transposed = MatrixXd::Zero(n + m, n + m);
  F_transposed.topLeftCorner(n, n) = A.transpose();
  F_transposed.bottomLeftCorner(m, n) = unit * B.transpose();
  MatrixXd W(n + m, n + m);
  W << Q, unit * N, unit * N.transpose(), unit * unit * R;
  FLYBALL_TRY(const auto integral, detail::quadratic_integral(F_transposed, W, T));
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
