#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "control/placement_units.hpp"

namespace flyball::detail {

namespace {

/// Whether what a state does by itself is nothing in these units, in which the largest coupling is
/// near one: any gain would reach all poles then.
bool loses_modes(const MatrixRef& A, const PairScaling& units) {
  constexpr double nothing = 0x1p-200;
  const Eigen::VectorXd own = scaled_A(A, units).diagonal();
  return ((own.array().abs() < nothing) != (A.diagonal().array() == 0.0)).any();
}

/// Whether an entry is zero in these units that was not.
bool loses_entries(const MatrixRef& M, const Eigen::MatrixXd& in_units) {
  return ((M.array() != 0.0) && (in_units.array() == 0.0)).any();
}

Eigen::VectorXi inputs_near_one(const MatrixRef& B) {
  Eigen::VectorXi units(B.cols());
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    const double most = B.col(j).cwiseAbs().maxCoeff();
    units(j) = most > 0.0 ? -std::ilogb(most) : 0;
  }
  return units;
}

}  // namespace

PairScaling placement_units(const MatrixRef& A, const MatrixRef& B, const Eigen::VectorXcd& poles) {
  constexpr int far = 100;
  constexpr int slow = -10;
  constexpr int fast = 30;
  const auto is_far = [](double x) { return x != 0.0 && std::abs(std::ilogb(x)) > far; };
  const Eigen::VectorXd sizes = poles.real().cwiseAbs().cwiseMax(poles.imag().cwiseAbs());
  const double largest = sizes.maxCoeff();
  const bool all = A.unaryExpr(is_far).any() || B.unaryExpr(is_far).any() || is_far(largest);
  PairScaling units{Eigen::VectorXi::Zero(A.rows()), Eigen::VectorXi::Zero(B.cols()), 0};
  if (all) {
    units = pair_scaling_of(A, B);
    // In a unit of time in which the poles are nothing any gain would reach them.
    const bool loses_poles = largest > 0.0 && std::ilogb(largest) < units.time - far;
    if (loses_poles || loses_modes(A, units) || loses_entries(A, scaled_A(A, units)) ||
        loses_entries(B, scaled_B(B, units))) {
      units = {Eigen::VectorXi::Zero(A.rows()), inputs_near_one(B), 0};
      const double most = A.cwiseAbs().maxCoeff();
      units.time = most > 0.0 ? std::ilogb(most) : 0;
    }
  }
  if (largest > 0.0) {
    const int exponent = std::ilogb(largest);
    if (all) {
      units.time = std::max(units.time, exponent);
    } else if (exponent < slow || exponent > fast) {
      units.time = exponent;
    }
  }
  return units;
}

Eigen::VectorXcd in_units_of(const Eigen::VectorXcd& poles, int exponent) {
  return poles.unaryExpr([&](const std::complex<double>& p) {
    return std::complex<double>(std::ldexp(p.real(), exponent), std::ldexp(p.imag(), exponent));
  });
}

}  // namespace flyball::detail
