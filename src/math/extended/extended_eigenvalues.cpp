#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "math/dense/dense.hpp"
#include "math/extended/extended_eigenvalues.hpp"
#include "math/extended/extended_eigenvalues_kernel.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// Conjugates of each other to the last bit, or real. Each pair's mean: those of a cluster err
/// far more than their sum does, and what is made of all of them again must not.
void pair_up(Eigen::VectorXcd& values) {
  const Index n = values.size();
  std::vector<bool> done(static_cast<std::size_t>(n), false);
  for (Index i = 0; i < n; ++i) {
    if (done[static_cast<std::size_t>(i)]) {
      continue;
    }
    Index nearest = i;
    double distance = 2.0 * std::abs(values(i).imag());
    for (Index j = i + 1; j < n; ++j) {
      const double there = std::abs(values(j) - std::conj(values(i)));
      if (!done[static_cast<std::size_t>(j)] && there < distance) {
        distance = there;
        nearest = j;
      }
    }
    done[static_cast<std::size_t>(i)] = done[static_cast<std::size_t>(nearest)] = true;
    if (nearest == i) {
      values(i).imag(0.0);
    } else {
      values(i) = 0.5 * (values(i) + std::conj(values(nearest)));
      values(nearest) = std::conj(values(i));
    }
  }
}

}  // namespace

std::optional<Eigen::VectorXcd> extended_eigenvalues_of(const DoubleDoubleMatrix& M) {
  Eigen::VectorXcd values(M.rows());
  if (!M.all_finite() || !FLYBALL_RUN_KERNEL(extended_eigenvalues, M, values.data()) ||
      !values.allFinite()) {
    return std::nullopt;
  }
  pair_up(values);
  return values;
}

std::optional<Eigen::VectorXcd> balanced_extended_eigenvalues_of(DoubleDoubleMatrix M) {
  const Eigen::VectorXd d = balance_of(M.rounded());
  for (Eigen::MatrixXd* part : {&M.hi, &M.lo}) {
    *part = d.cwiseInverse().asDiagonal() * *part * d.asDiagonal();
  }
  return extended_eigenvalues_of(M);
}

Eigen::VectorXcd wide_eigenvalues_of(WideMatrix M, long rate) {
  const WideMatrix S = balanced(std::move(M));
  const Index n = S.rows();
  const long unit = S.exponent();
  DoubleDoubleMatrix digits(S.rounded(-unit));
  digits.lo = sum(S, -1.0,
                  WideMatrix(digits.hi).times_powers(Eigen::VectorXi::Zero(n),
                                                     Eigen::VectorXi::Zero(n), unit))
                  .rounded(-unit);
  const auto extended = balanced_extended_eigenvalues_of(digits);
  Eigen::VectorXcd values = extended ? *extended : eigenvalues_of(digits.hi);
  for (Complex& value : values) {
    const int power = static_cast<int>(std::clamp(unit + rate, -9999L, 9999L));
    value = {std::ldexp(value.real(), power), std::ldexp(value.imag(), power)};
  }
  return values;
}

}  // namespace flyball::detail
