#include <flyball/control/delay_compensation.hpp>

#include <cmath>
#include <string>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_gain(const MatrixRef& K, const MatrixRef& A, const MatrixRef& B,
                          std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  return Checks(where)
      .shape(B, A.rows(), B.cols(), "B", "states x inputs")
      .shape(K, B.cols(), A.rows(), "K", "inputs x states")
      .finite(A, "A")
      .finite(B, "B")
      .finite(K, "K");
}

}  // namespace

Expected<std::vector<Eigen::MatrixXd>> latency_gains(const MatrixRef& K, const MatrixRef& A,
                                                     const MatrixRef& B, Time period,
                                                     Time latency) {
  constexpr std::string_view where = "latency_gains";
  constexpr double most_periods = 1e4;
  FLYBALL_CHECK(check_gain(K, A, B, where));
  FLYBALL_CHECK(Checks(where)
                    .positive(period.si(), "period", "s")
                    .not_negative(latency.si(), "latency", "s"));
  double periods = latency.si() / period.si();
  // 0.05 s / 0.005 s is ten periods, whatever the division rounds to.
  if (std::abs(periods - std::round(periods)) < 1e-9 * std::max(1.0, periods)) {
    periods = std::round(periods);
  }
  if (!(periods <= most_periods)) {
    return refusal(ArgumentError::out_of_range, where, "latency")
        .got(format_number(latency.si()) + " s")
        .expected("at most 10 000 periods");
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
    FLYBALL_TRY_IN(where, free[k], powm(A, periods - static_cast<double>(k)));
  }
  std::vector<Eigen::MatrixXd> gains;
  gains.reserve(starting + 1);
  Eigen::MatrixXd controlled = K;
  for (const Eigen::MatrixXd& power : free) {
    gains.push_back(detail::product(controlled, power));
    controlled = detail::product(controlled, closed);
  }
  FLYBALL_TRY_IN(where, const auto power, powm(closed, periods));
  gains.push_back(detail::product(K, power));
  return gains;
}

Expected<Eigen::MatrixXd> continuous_latency_gain(const MatrixRef& K, const MatrixRef& A,
                                                  const MatrixRef& B, Time latency, Time elapsed) {
  constexpr std::string_view where = "continuous_latency_gain";
  FLYBALL_CHECK(check_gain(K, A, B, where));
  FLYBALL_CHECK(Checks(where)
                    .not_negative(latency.si(), "latency", "s")
                    .not_negative(elapsed.si(), "elapsed", "s"));
  const double controlled = std::min(latency.si(), elapsed.si());
  FLYBALL_TRY(const auto closed, expm((A - detail::product(B, K)) * controlled));
  FLYBALL_TRY(const auto free, expm(A * (latency.si() - controlled)));
  return detail::product(detail::product(K, closed), free);
}

}  // namespace flyball
