#include <flyball/estimation/smoother.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/fixed_lag_smoother.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

#include "support/allocation_count.hpp"

namespace flyball {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

MatrixXd normals(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

/// A covariance of a rank.
MatrixXd covariance(Random& random, Index n, Index rank) {
  const MatrixXd F = normals(random, n, rank);
  return F * F.transpose();
}

struct Problem {
  VectorXd x0;
  MatrixXd P0;
  std::vector<LinearStep> steps;
};

/// Everything changes from step to step; some entries are missing, some steps measure nothing.
Problem random_problem(Random& random, Index n, Index N, Index rank_of_Q) {
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
void expand(Problem& problem) {
  for (LinearStep& step : problem.steps) {
    step.A = MatrixXd::Identity(step.A.rows(), step.A.cols()) + 0.1 * step.A;
  }
}

struct Batch {
  MatrixXd x;
  MatrixXd P;
  double log_likelihood = 0.0;
};

/// The path as one dense least-squares problem of what is random, ξ ~ N(0, I): x = m + T ξ and
/// y = H x + v, min ‖ξ‖² + ‖R^(-1/2)(y - H m - H T ξ)‖², by one QR decomposition.
Batch batch(const Problem& problem) {
  const Index n = problem.x0.size();
  const auto N = static_cast<Index>(problem.steps.size());
  const auto factor = [](const MatrixXd& P) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> system(P);
    return MatrixXd(system.eigenvectors() *
                    system.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal());
  };
  VectorXd m((N + 1) * n);
  MatrixXd T = MatrixXd::Zero((N + 1) * n, (N + 1) * n);
  m.head(n) = problem.x0;
  T.topLeftCorner(n, n) = factor(problem.P0);
  std::vector<VectorXd> rows;
  std::vector<double> values;
  double log_det_R = 0.0;
  for (Index k = 0; k < N; ++k) {
    const LinearStep& step = problem.steps[static_cast<std::size_t>(k)];
    m.segment((k + 1) * n, n) = step.A * m.segment(k * n, n);
    if (step.input.size() > 0) {
      m.segment((k + 1) * n, n) += step.input;
    }
    T.middleRows((k + 1) * n, n) = step.A * T.middleRows(k * n, n);
    T.block((k + 1) * n, (k + 1) * n, n, n) = factor(step.Q);
    std::vector<Index> there;
    for (Index i = 0; i < step.y.size(); ++i) {
      if (!std::isnan(step.y(i))) {
        there.push_back(i);
      }
    }
    if (there.empty()) {
      continue;
    }
    const MatrixXd R = step.R(there, there);
    const MatrixXd L = R.llt().matrixL();
    const MatrixXd white =
        L.triangularView<Eigen::Lower>().solve(MatrixXd(step.C(there, Eigen::all)));
    const VectorXd y = L.triangularView<Eigen::Lower>().solve(VectorXd(step.y(there)));
    log_det_R += 2.0 * L.diagonal().array().log().sum();
    for (Index i = 0; i < y.size(); ++i) {
      rows.emplace_back((white.row(i) * T.middleRows((k + 1) * n, n)).transpose());
      values.push_back(y(i) - white.row(i).dot(m.segment((k + 1) * n, n)));
    }
  }
  const auto count = static_cast<Index>(rows.size());
  MatrixXd J = MatrixXd::Zero(T.cols() + count, T.cols());
  VectorXd b = VectorXd::Zero(J.rows());
  J.topRows(T.cols()).setIdentity();
  for (Index i = 0; i < count; ++i) {
    J.row(T.cols() + i) = rows[static_cast<std::size_t>(i)].transpose();
    b(T.cols() + i) = values[static_cast<std::size_t>(i)];
  }
  const Eigen::HouseholderQR<MatrixXd> qr(J);
  Batch result;
  const VectorXd xi = qr.solve(b);
  result.x = (m + T * xi).reshaped(n, N + 1);
  const MatrixXd root =
      qr.matrixQR().topRows(T.cols()).triangularView<Eigen::Upper>().transpose().solve(
          T.transpose());
  result.P = root.transpose() * root;
  const MatrixXd HT = J.bottomRows(count);
  const MatrixXd S = HT * HT.transpose() + MatrixXd::Identity(count, count);
  const Eigen::LLT<MatrixXd> llt(S);
  const VectorXd e = b.tail(count);
  result.log_likelihood =
      -0.5 * (e.dot(llt.solve(e)) + 2.0 * llt.matrixLLT().diagonal().array().log().sum() +
              log_det_R + static_cast<double>(count) * std::log(2.0 * M_PI));
  return result;
}

void expect_equal(const LinearSmoothing& smoothing, const Batch& expected, double tolerance) {
  const SmoothedPath& path = smoothing.smoothed;
  const Index n = path.x.rows();
  ASSERT_EQ(path.x.cols(), expected.x.cols());
  EXPECT_NEAR((path.x - expected.x).norm() / expected.x.norm(), 0.0, tolerance);
  const double size = expected.P.norm();
  for (Index k = 0; k < path.x.cols(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_NEAR((path.P[at] - expected.P.block(k * n, k * n, n, n)).norm() / size, 0.0, tolerance);
    if (k + 1 < path.x.cols()) {
      EXPECT_NEAR((path.P_cross[at] - expected.P.block(k * n, (k + 1) * n, n, n)).norm() / size,
                  0.0, tolerance);
    }
  }
  EXPECT_NEAR(smoothing.log_likelihood / expected.log_likelihood, 1.0, tolerance);
}

TEST(Smoother, IsTheBatchLeastSquaresSolution) {
  Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 1 + trial % 5;
    const Problem problem = random_problem(random, n, 1 + trial % 17, n);
    const auto smoothing = smooth(problem.x0, problem.P0, problem.steps);
    ASSERT_TRUE(smoothing) << to_string(smoothing.error());
    expect_equal(*smoothing, batch(problem), 1e-9);
  }
}

// Noise on one direction only, or on none; a start that is known in all directions but one.
TEST(Smoother, IsThatWhereCovariancesAreSingular) {
  Random random(12);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 2 + trial % 3;
    Problem problem = random_problem(random, n, 9, trial % 2);
    problem.P0 = covariance(random, n, trial % 3 == 0 ? n : 1);
    if (trial % 4 == 1) {  // a state that each step forgets, and one that never moves
      for (LinearStep& step : problem.steps) {
        step.A.col(0).setZero();
        step.A.row(n - 1) = VectorXd::Unit(n, n - 1).transpose();
        step.Q.row(n - 1).setZero();
        step.Q.col(n - 1).setZero();
      }
    }
    const auto smoothing = smooth(problem.x0, problem.P0, problem.steps);
    ASSERT_TRUE(smoothing) << to_string(smoothing.error());
    expect_equal(*smoothing, batch(problem), 1e-9);
  }
}

// What is known at first is nearly nothing: P0 = 1e12 times what a measurement says.
TEST(Smoother, AStartThatIsNotKnownCostsNoDigits) {
  Random random(13);
  for (int trial = 0; trial < 20; ++trial) {
    Problem problem = random_problem(random, 2, 12, 1);
    problem.P0 = 1e12 * MatrixXd::Identity(2, 2);
    const auto smoothing = smooth(problem.x0, problem.P0, problem.steps).value();
    const Batch expected = batch(problem);
    EXPECT_NEAR((smoothing.smoothed.x - expected.x).norm() / expected.x.norm(), 0.0, 1e-8);
  }
}

// A history of x⁻, x⁺ and P⁺, as any filter leaves it, gives the same path.
TEST(Smoother, OverAFiltersHistoryIsTheSame) {
  Random random(14);
  for (int trial = 0; trial < 30; ++trial) {
    const Index n = 1 + trial % 4;
    Problem problem = random_problem(random, n, 12, trial % 3 == 0 ? 0 : n);
    if (trial % 3 == 0) {
      expand(problem);
    }
    const auto expected = smooth(problem.x0, problem.P0, problem.steps).value();
    std::vector<FilterStep<>> history;
    for (std::size_t k = 0; k < problem.steps.size(); ++k) {
      const LinearStep& step = problem.steps[k];
      const auto column = static_cast<Index>(k);
      VectorXd prior = step.A * expected.x_filtered.col(column);
      if (step.input.size() > 0) {
        prior += step.input;
      }
      history.push_back(
          {step.A, step.Q, prior, expected.x_filtered.col(column + 1), expected.P_filtered[k + 1]});
    }
    const auto path = smooth(problem.x0, problem.P0, history).value();
    EXPECT_NEAR((path.x - expected.smoothed.x).norm() / path.x.norm(), 0.0, 1e-8);
    for (std::size_t k = 0; k < path.P.size(); ++k) {
      EXPECT_NEAR((path.P[k] - expected.smoothed.P[k]).norm(), 0.0,
                  1e-8 * (1.0 + path.P[k].norm()));
    }
  }
}

// Scalar A = C = Q = R = P0 = 1 from x0 = 0, y = 3, 1: P⁻ = 2, K = 2/3: x⁺ = 2, P⁺ = 2/3; P⁻ = 5/3,
// K = 5/8: x⁺ = 2 - 5/8 = 11/8, P⁺ = 5/8. Back: K = (2/3)/(5/3) = 2/5: x = 2 + 2/5(11/8 - 2) = 7/4,
// P = 2/3 + 4/25 (5/8 - 5/3) = 1/2; K = 1/2: x = 0 + 7/4/2 = 7/8, P = 1 + (1/2 - 2)/4 = 5/8.
// log p = log N(3; 0, 3) + log N(1; 2, 8/3).
TEST(Smoother, ByHand) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  const DiscreteSystem<> plant{one, one, one, MatrixXd::Zero(1, 1), Time(1.0)};
  const auto result = smooth(plant, one, one, VectorXd::Zero(1), one, MatrixXd::Zero(1, 2),
                             MatrixXd(Eigen::RowVector2d(3.0, 1.0)))
                          .value();
  EXPECT_NEAR((result.smoothed.x - Eigen::RowVector3d(0.875, 1.75, 1.375)).norm(), 0.0, 1e-14);
  EXPECT_NEAR((result.x_filtered - Eigen::RowVector3d(0.0, 2.0, 1.375)).norm(), 0.0, 1e-14);
  EXPECT_NEAR(result.smoothed.P[0](0), 0.625, 1e-15);
  EXPECT_NEAR(result.smoothed.P[1](0), 0.5, 1e-15);
  EXPECT_NEAR(result.nis(0), 3.0, 1e-14);
  EXPECT_NEAR(result.nis(1), 3.0 / 8.0, 1e-14);
  EXPECT_NEAR(result.log_likelihood,
              -0.5 * (3.0 + 0.375 + std::log(8.0) + 2.0 * std::log(2.0 * M_PI)), 1e-14);
  EXPECT_EQ(result.measured, Eigen::Vector2i(1, 1));
}

