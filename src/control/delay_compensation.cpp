#include <flyball/control/delay_compensation.hpp>

#include <cmath>
#include <string>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>

#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_gain(const MatrixRef& K, const MatrixRef& A, const MatrixRef& B,
                          std::string_view where) {
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  return check_all(check_shape(B, A.rows(), B.cols(), where, "B", "states x inputs"),
                   check_shape(K, B.cols(), A.rows(), where, "K", "inputs x states"),
                   check_finite(A, where, "A"), check_finite(B, where, "B"),
                   check_finite(K, where, "K"));
}

}  // namespace

Expected<std::vector<Eigen::MatrixXd>> latency_gains(const MatrixRef& K, const MatrixRef& A,
                                                     const MatrixRef& B, Time period,
                                                     Time latency) {
  constexpr std::string_view where = "latency_gains";
  constexpr double most_periods = 1e4;
  if (auto checked = check_gain(K, A, B, where); !checked) {
    return tl::unexpected(checked.error());
  }
  if (auto checked = check_all(check_positive(period.si(), where, "period", "s"),
                               check_not_negative(latency.si(), where, "latency", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  double periods = latency.si() / period.si();
  // 0.05 s / 0.005 s is ten periods, whatever the division rounds to.
  if (std::abs(periods - std::round(periods)) < 1e-9 * std::max(1.0, periods)) {
    periods = std::round(periods);
  }
  if (!(periods <= most_periods)) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(where))
                              .about("latency")
                              .got(format_number(latency.si()) + " s")
                              .expected("at most 10 000 periods"));
  }
  const auto starting = static_cast<std::size_t>(std::ceil(periods));
  const Eigen::MatrixXd closed = A - detail::product(B, K);
  // K (A - BK)^k A^(L/T - k): the power of A loses one period a step, from its fraction upwards.
  std::vector<Eigen::MatrixXd> free(starting);
  for (std::size_t k = starting; k-- > 0;) {
    if (k + 1 < starting) {
      free[k] = detail::product(free[k + 1], A);
      continue;
    }
    auto power = powm(A, periods - static_cast<double>(k));
    if (!power) {
      return tl::unexpected(Error(std::move(power.error()).in(std::string(where))));
    }
    free[k] = std::move(*power);
  }
  std::vector<Eigen::MatrixXd> gains;
  gains.reserve(starting + 1);
  Eigen::MatrixXd controlled = K;
  for (const Eigen::MatrixXd& power : free) {
    gains.push_back(detail::product(controlled, power));
    controlled = detail::product(controlled, closed);
  }
  auto power = powm(closed, periods);
  if (!power) {
    return tl::unexpected(Error(std::move(power.error()).in(std::string(where))));
  }
  gains.push_back(detail::product(K, *power));
  return gains;
}

Expected<Eigen::MatrixXd> continuous_latency_gain(const MatrixRef& K, const MatrixRef& A,
                                                  const MatrixRef& B, Time latency, Time elapsed) {
  constexpr std::string_view where = "continuous_latency_gain";
  if (auto checked = check_gain(K, A, B, where); !checked) {
    return tl::unexpected(checked.error());
  }
  if (auto checked = check_all(check_not_negative(latency.si(), where, "latency", "s"),
                               check_not_negative(elapsed.si(), where, "elapsed", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  const double controlled = std::min(latency.si(), elapsed.si());
  const auto closed = expm((A - detail::product(B, K)) * controlled);
  if (!closed) {
    return tl::unexpected(closed.error());
  }
  const auto free = expm(A * (latency.si() - controlled));
  if (!free) {
    return tl::unexpected(free.error());
  }
  return detail::product(detail::product(K, *closed), *free);
}

}  // namespace flyball
