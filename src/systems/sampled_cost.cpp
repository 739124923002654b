#include <flyball/systems/sampled_cost.hpp>

#include <cmath>

#include <flyball/systems/discretize.hpp>

#include "math/dense/dense.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;

Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                   const MatrixRef& R, const MatrixRef& N, Time period) {
  constexpr std::string_view where = "sampled_cost";
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(std::move(square).error());
  }
  const Index n = A.rows();
  const Index m = B.cols();
  if (auto shapes = check_all(
          check_shape(B, n, m, where, "B", "states x inputs"),
          check_shape(Q, n, n, where, "Q", "states x states"),
          check_shape(R, m, m, where, "R", "inputs x inputs"),
          check_shape(N, n, m, where, "N", "states x inputs"), check_finite(A, where, "A"),
          check_finite(B, where, "B"), check_finite(Q, where, "Q"), check_finite(R, where, "R"),
          check_finite(N, where, "N"), check_positive(period.si(), where, "period", "s"));
      !shapes) {
    return tl::unexpected(std::move(shapes).error());
  }
  if (auto symmetric = check_all(check_symmetric(Q, where, "Q"), check_symmetric(R, where, "R"));
      !symmetric) {
    return tl::unexpected(std::move(symmetric).error());
  }
  auto held = discretize_zoh(A, B, period);
  if (!held) {
    return tl::unexpected(std::move(held).error());
  }
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
  auto integral = detail::quadratic_integral(F_transposed, W, T);
  if (!integral) {
    return tl::unexpected(std::move(integral).error());
  }
  if (!integral->allFinite()) {
    return tl::unexpected(Error(ArgumentError::not_finite)
                              .in(std::string(where))
                              .about("the sampled cost")
                              .got("too large for a double")
                              .hint("shorten the period"));
  }
  return SampledCost{std::move(held->A), std::move(held->B), integral->topLeftCorner(n, n),
                     integral->bottomRightCorner(m, m) / (unit * unit),
                     integral->topRightCorner(n, m) / unit};
}

Expected<SampledCost> sampled_cost(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                                   const MatrixRef& R, Time period) {
  return sampled_cost(A, B, Q, R, MatrixXd::Zero(B.rows(), B.cols()), period);
}

}  // namespace flyball
