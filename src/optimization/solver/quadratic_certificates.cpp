// Proofs that a quadratic program has no solution (Farkas's lemma).
#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/solver/quadratic_method.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

double largest_entry(const VectorXd& v) {
  return v.size() > 0 ? v.lpNorm<Eigen::Infinity>() : 0.0;
}

}  // namespace

bool QuadraticMethod::proves_infeasible() {
  const double size = largest_entry(lambda_);
  if (!(size > 1e3) || last_.infeasibility < 1e-6) {
    return false;
  }
  program_.transpose_multiply(lambda_, residual_w_);
  // What is left of terms that cancel is rounding's; of others it is no proof where a variable may
  // be as large as the gap over it. The terms' size, from weights with other signs.
  VectorXd& terms = fix_w_;
  terms = residual_w_.cwiseAbs();
  for (const Index stride : {2, 3, 5, 7}) {
    for (Index r = 0; r < lambda_.size(); ++r) {
      fix_c_(r) = r / stride % 2 == 0 ? lambda_(r) : -lambda_(r);
    }
    program_.transpose_multiply(fix_c_, rw_);
    terms = terms.cwiseMax(rw_.cwiseAbs());
  }
  constexpr double cancelled = 1e-6;
  double gap = c0_.dot(lambda_);
  double left = 0.0;
  const auto leave = [&](Index i, double v) {
    left = v > cancelled * terms(i) ? std::max(left, v) : left;
  };
  for (Index i = 0; i < w_.size(); ++i) {
    const double v = residual_w_(i);
    if (v > 0.0) {
      if (program_.lower(i) > -infinity) {
        gap += program_.lower(i) * v;
      } else {
        leave(i, v);
      }
    } else if (program_.upper(i) < infinity) {
      gap += program_.upper(i) * v;
    } else {
      leave(i, -v);
    }
  }
  constexpr double farthest = 1e10;  // that a variable is taken to be from zero
  if (gap > 1e-7 * size && left * farthest <= gap) {
    certificate_.head(lambda_.size()) = lambda_ / size;
    return true;
  }
  return false;
}

bool QuadraticMethod::proves_unbounded() {
  const double size = largest_entry(w_);
  if (!(size > 1e4)) {
    return false;
  }
  for (const VectorXd* direction : {&w_, &affine_w_}) {
    const double length = largest_entry(*direction);
    if (!(length > 0.0)) {
      continue;
    }
    fix_w_ = *direction / length;
    fix_c_.setZero();
    program_.multiply(fix_w_, fix_c_, residual_w_, residual_c_);
    const double slope = g_.dot(fix_w_);
    double left = largest_entry(residual_c_);
    for (Index i = 0; i < w_.size(); ++i) {
      left = std::max(left, std::abs(residual_w_(i)));
      left = std::max(left, program_.lower(i) > -infinity ? -fix_w_(i) : 0.0);
      left = std::max(left, program_.upper(i) < infinity ? fix_w_(i) : 0.0);
    }
    if (slope < -1e-6 && left <= 1e-4 * -slope / std::max(1.0, largest_entry(g_)) && left < 1e-6) {
      certificate_.head(w_.size()) = fix_w_;
      return true;
    }
  }
  return false;
}

}  // namespace flyball::optimization::detail
