#include <flyball/estimation/multiple_model.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::multiple_model_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

using Two = ModeProbabilities<2>;
using Scalar = Eigen::Matrix<double, 1, 1>;

DiscreteSystem<2, 1, 1> cart(double dt) {
  DiscreteSystem<2, 1, 1> plant;
  plant.A << 1.0, dt, 0.0, 1.0;
  plant.B << 0.5 * dt * dt, dt;
  plant.C << 1.0, 0.0;
  plant.D << 0.0;
  plant.period = Time(dt);
  return plant;
}

// Bayes: (0.2·3, 0.8·1)/1.4; the likelihoods' common factor e^-1e4 is nothing.
TEST(ModeProbabilities, BayesAndMarkov) {
  auto modes = Two::create({0.4, 1.6}, Eigen::Matrix2d::Identity()).value();
  EXPECT_TRUE(modes.update({std::log(3.0) - 1e4, -1e4}));
  EXPECT_NEAR(modes.probabilities()(0), 3.0 / 7.0, 1e-12);
  EXPECT_EQ(modes.most_likely(), 1);
  const Eigen::Matrix2d Pi{{0.9, 0.1}, {0.3, 0.7}};
  auto chain = Two::create({0.5, 0.5}, Pi).value();
  const Eigen::Matrix2d mixing = chain.predict();
  EXPECT_NEAR(chain.probabilities()(0), 0.6, 1e-15);
  EXPECT_NEAR(mixing(0, 0), 0.75, 1e-15);
  EXPECT_NEAR(mixing(0, 1), 0.125, 1e-15);
  // Without measurements it goes to the chain's own, μ = Πᵀμ: (0.75, 0.25).
  for (int k = 0; k < 100; ++k) {
    chain.predict();
  }
  EXPECT_NEAR(chain.probabilities()(0), 0.75, 1e-12);
}

TEST(ModeProbabilities, StaySomeWhateverComes) {
  Two modes;
  EXPECT_FALSE(modes.update({nan, nan}));
  EXPECT_FALSE(modes.update({-infinity, nan}));
  EXPECT_FALSE(modes.update({infinity, 0.0}));
  EXPECT_EQ(modes.probabilities(), Two::Vector(0.5, 0.5));
  EXPECT_TRUE(modes.update({nan, -3.0}));
  EXPECT_EQ(modes.probabilities(), Two::Vector(0.0, 1.0));
  EXPECT_EQ(modes.predict(), Eigen::Matrix2d(Eigen::Matrix2d::Identity()));
  // Ruled out for good without a floor, back at once with one.
  EXPECT_TRUE(modes.update({0.0, -1e3}));
  EXPECT_EQ(modes.probabilities(), Two::Vector(0.0, 1.0));
  auto floored = Two::create({1.0, 1.0}, Eigen::Matrix2d::Identity(), 1e-3).value();
  floored.update({-1e300, 0.0});
  EXPECT_NEAR(floored.probabilities()(0), 1e-3, 2e-6);
  floored.update({0.0, -20.0});
  EXPECT_GT(floored.probabilities()(0), 0.998);
  Random random(31);
  for (int k = 0; k < 10000; ++k) {
    floored.update({std::pow(10.0, random.uniform(-300.0, 300.0)) * random.normal(),
                    std::pow(10.0, random.uniform(-300.0, 300.0)) * random.normal()});
    ASSERT_NEAR(floored.probabilities().sum(), 1.0, 1e-12);
    ASSERT_GE(floored.probabilities().minCoeff(), 0.99e-3);
  }
}

