#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/estimation/smoother.hpp>

/// Records that smoothers are tried on.
namespace flyball::test {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

inline MatrixXd normals(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

/// A covariance of a rank.
inline MatrixXd covariance(Random& random, Index n, Index rank) {
  const MatrixXd F = normals(random, n, rank);
  return F * F.transpose();
}

struct Problem {
  VectorXd x0;
  MatrixXd P0;
  std::vector<LinearStep> steps;
};

/// Everything changes from step to step; some entries are missing, some steps measure nothing.
inline Problem random_problem(Random& random, Index n, Index N, Index rank_of_Q) {
  Problem problem{normals(random, n, 1), covariance(random, n, n), {}};
  for (Index k = 0; k < N; ++k) {
    LinearStep step;
    step.A = normals(random, n, n) / std::sqrt(static_cast<double>(n));
    step.input = k % 2 == 0 ? VectorXd(normals(random, n, 1)) : VectorXd();
    step.Q = covariance(random, n, rank_of_Q);
    const Index p = k % 4 == 3 ? 0 : 1 + k % 3;
    step.C = normals(random, p, n);
    step.R = covariance(random, p, p) + 0.1 * MatrixXd::Identity(p, p);
    step.y = 3.0 * normals(random, p, 1);
    if (p > 0 && k % 5 == 2) {
      step.y(0) = nan;
    }
    problem.steps.push_back(step);
  }
  return problem;
}

/// What a step without noise contracts, P has lost to rounding where it is only a matrix.
inline void expand(Problem& problem) {
  for (LinearStep& step : problem.steps) {
    step.A = MatrixXd::Identity(step.A.rows(), step.A.cols()) + 0.1 * step.A;
  }
}

}  // namespace flyball::test
