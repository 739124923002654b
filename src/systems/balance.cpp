#include <algorithm>
#include <cmath>
#include <optional>

#include "math/dense/balanced.hpp"
#include "math/dense/pair_scaling.hpp"
#include "systems/balance.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXi;

double power_of_two(double value) {
  return std::exp2(std::round(std::log2(value)));
}

int exponent_of(double power) {
  return std::ilogb(power);
}

/// The exponent of the largest M_ij 2^(row_i + column_j); nothing of zeros.
std::optional<int> exponent_in_units(const MatrixRef& M, const VectorXi& row,
                                     const VectorXi& column) {
  return M.isZero(0.0) ? std::nullopt : std::optional(largest_exponent(M, row, column));
}

bool any_far(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C) {
  return (is_far(A) || is_far(B) || is_far(C)) && A.allFinite() && B.allFinite() && C.allFinite();
}

double factor_between(double from, double to) {
  const bool known = to > 0.0 && std::isfinite(to);
  return from > 0.0 && std::isfinite(from) ? power_of_two((known ? to : 1.0) / from) : 1.0;
}

/// Of entries whose sums and quotients doubles may not hold. The unit of all states together, which
/// is free, makes B and C equally large.
SystemScaling scaling_of_far(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C) {
  constexpr int widest = 1000;
  const VectorXi e = pair_scaling_of(A, B, C).states;
  const auto b = exponent_in_units(B, -e, VectorXi::Zero(B.cols()));
  const auto c = exponent_in_units(C, VectorXi::Zero(C.rows()), e);
  const int all = b && c ? (*b - *c) / 2 : e.size() > 0 ? -(e.maxCoeff() + e.minCoeff()) / 2 : 0;
  SystemScaling scaling;
  scaling.states = e.unaryExpr([&](int x) { return std::clamp(x + all, -widest, widest); })
                       .cast<double>()
                       .unaryExpr([](double x) { return std::exp2(x); });
  const double size = scaled_state_matrix(A, scaling).norm();
  const ContinuousSystem<> scaled =
      scaled_system({A, B, C, MatrixXd::Zero(C.rows(), B.cols())}, scaling);
  scaling.inputs = factor_between(scaled.B.norm(), size);
  scaling.outputs = factor_between(scaled.C.norm(), size);
  return scaling;
}

}  // namespace

SystemScaling scaling_of(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C) {
  if (any_far(A, B, C)) {
    return scaling_of_far(A, B, C);
  }
  const Index n = A.rows();
  SystemScaling scaling;
  scaling.states.setOnes(n);
  MatrixXd M = A.cwiseAbs();
  MatrixXd b = B.cwiseAbs();
  MatrixXd c = C.cwiseAbs();
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  const auto rescale = [&](Index i, double f) {
    scaling.states(i) *= f;
    M.col(i) *= f;
    M.row(i) /= f;
    b.row(i) /= f;
    c.col(i) *= f;
  };
  // Inputs and outputs in units of their own: only the relation between the states counts. Their
  // size is what no units change; if it followed the states', all would run away.
  const double cycle = cycle_mean_of(A);
  const double size = std::isfinite(cycle) ? static_cast<double>(n) * std::exp2(cycle) : M.sum();
  for (int sweep = 0; sweep < 60; ++sweep) {
    for (MatrixXd* side : {&b, &c}) {
      const double sum = side->sum();
      if (positive(sum) && positive(size)) {
        *side *= size / sum;
      }
    }
    bool changed = false;
    for (Index i = 0; i < n; ++i) {
      const double own = M(i, i);
      const double column = M.col(i).sum() - own + c.col(i).sum();
      const double row = M.row(i).sum() - own + b.row(i).sum();
      if (!positive(column) && !positive(row)) {
        continue;
      }
      double f = 1.0;
      if (positive(column) && positive(row)) {
        f = power_of_two(std::sqrt(row / column));
        if (f == 1.0 || column * f + row / f > 0.95 * (column + row)) {
          continue;
        }
      } else {
        const double others = (M.sum() + b.sum() + c.sum() - column - row) /
                              static_cast<double>(std::max<Index>(1, n));
        if (!positive(others)) {
          continue;
        }
        f = positive(row) ? power_of_two(row / others) : power_of_two(others / column);
        if (f <= 2.0 && f >= 0.5) {
          continue;
        }
      }
      if (!positive(scaling.states(i) * f) || !positive(1.0 / (scaling.states(i) * f))) {
        continue;
      }
      rescale(i, f);
      changed = true;
    }
    if (!changed) {
      break;
    }
  }
  VectorXi states = scaling.states.unaryExpr(&exponent_of).cast<int>();
  balance_parts(A, states);
  scaling.states = states.unaryExpr([](int e) { return std::ldexp(1.0, e); }).cast<double>();
  const MatrixXd scaled = scaled_state_matrix(A, scaling);
  const double size_a = scaled.norm();
  const double size_b = (scaling.states.cwiseInverse().asDiagonal() * B).norm();
  const double size_c = (C * scaling.states.asDiagonal()).norm();
  scaling.inputs = factor_between(size_b, size_a);
  scaling.outputs = factor_between(size_c, size_a);
  return scaling;
}

MatrixXd scaled_state_matrix(const MatrixRef& A, const SystemScaling& scaling) {
  if (is_far(A) || is_far(scaling.states)) {
    const VectorXi e = scaling.states.unaryExpr(&exponent_of).cast<int>();
    return times_powers(A, -e, e, 0);
  }
  return scaling.states.cwiseInverse().asDiagonal() * A * scaling.states.asDiagonal();
}

ContinuousSystem<> scaled_system(const ContinuousSystem<>& system, const SystemScaling& scaling) {
  return {scaled_state_matrix(system.A, scaling),
          scaling.states.cwiseInverse().asDiagonal() * system.B,
          system.C * scaling.states.asDiagonal(), system.D};
}

NormalizedSystem normalized(const ContinuousSystem<>& system, TimeDomain domain) {
  const auto& [A, B, C, D] = system;
  const bool continuous = domain == TimeDomain::continuous;
  const VectorXi e = any_far(A, B, C)
                         ? pair_scaling_of(A, B, C).states
                         : scaling_of(A, B, C).states.unaryExpr(&exponent_of).cast<int>();
  const VectorXi no_inputs = VectorXi::Zero(B.cols());
  const VectorXi no_outputs = VectorXi::Zero(C.rows());
  NormalizedSystem made;
  if (continuous) {
    const int rate = exponent_in_units(A, -e, e).value_or(0);
    made.time = rate - (rate & 1);
  }
  const auto b = exponent_in_units(B, -e, no_inputs);
  const auto c = exponent_in_units(C, no_outputs, e);
  const auto d = exponent_in_units(D, no_outputs, no_inputs);
  int share = 0;
  if (b && c) {
    made.gain = *b + *c - made.time;
    // What D exceeds C(sI - A)⁻¹B by, so that neither leaves the doubles where it counts.
    share = d && *d > made.gain ? made.gain - *d : 0;
    made.gain -= share;
  } else {
    made.gain = d.value_or(0);
  }
  made.system = {times_powers(A, -e, e, -made.time), times_powers(B, -e, no_inputs, -b.value_or(0)),
                 times_powers(C, no_outputs, e, share - c.value_or(0)),
                 times_powers(D, no_outputs, no_inputs, -made.gain)};
  return made;
}

}  // namespace flyball::detail
