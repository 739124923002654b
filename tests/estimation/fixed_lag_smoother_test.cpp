#include <flyball/estimation/fixed_lag_smoother.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/estimation/extended.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/geometry/se2.hpp>

#include "estimation/smoother_cases.hpp"
#include "support/allocation_count.hpp"

namespace flyball::fixed_lag_smoother_test {
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

/// A drive that turns while it sees where it is but not whither, every fifth step: what it did, and
/// what a filter made of it.
struct PoseRun {
  std::vector<Pose2d> truth;
  std::vector<FilterStepOf<Pose2d>> steps;
  Pose2d start;
  Eigen::Matrix3d P0;
};
PoseRun pose_run(Random& random, const Pose2d& origin, int count) {
  const auto noise = [&](const Eigen::Vector3d& std) {
    return Eigen::Vector3d(std(0) * random.normal(), std(1) * random.normal(),
                           std(2) * random.normal());
  };
  const Eigen::Vector3d start_std(0.1, 0.1, 0.4);
  const Eigen::Vector3d step_std(0.02, 0.005, 0.03);
  PoseRun run;
  run.P0 = start_std.cwiseAbs2().asDiagonal();
  run.start = origin;
  Pose2d pose = origin.plus(noise(start_std));
  run.truth.push_back(pose);
  auto estimate = Estimate<Pose2d>::create(run.start, Covariance(run.P0)).value();
  const Eigen::Matrix3d Q = step_std.cwiseAbs2().asDiagonal();
  const auto R = MeasurementNoise<2>::independent({0.0025, 0.0025});
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d twist(0.2, 0.0, 0.15 * std::sin(0.2 * k));
    pose = pose.plus(twist).plus(noise(step_std));
    run.truth.push_back(pose);
    FilterStepOf<Pose2d> step;
    step.Q = Q;
    const auto move = [&](const auto& x) {
      using T = typename std::remove_cvref_t<decltype(x)>::Scalar;
      return x.plus(twist.cast<T>());
    };
    Extended().predict(estimate, move, PlainNoise<3>(Q), &step.F);
    step.x_prior = estimate.x_hat();
    if (k % 5 == 4) {
      // In the frame of the start, so that the run is the same from any origin.
      const Eigen::Vector2d seen = origin.inverse() * pose.translation() +
                                   0.05 * Eigen::Vector2d(random.normal(), random.normal());
      const auto there = [&](const auto& x) {
        using T = typename std::remove_cvref_t<decltype(x)>::Scalar;
        return Eigen::Matrix<T, 2, 1>(origin.inverse().template cast<T>() * x.translation());
      };
      Extended().correct(estimate, seen, there, R);
    }
    step.x = estimate.x_hat();
    step.P = estimate.P();
    run.steps.push_back(step);
  }
  return run;
}

// Of poses: the error 20 steps ago is what P says (the normalised square of 400 runs within the
// 99.9 % bounds of its mean), and its square less than 0.6 of the filter's; from another origin the
// smoothed poses are moved with it, and P, in their frames, is the same.
TEST(FixedLagSmoother, OfPoses) {
  const Pose2d elsewhere(Eigen::Vector2d(30.0, -20.0), SO2<double>(2.5));
  double nees = 0.0;
  double smoothed = 0.0;
  double filtered = 0.0;
  constexpr int runs = 400;
  for (int i = 0; i < runs; ++i) {
    Random random(static_cast<std::uint64_t>(1000 + i));
    const PoseRun run = pose_run(random, Pose2d(), 40);
    Random again(static_cast<std::uint64_t>(1000 + i));
    const PoseRun moved = pose_run(again, elsewhere, 40);
    ManifoldFixedLagSmoother<Pose2d, 20> smoother(run.start, run.P0);
    ManifoldFixedLagSmoother<Pose2d, 20> other(moved.start, moved.P0);
    for (std::size_t k = 0; k < run.steps.size(); ++k) {
      ASSERT_TRUE(smoother.take(run.steps[k]));
      ASSERT_TRUE(other.take(moved.steps[k]));
    }
    const auto at = smoother.at(20);
    const Eigen::Vector3d off = run.truth[20].minus(at.x);
    nees += off.dot(at.P.inverse() * off) / runs;
    smoothed += off.squaredNorm();
    filtered += run.truth[20].minus(run.steps[19].x).squaredNorm();
    const auto there = other.at(20);
    EXPECT_LT((elsewhere * at.x).minus(there.x).norm(), 1e-9);
    EXPECT_LT((at.P - there.P).norm(), 1e-9);
    EXPECT_EQ(smoother.at(0).x.minus(run.steps.back().x).norm(), 0.0);
  }
  EXPECT_NEAR(nees, 3.0, 3.3 * std::sqrt(6.0 / runs));
  EXPECT_LT(smoothed, 0.6 * filtered);
  // What is no pose is not taken.
  ManifoldFixedLagSmoother<Pose2d, 2> smoother(Pose2d(), Eigen::Matrix3d::Identity());
  FilterStepOf<Pose2d> step{Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), Pose2d(),
                            Pose2d(), Eigen::Matrix3d::Identity()};
  step.F(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(smoother.take(step));
  EXPECT_EQ(smoother.available(), 0);
}

// A motion u without noise ties two poses together: what is known of the one is known of the other,
// x u⁻¹ and Ad(u) P Ad(u)ᵀ in its frame, however far the measurement moved it.
TEST(FixedLagSmoother, APoseBehindAKnownMotion) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const auto any = [&](double size) {
      return Eigen::Vector3d(size * random.normal(), size * random.normal(),
                             size * random.normal());
    };
    const auto spread = [&] {
      const Eigen::Matrix3d S = Eigen::Matrix3d::NullaryExpr([&] { return random.normal(); });
      return Eigen::Matrix3d(S * S.transpose() + 0.1 * Eigen::Matrix3d::Identity());
    };
    const Pose2d x0 = Pose2d::exp(any(1.0));
    const Pose2d u = Pose2d::exp(any(0.7));
    const Eigen::Matrix3d P = spread();
    const Pose2d x = (x0 * u).plus(any(0.6));
    ManifoldFixedLagSmoother<Pose2d, 3> smoother(x0, spread());
    ASSERT_TRUE(smoother.take({u.inverse().adjoint(), Eigen::Matrix3d::Zero(), x0 * u, x, P}));
    const auto at = smoother.at(1);
    EXPECT_LT(at.x.minus(x * u.inverse()).norm(), 1e-11);
    EXPECT_LT((at.P - u.adjoint() * P * u.adjoint().transpose()).norm(), 1e-9 * P.norm());
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
}  // namespace flyball::fixed_lag_smoother_test
