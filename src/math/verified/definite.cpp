#include <cmath>
#include <utility>

#include "math/verified/definite.hpp"
#include "math/verified/interval.hpp"

namespace flyball::detail {

double norm_above(const Eigen::MatrixXd& A) {
  if (A.size() == 0) {
    return 0.0;
  }
  const double columns = A.colwise().sum().maxCoeff();
  const double rows = A.rowwise().sum().maxCoeff();
  return std::sqrt(columns * rows) * inflation * inflation + underflow;
}

double product_rounding(Eigen::Index n) {
  return static_cast<double>(2 * n + 8) * unit_roundoff;
}

bool surely_positive(Eigen::MatrixXd S, double error) {
  const Eigen::Index n = S.rows();
  const double trace = S.diagonal().cwiseAbs().sum();
  if (!(error < 1e300) || !(trace < 1e300)) {
    return false;
  }
  const double shift = (error + 2.0 * product_rounding(n) * trace) * inflation + underflow;
  S.diagonal().array() -= shift;
  for (Eigen::Index j = 0; j < n; ++j) {
    if (!(S(j, j) > 0.0)) {
      return false;
    }
    const double pivot = std::sqrt(S(j, j));
    for (Eigen::Index i = j; i < n; ++i) {
      S(i, j) /= pivot;
    }
    for (Eigen::Index k = j + 1; k < n; ++k) {
      for (Eigen::Index i = k; i < n; ++i) {
        S(i, k) -= S(i, j) * S(k, j);
      }
    }
  }
  return true;
}

bool surely_positive(const Eigen::MatrixXcd& S, double error) {
  const Eigen::Index n = S.rows();
  Eigen::MatrixXd doubled(2 * n, 2 * n);
  doubled << S.real(), -S.imag(), S.imag(), S.real();
  return surely_positive(std::move(doubled), error);
}

}  // namespace flyball::detail