// Without noise the plant is certain of its outputs: a measurement that agrees adds nothing, one
// that differs is refused; D u is part of the output, and a missing input is not allowed.
TEST(Smoother, CertainPlants) {
  const DiscreteSystem<> plant{MatrixXd::Constant(1, 1, 0.5), MatrixXd::Ones(1, 1),
                               MatrixXd::Ones(1, 1), MatrixXd::Constant(1, 1, 2.0), Time(1.0)};
  const MatrixXd zero = MatrixXd::Zero(1, 1);
  const MatrixXd inputs = Eigen::RowVector3d(1.0, -1.0, 0.5);
  MatrixXd outputs = Eigen::RowVector3d(2.0 + 2.0, 0.0 - 2.0, 0.5 + 1.0);
  const VectorXd x0 = VectorXd::Constant(1, 2.0);
  const auto certain = smooth(plant, zero, zero, x0, zero, inputs, outputs);
  ASSERT_TRUE(certain) << to_string(certain.error());
  EXPECT_EQ(certain->smoothed.x, MatrixXd(Eigen::RowVector4d(2.0, 2.0, 0.0, 0.5)));
  EXPECT_EQ(certain->measured.sum(), 0);
  EXPECT_EQ(certain->log_likelihood, 0.0);
  outputs(1) = 0.1;
  const auto refused = smooth(plant, zero, zero, x0, zero, inputs, outputs);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(GaussianError::contradiction));
  EXPECT_EQ(refused.error().subject(), "y(0) of step 1");
  // A start that nothing is known of, measured twice without noise: known from there on.
  outputs(1) = -2.0;
  const auto found =
      smooth(plant, zero, zero, VectorXd::Zero(1), MatrixXd::Constant(1, 1, 1e6), inputs, outputs);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR((found->smoothed.x - certain->smoothed.x).norm(), 0.0, 1e-9);
  EXPECT_EQ(found->measured, Eigen::Vector3i(1, 0, 0));
}