TEST(ModeProbabilities, Refusals) {
  const Eigen::Matrix2d I = Eigen::Matrix2d::Identity();
  EXPECT_TRUE(Two::create({0.0, 0.0}, I).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(Two::create({-1.0, 2.0}, I).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(Two::create({nan, 2.0}, I).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(Two::create({1.0, 1.0}, I, 0.6).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(
      to_string(Two::create({1.0, 1.0}, Eigen::Matrix2d{{1.0, 0.0}, {0.5, 0.4}}).error()),
      "ModeProbabilities: row 1 of the transition is of sum 0.9; it must be of sum 1: some mode "
      "follows mode i");
  EXPECT_FALSE(Two::create({1.0, 1.0}, Eigen::Matrix2d{{1.5, -0.5}, {0.0, 1.0}}));
}

// N(0, 1) and N(4, 4) with 1/4 and 3/4: mean 3, variance (1 + 9)/4 + 3 (4 + 1)/4 = 6.25.
TEST(MatchMoments, OfTwoNormals) {
  Scalar mean;
  Scalar variance;
  match_moments<1, 2>(Eigen::Vector2d(0.25, 0.75), {Scalar(0.0), Scalar(4.0)},
                      {Scalar(1.0), Scalar(4.0)}, mean, variance);
  EXPECT_DOUBLE_EQ(mean(0), 3.0);
  EXPECT_DOUBLE_EQ(variance(0), 6.25);
}

// With a mode that stays, the probabilities are exact: those of the joint density of all
// measurements, which a dense covariance gives without a filter.
TEST(MultipleModelFilter, OfAModeThatStaysIsBayesOnTheWholeRecord) {
  constexpr int N = 6;
  const auto plant = cart(0.1);
  const double accelerations[] = {0.1, 1.0, 10.0};
  std::array<ModelHypothesis<2, 1, 1>, 3> models{
      {{plant, Eigen::MatrixXd(), Scalar(0.2), Eigen::Matrix2d::Identity()},
       {plant, Eigen::MatrixXd(), Scalar(0.2), Eigen::Matrix2d::Identity()},
       {plant, Eigen::MatrixXd(), Scalar(0.2), Eigen::Matrix2d::Identity()}}};
  for (std::size_t i = 0; i < 3; ++i) {
    models[i].Q = Eigen::MatrixXd(accelerations[i] * plant.B * plant.B.transpose());
  }
  const auto modes =
      ModeProbabilities<3>::create({0.5, 0.3, 0.2}, Eigen::Matrix3d::Identity()).value();
  auto filter = MultipleModelFilter<3, 2, 1, 1>::create(models, modes).value();
  Eigen::Vector<double, N> y;
  y << 0.3, -0.8, 1.9, 0.1, 2.5, 4.0;
  for (int k = 0; k < N; ++k) {
    filter.predict(Scalar(0.0));
    EXPECT_EQ(filter.update(Scalar(y(k)), Scalar(0.0)), UpdateStatus::updated);
  }
  Eigen::Vector3d expected;
  for (std::size_t i = 0; i < 3; ++i) {
    // x_k = Aᵏ x₀ + Σ Aᵏ⁻ʲ w_j.
    Eigen::Matrix<double, N, N> S = 0.2 * Eigen::Matrix<double, N, N>::Identity();
    const auto power = [&](int k) {
      return Eigen::RowVector2d(1.0, 0.1 * k);  // C Aᵏ
    };
    for (int a = 1; a <= N; ++a) {
      for (int b = 1; b <= N; ++b) {
        S(a - 1, b - 1) += power(a).dot(power(b));
        for (int j = 1; j <= std::min(a, b); ++j) {
          S(a - 1, b - 1) += power(a - j) * *models[i].Q.get() * power(b - j).transpose();
        }
      }
    }
    const double exponent = test::squared_distance(S, y);
    const double prior[] = {0.5, 0.3, 0.2};
    expected(static_cast<Eigen::Index>(i)) =
        prior[i] * std::exp(-0.5 * exponent) / std::sqrt(test::determinant(S));
  }
  expected /= expected.sum();
  EXPECT_NEAR((filter.modes().probabilities() - expected).norm(), 0.0, 1e-10);
}

// The algorithm of Bar-Shalom, Li, Kirubarajan (2001), section 11.6.6, in NumPy 1.24.2 with dense
// covariances, P - K S Kᵀ and plain likelihoods, for the models below and y = 1, 3.5, 7.
TEST(MultipleModelFilter, InteractsAsItsAlgorithmInAnotherTool) {
  auto plant = cart(0.5);
  const Eigen::Matrix2d P0 = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  const std::array<ModelHypothesis<2, 1, 1>, 2> models{
      {{plant, Eigen::Matrix2d(Eigen::Vector2d(0.01, 0.02).asDiagonal()), Scalar(1.0), P0},
       {plant, Eigen::Matrix2d(Eigen::Vector2d(0.5, 3.0).asDiagonal()), Scalar(2.0), P0}}};
  const auto modes = Two::create({0.6, 0.4}, Eigen::Matrix2d{{0.9, 0.1}, {0.25, 0.75}}).value();
  auto filter = MultipleModelFilter<2, 2, 1, 1>::create(models, modes).value();
  for (const double y : {1.0, 3.5, 7.0}) {
    EXPECT_TRUE(filter.predict(Scalar(0.0)));
    EXPECT_EQ(filter.update(Scalar(y), Scalar(0.0)), UpdateStatus::updated);
  }
  EXPECT_NEAR(filter.modes().probabilities()(0), 0.287790720974109, 1e-12);
  EXPECT_NEAR((filter.x_hat() - Eigen::Vector2d(5.462674441842235, 3.3604188809715265)).norm(), 0.0,
              1e-12);
  EXPECT_NEAR((filter.P() - Eigen::Matrix2d{{1.082566243822264, 0.9753057386041399},
                                            {0.9753057386041399, 4.702600221939068}})
                  .norm(),
              0.0, 1e-12);
}

// A mechanism whose motor dies at 4 s and comes back at 8 s (section 9.10's failed engine): the
// right model is found within 0.8 s of each change, and the estimate is better than that of either
// filter alone.
TEST(MultipleModelFilter, FindsAMotorThatFails) {
  const auto works = cart(0.02);
  auto fails = works;
  fails.B.setZero();
  const Eigen::Matrix2d Q = Eigen::Vector2d(1e-8, 1e-4).asDiagonal();
  const Scalar R(1e-4);
  const Eigen::Matrix2d P0 = Eigen::Matrix2d::Identity();
  const std::array<ModelHypothesis<2, 1, 1>, 2> models{{{works, Q, R, P0}, {fails, Q, R, P0}}};
  const auto modes =
      Two::create({0.5, 0.5}, Eigen::Matrix2d{{0.995, 0.005}, {0.005, 0.995}}).value();
  auto filter = MultipleModelFilter<2, 2, 1, 1>::create(models, modes).value();
  auto alone =
      std::array{kalman_filter(works, Q, R, P0).value(), kalman_filter(fails, Q, R, P0).value()};
  Random random(32);
  Eigen::Vector2d x(0.0, 0.0);
  double error = 0.0;
  double errors_alone[] = {0.0, 0.0};
  int wrong = 0;
  for (int k = 0; k < 600; ++k) {
    const bool working = k < 200 || k >= 400;
    const Scalar u(3.0 * std::sin(0.05 * k));
    x = works.A * x + (working ? works.B : fails.B) * u +
        Eigen::Vector2d(random.normal(0.0, 1e-4), random.normal(0.0, 1e-2));
    const Scalar y(x(0) + random.normal(0.0, 1e-2));
    filter.predict(u);
    filter.update(y, u);
    for (std::size_t i = 0; i < 2; ++i) {
      alone[i].predict(u);
      alone[i].update(y, u);
      errors_alone[i] += std::pow(alone[i].x_hat()(1) - x(1), 2);
    }
    error += std::pow(filter.x_hat()(1) - x(1), 2);
    const bool settled = (k > 40 && k < 200) || (k >= 240 && k < 400) || k >= 440;
    wrong += settled && filter.modes().most_likely() != (working ? 0 : 1) ? 1 : 0;
  }
  // Where the sine is near zero the two models say the same, and neither can be told.
  EXPECT_LE(wrong, 50);
  EXPECT_LT(error, 0.5 * errors_alone[0]);
  EXPECT_LT(error, 0.5 * errors_alone[1]);
}

TEST(MultipleModelFilter, IsFiniteWhateverComesAndAllocatesNothing) {
  const auto plant = cart(0.02);
  const Eigen::Matrix2d Q = 1e-4 * Eigen::Matrix2d::Identity();
  const std::array<ModelHypothesis<2, 1, 1>, 2> models{
      {{plant, Q, Scalar(0.1), Eigen::Matrix2d::Identity()},
       {plant, 1e4 * Q, Scalar(0.1), Eigen::Matrix2d::Identity()}}};
  const auto modes = Two::create({0.5, 0.5}, Eigen::Matrix2d{{0.9, 0.1}, {0.1, 0.9}}, 1e-6).value();
  auto filter = MultipleModelFilter<2, 2, 1, 1>::create(models, modes).value();
  const test::AllocationCounter allocations;
  const double values[] = {0.0, 1.0, nan, infinity, -1e90, 1e300, -infinity, 5.0};
  for (int k = 0; k < 2000; ++k) {
    filter.predict(Scalar(values[k % 8]));
    const auto status = filter.update(Scalar(values[(k / 8) % 8]), Scalar(0.0));
    const double y = values[(k / 8) % 8];
    ASSERT_EQ(status == UpdateStatus::updated, std::abs(y) <= 1e100) << k;
    ASSERT_TRUE(filter.x_hat().allFinite());
    ASSERT_TRUE(filter.P().allFinite());
    ASSERT_NEAR(filter.modes().probabilities().sum(), 1.0, 1e-12);
  }
  EXPECT_EQ(allocations.count(), 0u);
  EXPECT_TRUE(filter.reset(Eigen::Vector2d(1.0, 2.0), Eigen::Matrix2d::Identity()));
  EXPECT_EQ(filter.x_hat(), Eigen::Vector2d(1.0, 2.0));
  EXPECT_FALSE(filter.reset(Eigen::Vector2d(nan, 2.0), Eigen::Matrix2d::Identity()));
  EXPECT_EQ(filter.x_hat(), Eigen::Vector2d(1.0, 2.0));
}

TEST(MultipleModelFilter, DynamicSizesAreTheSameAndMustAgree) {
  const auto fixed_plant = cart(0.1);
  const DiscreteSystem<> plant{fixed_plant.A, fixed_plant.B, fixed_plant.C, fixed_plant.D,
                               fixed_plant.period};
  const Eigen::Matrix2d I = Eigen::Matrix2d::Identity();
  const auto modes = Two::create({0.6, 0.4}, Eigen::Matrix2d{{0.9, 0.1}, {0.25, 0.75}}).value();
  const std::array<ModelHypothesis<2, 1, 1>, 2> fixed{
      {{fixed_plant, I, Scalar(1.0), I}, {fixed_plant, 0.1 * I, Scalar(1.0), I}}};
  using Dynamic = ModelHypothesis<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;
  std::array<Dynamic, 2> dynamic{
      {Dynamic{plant, I, Scalar(1.0), I}, Dynamic{plant, 0.1 * I, Scalar(1.0), I}}};
  auto one = MultipleModelFilter<2, 2, 1, 1>::create(fixed, modes).value();
  auto other = MultipleModelFilter<2>::create(dynamic, modes).value();
  for (const double y : {1.0, -2.0, 0.5}) {
    one.predict(Scalar(1.0));
    other.predict(Scalar(1.0));
    one.update(Scalar(y), Scalar(1.0));
    other.update(Scalar(y), Scalar(1.0));
  }
  EXPECT_NEAR((one.x_hat() - other.x_hat()).norm(), 0.0, 1e-14);
  EXPECT_NEAR((one.P() - other.P()).norm(), 0.0, 1e-14);
  dynamic[1].plant.A = Eigen::MatrixXd::Identity(1, 1);
  const auto refused = MultipleModelFilter<2>::create(dynamic, modes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where().substr(0, 28), "MultipleModelFilter: model 1");
  dynamic[1] = Dynamic{{Eigen::MatrixXd::Identity(1, 1), Eigen::MatrixXd::Ones(1, 1),
                        Eigen::MatrixXd::Ones(1, 1), Eigen::MatrixXd::Zero(1, 1), Time(0.1)},
                       Scalar(1.0),
                       Scalar(1.0),
                       Scalar(1.0)};
  EXPECT_TRUE(
      MultipleModelFilter<2>::create(dynamic, modes).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::multiple_model_test
