#include <algorithm>
#include <cmath>

#include "math/dense/pair_scaling.hpp"
#include "systems/balance.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

double power_of_two(double value) {
  return std::exp2(std::round(std::log2(value)));
}

}  // namespace

SystemScaling scaling_of(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C) {
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
  const MatrixXd scaled = scaled_state_matrix(A, scaling);
  const double size_a = scaled.norm();
  const double size_b = (scaling.states.cwiseInverse().asDiagonal() * B).norm();
  const double size_c = (C * scaling.states.asDiagonal()).norm();
  if (positive(size_b)) {
    scaling.inputs = power_of_two((positive(size_a) ? size_a : 1.0) / size_b);
  }
  if (positive(size_c)) {
    scaling.outputs = power_of_two((positive(size_a) ? size_a : 1.0) / size_c);
  }
  return scaling;
}

MatrixXd scaled_state_matrix(const MatrixRef& A, const SystemScaling& scaling) {
  return scaling.states.cwiseInverse().asDiagonal() * A * scaling.states.asDiagonal();
}

ContinuousSystem<> scaled_system(const ContinuousSystem<>& system, const SystemScaling& scaling) {
  return {scaled_state_matrix(system.A, scaling),
          scaling.states.cwiseInverse().asDiagonal() * system.B,
          system.C * scaling.states.asDiagonal(), system.D};
}

}  // namespace flyball::detail
