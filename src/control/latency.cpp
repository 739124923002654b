#include <flyball/control/latency.hpp>

#include <string>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_gain(const MatrixRef& K, const MatrixRef& A, const MatrixRef& B,
                          Time latency) {
  constexpr std::string_view where = "compensate_latency";
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  return Checks(where)
      .shape(B, n, m, "B", "states x inputs")
      .shape(K, m, n, "K", "inputs x states")
      .finite(A, "A")
      .finite(B, "B")
      .finite(K, "K")
      .not_negative(latency.si(), "latency", "s");
}

Eigen::MatrixXd closed_loop(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K) {
  return A - detail::product(B, K);
}

}  // namespace

Expected<Eigen::MatrixXd> compensate_latency(const MatrixRef& K, const MatrixRef& A,
                                             const MatrixRef& B, Time period, Time latency) {
  constexpr std::string_view where = "compensate_latency";
  FLYBALL_CHECK(check_gain(K, A, B, latency));
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  FLYBALL_TRY_IN(where, const auto power, powm(closed_loop(A, B, K), latency.si() / period.si()));
  return detail::product(K, power);
}

namespace detail {

Expected<Eigen::MatrixXd> compensate_latency_continuous(const MatrixRef& K, const MatrixRef& A,
                                                        const MatrixRef& B, Time latency) {
  FLYBALL_CHECK(check_gain(K, A, B, latency));
  return expm(closed_loop(A, B, K) * latency.si()).map([&](const Eigen::MatrixXd& exponential) {
    return product(K, exponential);
  });
}

}  // namespace detail

}  // namespace flyball
