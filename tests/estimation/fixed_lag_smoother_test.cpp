#include <flyball/estimation/fixed_lag_smoother.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/estimation/kalman_filter.hpp>

#include "estimation/smoother_cases.hpp"
#include "support/allocation_count.hpp"

namespace flyball {
namespace {

using namespace flyball::test;

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

// Beside a Kalman filter, as on the robot, against the smoother of the record.
TEST(FixedLagSmoother, BesideAKalmanFilter) {
  const Eigen::Matrix2d Q{{1e-6, 0.0}, {0.0, 1e-3}};
  const Eigen::Matrix<double, 1, 1> R(1e-2);
  const DiscreteSystem<2, 1, 1> plant{Eigen::Matrix2d{{1.0, 0.02}, {0.0, 0.95}},
                                      Eigen::Vector2d(2e-4, 0.02), Eigen::RowVector2d(1.0, 0.0),
                                      Eigen::Matrix<double, 1, 1>(0.1), Time(0.02)};
  const Eigen::Matrix2d P0 = Eigen::Matrix2d::Identity();
  auto filter = kalman_filter(plant, Q, R, P0).value();
  FixedLagSmoother<2, 20> smoother(Eigen::Vector2d::Zero(), P0);
  Random random(19);
  const MatrixXd inputs = normals(random, 1, 30);
  const MatrixXd outputs = normals(random, 1, 30);
  for (Index k = 0; k < 30; ++k) {
    const Eigen::Matrix<double, 1, 1> u(inputs(k));
    filter.predict(u);
    const Eigen::Vector2d x_prior = filter.x_hat();
    filter.update(Eigen::Matrix<double, 1, 1>(outputs(k)), u);
    ASSERT_TRUE(smoother.take({plant.A, Q, x_prior, filter.x_hat(), filter.P()}));
  }
  const auto record = smooth(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, plant.period}, Q,
                             R, Eigen::Vector2d::Zero(), P0, inputs, outputs)
                          .value();
  EXPECT_NEAR((filter.x_hat() - record.x_filtered.col(30)).norm(), 0.0, 1e-12);
  for (int lag = 0; lag <= 20; ++lag) {
    EXPECT_NEAR((smoother.at(lag).x - record.smoothed.x.col(30 - lag)).norm(), 0.0, 1e-9);
    EXPECT_NEAR((smoother.at(lag).P - record.smoothed.P[static_cast<std::size_t>(30 - lag)]).norm(),
                0.0, 1e-10);
  }
}

TEST(FixedLagSmoother, DynamicSizesAreTheSame) {
  Random random(18);
  const Problem problem = random_problem(random, 3, 6, 3);
  FixedLagSmoother<3, 4> fixed_size(problem.x0, problem.P0);
  FixedLagSmoother<Eigen::Dynamic, 4> dynamic(problem.x0, problem.P0);
  for (const LinearStep& of : problem.steps) {
    const FilterStep<> step{of.A, of.Q, normals(random, 3, 1), normals(random, 3, 1),
                            covariance(random, 3, 3)};
    EXPECT_TRUE(fixed_size.take(fixed<3>(step)));
    EXPECT_TRUE(dynamic.take(step));
    for (int lag = 0; lag <= dynamic.available(); ++lag) {
      const double size = 1.0 + dynamic.at(lag).P.norm();
      EXPECT_NEAR((fixed_size.at(lag).x - dynamic.at(lag).x).norm(), 0.0, 1e-12 * size);
      EXPECT_NEAR((fixed_size.at(lag).P - dynamic.at(lag).P).norm(), 0.0, 1e-12 * size);
    }
  }
}

TEST(FixedLagSmoother, StartsFromNumbers) {
  using Smoother = FixedLagSmoother<2, 3>;
  const Eigen::Vector2d nowhere =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  const Eigen::Matrix2d P = Eigen::Matrix2d::Identity();
  Smoother smoother(nowhere, P);
  EXPECT_EQ(smoother.at(0).x, Eigen::Vector2d::Zero());
  EXPECT_TRUE(smoother.reset(Eigen::Vector2d(1.0, 2.0), P));
  EXPECT_FALSE(smoother.reset(nowhere, P));
  EXPECT_FALSE(smoother.reset(Eigen::Vector2d::Zero(),
                              Eigen::Matrix2d::Constant(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(smoother.at(0).x, Eigen::Vector2d(1.0, 2.0));
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
