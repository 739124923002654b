#include <flyball/control/latency.hpp>

#include <string>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>

#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_gain(const MatrixRef& K, const MatrixRef& A, const MatrixRef& B,
                          Time latency) {
  constexpr std::string_view where = "compensate_latency";
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  return check_all(check_shape(B, n, m, where, "B", "states x inputs"),
                   check_shape(K, m, n, where, "K", "inputs x states"), check_finite(A, where, "A"),
                   check_finite(B, where, "B"), check_finite(K, where, "K"),
                   check_not_negative(latency.si(), where, "latency", "s"));
}

Eigen::MatrixXd closed_loop(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K) {
  return A - detail::product(B, K);
}

}  // namespace

Expected<Eigen::MatrixXd> compensate_latency(const MatrixRef& K, const MatrixRef& A,
                                             const MatrixRef& B, Time period, Time latency) {
  constexpr std::string_view where = "compensate_latency";
  if (auto checked = check_gain(K, A, B, latency); !checked) {
    return tl::unexpected(checked.error());
  }
  if (auto checked = check_positive(period.si(), where, "period", "s"); !checked) {
    return tl::unexpected(checked.error());
  }
  auto power = powm(closed_loop(A, B, K), latency.si() / period.si());
  if (!power) {
    return tl::unexpected(Error(std::move(power.error()).in(std::string(where))));
  }
  return detail::product(K, *power);
}

namespace detail {

Expected<Eigen::MatrixXd> compensate_latency_continuous(const MatrixRef& K, const MatrixRef& A,
                                                        const MatrixRef& B, Time latency) {
  if (auto checked = check_gain(K, A, B, latency); !checked) {
    return tl::unexpected(checked.error());
  }
  return expm(closed_loop(A, B, K) * latency.si()).map([&](const Eigen::MatrixXd& exponential) {
    return product(K, exponential);
  });
}

}  // namespace detail

}  // namespace flyball
