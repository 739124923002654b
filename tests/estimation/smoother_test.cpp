#include <flyball/estimation/smoother.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/probability/gaussian_vector.hpp>

#include "estimation/smoother_cases.hpp"

namespace flyball::smoother_test {
namespace {

using namespace flyball::test;

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
  // The deviation 1e250 has no square; a measurement brings it back.
  steps[0].A(0) = 1e200;
  EXPECT_NEAR(smooth(VectorXd::Ones(1), 1e100 * one, steps)->x_filtered(1), 0.0, 1e-12);
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

// x⁺ = x + 0.1 sin x + w, y = x + x³/10 + v: what an extended filter leaves of 300 records,
// smoothed, errs less in the middle of the record, and as much as it says (NEES of one state: χ²
// with 300 degrees of freedom, between 250 and 355 with 98 %; the linearisation may add some).
TEST(Smoother, OfAnExtendedFiltersHistory) {
  Random random(17);
  constexpr double q = 0.02;
  constexpr double r = 0.1;
  double filter_error = 0.0;
  double smoother_error = 0.0;
  double nees = 0.0;
  for (int record = 0; record < 300; ++record) {
    double truth = random.normal(1.0, 0.3);
    double x = 1.0;
    double P = 0.09;
    std::vector<FilterStep<>> history;
    std::vector<double> truths{truth};
    for (int k = 0; k < 20; ++k) {
      const auto scalar = [](double value) { return MatrixXd::Constant(1, 1, value); };
      truth += 0.1 * std::sin(truth) + random.normal(0.0, std::sqrt(q));
      truths.push_back(truth);
      const double y = truth + 0.1 * std::pow(truth, 3) + random.normal(0.0, std::sqrt(r));
      const double F = 1.0 + 0.1 * std::cos(x);
      const double prior = x + 0.1 * std::sin(x);
      P = F * P * F + q;
      const double H = 1.0 + 0.3 * prior * prior;
      const double K = P * H / (H * P * H + r);
      x = prior + K * (y - prior - 0.1 * std::pow(prior, 3));
      P = (1.0 - K * H) * P * (1.0 - K * H) + K * r * K;
      history.push_back(
          {scalar(F), scalar(q), VectorXd(scalar(prior)), VectorXd(scalar(x)), scalar(P)});
    }
    const auto path = smooth(VectorXd::Ones(1), MatrixXd::Constant(1, 1, 0.09), history).value();
    filter_error += std::pow(history[9].x(0) - truths[10], 2);
    smoother_error += std::pow(path.x(10) - truths[10], 2);
    nees += std::pow(path.x(10) - truths[10], 2) / path.P[10](0);
  }
  EXPECT_LT(smoother_error, 0.8 * filter_error);
  EXPECT_GT(nees, 250.0);
  EXPECT_LT(nees, 400.0);
}

}  // namespace
}  // namespace flyball::smoother_test