TEST(Smoother, Refusals) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  const VectorXd x0 = VectorXd::Zero(1);
  std::vector<LinearStep> steps(3, LinearStep{one, {}, one, one, one, x0});
  const auto refused = [&](auto change) {
    auto changed = steps;
    change(changed[1]);
    return smooth(x0, one, changed).error();
  };
  EXPECT_TRUE(smooth(x0, one, std::vector<LinearStep>())->smoothed.x.cols() == 1);
  EXPECT_TRUE(
      refused([](LinearStep& s) { s.A = MatrixXd::Ones(2, 1); }).is(ArgumentError::wrong_shape));
  EXPECT_EQ(to_string(refused([](LinearStep& s) { s.A(0) = nan; })).substr(0, 21),
            "smooth: A of step 1(0");
  EXPECT_TRUE(refused([](LinearStep& s) { s.Q(0) = -1.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused([](LinearStep& s) { s.R(0) = -1.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused([](LinearStep& s) { s.R(0) = nan; }).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused([](LinearStep& s) {
                s.y(0) = std::numeric_limits<double>::infinity();
              }).is(ArgumentError::not_finite));
  EXPECT_TRUE(
      refused([](LinearStep& s) { s.C = MatrixXd::Ones(2, 1); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      refused([](LinearStep& s) { s.input = VectorXd::Ones(2); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(smooth(VectorXd(), MatrixXd(), steps).error().is(ArgumentError::empty));
  EXPECT_TRUE(smooth(x0, -one, steps).error().is(ArgumentError::not_positive));
  // A measurement brings back what a step has blown up; two steps without one do not.
  steps[0].A(0) = steps[1].A(0) = 1e150;
  EXPECT_TRUE(smooth(VectorXd::Ones(1), one, steps));
  steps[0].y(0) = steps[1].y(0) = nan;
  EXPECT_TRUE(smooth(VectorXd::Ones(1), one, steps).error().is(ArgumentError::out_of_range));
  std::vector<FilterStep<>> history(2, FilterStep<>{one, one, x0, x0, one});
  history[1].P(0) = -1.0;
  EXPECT_TRUE(smooth(x0, one, history).error().is(ArgumentError::not_positive));
  history[1].P(0) = 1.0;
  history[0].x(0) = nan;
  EXPECT_TRUE(smooth(x0, one, history).error().is(ArgumentError::not_finite));
}

// Of a linear prediction, X = P Aᵀ and P⁻ = A P Aᵀ + Q give A and Q back, on what P can show.
TEST(StatisticalLinearization, OfALinearMapIsTheMap) {
  Random random(15);
  const MatrixXd A = normals(random, 3, 3);
  const MatrixXd Q = covariance(random, 3, 2);
  const MatrixXd P = covariance(random, 3, 3);
  const auto step =
      statistical_linearization(P * A.transpose(), P, A * P * A.transpose() + Q).value();
  EXPECT_NEAR((step.F - A).norm(), 0.0, 1e-7);
  EXPECT_NEAR((step.Q - Q).norm(), 0.0, 1e-7);
  const MatrixXd flat = covariance(random, 3, 1);
  const auto shown =
      statistical_linearization(flat * A.transpose(), flat, A * flat * A.transpose() + Q).value();
  EXPECT_NEAR(((shown.F - A) * flat).norm(), 0.0, 1e-7);
  EXPECT_TRUE(statistical_linearization(10.0 * P, P, P).error().is(ArgumentError::not_positive));
  EXPECT_FALSE(statistical_linearization(MatrixXd::Ones(2, 3), P, P));
}

template <int n>
FilterStep<n> fixed(const FilterStep<>& step) {
  return {step.F, step.Q, step.x_prior, step.x, step.P};
}

// At each instant, the smoother with a lag of 4 says what the smoother over all steps so far says.
TEST(FixedLagSmoother, IsTheSmootherOverTheStepsSoFar) {
  Random random(16);
  for (const Index rank : {3, 1, 0}) {
    Problem problem = random_problem(random, 3, 15, rank);
    if (rank == 0) {
      expand(problem);
    }
    const auto forward = smooth(problem.x0, problem.P0, problem.steps).value();
    FixedLagSmoother<3, 4> smoother(problem.x0, problem.P0);
    std::vector<FilterStep<>> history;
    for (std::size_t k = 0; k < problem.steps.size(); ++k) {
      const LinearStep& step = problem.steps[k];
      const auto column = static_cast<Index>(k);
      VectorXd prior = step.A * forward.x_filtered.col(column);
      if (step.input.size() > 0) {
        prior += step.input;
      }
      history.push_back(
          {step.A, step.Q, prior, forward.x_filtered.col(column + 1), forward.P_filtered[k + 1]});
      ASSERT_TRUE(smoother.take(fixed<3>(history.back())));
      const auto path = smooth(problem.x0, problem.P0, history).value();
      ASSERT_EQ(smoother.available(), std::min(static_cast<int>(k) + 1, 4));
      for (int lag = 0; lag <= smoother.available(); ++lag) {
        const auto at = smoother.at(lag);
        const Index expected = column + 1 - lag;
        EXPECT_NEAR((at.x - path.x.col(expected)).norm(), 0.0, 1e-8 * (1.0 + at.x.norm()));
        EXPECT_NEAR((at.P - path.P[static_cast<std::size_t>(expected)]).norm(), 0.0,
                    1e-8 * (1.0 + at.P.norm()));
      }
      EXPECT_EQ(smoother.at(99).x, smoother.at(smoother.available()).x);
      EXPECT_EQ(smoother.at(-1).x, smoother.at(0).x);
    }
  }
}

TEST(FixedLagSmoother, TakesOnlyWhatIsFiniteAndAllocatesNothing) {
  using Step = FilterStep<2>;
  const Step good{Eigen::Matrix2d{{1.0, 0.02}, {0.0, 1.0}}, 0.01 * Eigen::Matrix2d::Identity(),
                  Eigen::Vector2d(0.1, 0.0), Eigen::Vector2d(0.2, 0.1),
                  Eigen::Matrix2d::Identity()};
  FixedLagSmoother<2, 50> smoother(Eigen::Vector2d::Zero(), Eigen::Matrix2d::Identity());
  smoother.take(good);
  const auto before = smoother.at(1);
  for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e300}) {
    for (int part = 0; part < 5; ++part) {
      Step step = good;
      (part == 0   ? step.F(0, 1)
       : part == 1 ? step.Q(1, 1)
       : part == 2 ? step.x_prior(0)
       : part == 3 ? step.x(1)
                   : step.P(0, 0)) = bad;
      EXPECT_FALSE(smoother.take(step)) << part << ' ' << bad;
    }
  }
  EXPECT_EQ(smoother.at(1).x, before.x);
  EXPECT_EQ(smoother.available(), 1);
  const test::AllocationCounter allocations;
  double sum = 0.0;
  for (int k = 0; k < 1000; ++k) {
    smoother.take(good);
    sum += smoother.at(50).x(0);
  }
  EXPECT_EQ(allocations.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
  EXPECT_EQ(smoother.available(), 50);
  smoother.reset(Eigen::Vector2d::Ones(), Eigen::Matrix2d::Identity());
  EXPECT_EQ(smoother.available(), 0);
  EXPECT_EQ(smoother.at(5).x, Eigen::Vector2d(Eigen::Vector2d::Ones()));
}

}  // namespace
}  // namespace flyball
