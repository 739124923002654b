#include <flyball/math/probability/gaussian_vector.hpp>

#include <array>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/math/probability/density.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "support/oracle.hpp"

namespace flyball::gaussian_vector_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  MatrixXd M(rows, columns);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  return M;
}

GaussianVector random_vector(Random& random, Index n, Index rank) {
  const MatrixXd F = random_matrix(random, n, rank);
  return GaussianVector::create(random_matrix(random, n, 1), F * F.transpose()).value();
}

GaussianVector scalar(double mean, double variance) {
  return GaussianVector::create(VectorXd::Constant(1, mean), MatrixXd::Constant(1, 1, variance))
      .value();
}

TEST(GaussianVector, DensityIsTheFormulas) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Index n = 1 + trial % 5;
    const auto x = random_vector(random, n, n);
    const VectorXd at = random_matrix(random, n, 1);
    const VectorXd e = at - x.mean();
    const double distance = test::squared_distance(x.covariance(), e);
    EXPECT_EQ(x.rank(), n);
    EXPECT_NEAR(x.squared_distance(at).value() / distance, 1.0, 1e-8);
    const double log_density =
        -0.5 * (distance + std::log(test::determinant(2.0 * M_PI * x.covariance())));
    EXPECT_NEAR(x.log_density(at).value(), log_density, 1e-8 * (1.0 + distance));
  }
  // In units apart by 1e40, where the determinant is beyond doubles.
  VectorXd sigma(2);
  sigma << 1e-200, 1e160;
  const auto wide =
      GaussianVector::create(VectorXd::Zero(2), MatrixXd((sigma.cwiseAbs2()).asDiagonal()));
  EXPECT_FALSE(wide->rank() == 2);  // 1e-400 is no variance of a double.
  sigma << 1e-100, 1e150;
  const auto fits =
      GaussianVector::create(VectorXd::Zero(2), MatrixXd((sigma.cwiseAbs2()).asDiagonal())).value();
  EXPECT_NEAR(fits.log_density(sigma).value(),
              normal_log_pdf(1.0) * 2.0 - std::log(1e-100) - std::log(1e150), 1e-9);
}

TEST(GaussianVector, SamplesHaveItsMomentsAndFillItsGates) {
  Random random(2);
  const auto x = random_vector(random, 3, 3);
  constexpr int count = 40000;
  const MatrixXd drawn = x.samples(count, 7).value();
  const auto data = sample_moments(drawn).value();
  // Four standard deviations of a mean and of a covariance from data.
  const VectorXd sigma = x.covariance().diagonal().cwiseSqrt();
  for (Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(data.mean(i), x.mean()(i), 4.0 * sigma(i) / std::sqrt(count));
    for (Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(data.covariance(i, j), x.covariance()(i, j),
                  4.0 * std::sqrt(2.0 / count) * sigma(i) * sigma(j));
    }
  }
  int inside = 0;
  for (Index k = 0; k < count; ++k) {
    inside += x.squared_distance(drawn.col(k)).value() <= chi_squared_quantile(0.9, 3.0) ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(inside) / count, 0.9, 4.0 * std::sqrt(0.09 / count));
  EXPECT_EQ(x.samples(5, 7).value(), drawn.leftCols(5));
  EXPECT_EQ(x.samples(0, 7)->cols(), 0);
  EXPECT_TRUE(x.samples(-1, 7).error().is(ArgumentError::out_of_range));
}

// Section 9.3.15: z = Ax + By has the mean Ax̄ + Bȳ and the covariance AΣxAᵀ + BΣyBᵀ.
TEST(GaussianVector, MapsAndSums) {
  Random random(3);
  const auto x = random_vector(random, 3, 3);
  const auto y = random_vector(random, 2, 2);
  const MatrixXd A = random_matrix(random, 4, 3);
  const MatrixXd B = random_matrix(random, 4, 2);
  const auto z = x.mapped(A)->plus(y.mapped(B, VectorXd::Ones(4)).value()).value();
  EXPECT_NEAR((z.mean() - A * x.mean() - B * y.mean() - VectorXd::Ones(4)).norm(), 0.0, 1e-14);
  const MatrixXd expected = A * x.covariance() * A.transpose() + B * y.covariance() * B.transpose();
  EXPECT_NEAR((z.covariance() - expected).norm(), 0.0, 1e-13 * expected.norm());
  EXPECT_EQ(x.mapped(A)->rank(), 3);  // four entries of three random numbers
  EXPECT_TRUE(x.mapped(B).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(x.mapped(A, VectorXd::Ones(3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(x.plus(y).error().is(ArgumentError::wrong_shape));
}

TEST(GaussianVector, MarginalsAndConditionalsMultiplyToTheJointDensity) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const auto x = random_vector(random, 4, 4);
    const VectorXd at = random_matrix(random, 4, 1);
    const std::array<Index, 2> known{3, 1};
    const std::array<Index, 2> rest{0, 2};
    const Eigen::Vector2d values(at(3), at(1));
    const auto given = x.conditional(known, values).value();
    // p(x) = p(x_a | x_b) p(x_b): Bayes's rule (section 9.3.10).
    const double product =
        given.estimate.marginal(rest)->log_density(Eigen::Vector2d(at(0), at(2))).value() +
        x.marginal(known)->log_density(values).value();
    const double joint = x.log_density(at).value();
    EXPECT_NEAR(product, joint, 1e-9 * (1.0 + std::abs(joint)));
    EXPECT_NEAR(given.log_evidence, x.marginal(known)->log_density(values).value(),
                1e-9 * (1.0 + std::abs(joint)));
    EXPECT_EQ(given.estimate.mean()(3), at(3));
    EXPECT_EQ(given.estimate.covariance()(1, 1), 0.0);
    const MatrixXd S = x.covariance();
    const Eigen::Matrix2d bb{{S(3, 3), S(3, 1)}, {S(1, 3), S(1, 1)}};
    const Eigen::RowVector2d ab(S(0, 3), S(0, 1));
    EXPECT_NEAR(given.estimate.covariance()(0, 0),
                S(0, 0) - test::squared_distance(bb, ab.transpose()), 1e-9 * S(0, 0));
  }
}

// Equations 9.11, 9.12: x₀ = 2 ± 2 and z = 5 ± 1: μ = (4·5 + 1·2)/5 = 4.4, σ² = 4/5; and 9.14 to
// 9.17, where one of them knows nothing or all.
TEST(GaussianVector, FusesTwoSensors) {
  const auto fused = fuse(scalar(2.0, 4.0), scalar(5.0, 1.0)).value();
  EXPECT_NEAR(fused.estimate.mean()(0), 4.4, 1e-15);
  EXPECT_NEAR(fused.estimate.covariance()(0, 0), 0.8, 1e-15);
  EXPECT_NEAR(fused.log_evidence, normal_log_pdf(5.0, 2.0, std::sqrt(5.0)), 1e-14);
  EXPECT_NEAR(fused.squared_distance, 9.0 / 5.0, 1e-14);
  EXPECT_NEAR(fuse(scalar(2.0, 1e20), scalar(5.0, 1.0))->estimate.mean()(0), 5.0, 1e-15);
  EXPECT_EQ(fuse(scalar(2.0, 0.0), scalar(5.0, 1.0))->estimate.mean()(0), 2.0);
  EXPECT_EQ(fuse(scalar(2.0, 1.0), scalar(5.0, 0.0))->estimate.covariance()(0, 0), 0.0);
  // The normal density by quadrature says the same: p(x) ∝ p_a(x) p_b(x).
  const double C = std::exp(fused.log_evidence);
  const auto p = [&](double x) { return normal_pdf(x, 2.0, 2.0) * normal_pdf(x, 5.0, 1.0) / C; };
  const auto numbers = moments(p, {-10.0, 15.0}).value();
  EXPECT_NEAR(numbers.mean, 4.4, 1e-9);
  EXPECT_NEAR(numbers.variance, 0.8, 1e-9);
}

// Information adds: Σ⁻¹ = Σ_a⁻¹ + Σ_b⁻¹, Σ⁻¹x̂ = Σ_a⁻¹x̄_a + Σ_b⁻¹x̄_b; the order does not matter.
TEST(GaussianVector, FusionAddsInformation) {
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const auto a = random_vector(random, 3, 3);
    const auto b = random_vector(random, 3, 3);
    const auto ab = fuse(a, b).value();
    const auto ba = fuse(b, a).value();
    const MatrixXd I_a = test::inverse(MatrixXd(a.covariance()));
    const MatrixXd I_b = test::inverse(MatrixXd(b.covariance()));
    const MatrixXd expected = test::inverse(MatrixXd(I_a + I_b));
    EXPECT_NEAR((ab.estimate.covariance() - expected).norm() / expected.norm(), 0.0, 1e-7);
    EXPECT_NEAR((ab.estimate.mean() - expected * (I_a * a.mean() + I_b * b.mean())).norm(), 0.0,
                1e-7 * (1.0 + ab.estimate.mean().norm()));
    EXPECT_NEAR((ab.estimate.mean() - ba.estimate.mean()).norm(), 0.0,
                1e-10 * (1.0 + ab.estimate.mean().norm()));
    EXPECT_NEAR(ab.log_evidence, ba.log_evidence, 1e-9 * (1.0 + std::abs(ab.log_evidence)));
  }
}

TEST(GaussianVector, AMeasurementIsTheConditionalOfTheJointVector) {
  Random random(6);
  const auto x = random_vector(random, 3, 3);
  const MatrixXd C = random_matrix(random, 2, 3);
  const MatrixXd R = Eigen::Matrix2d{{2.0, 0.5}, {0.5, 1.0}};
  const VectorXd y = random_matrix(random, 2, 1);
  MatrixXd joint(5, 5);
  joint << x.covariance(), x.covariance() * C.transpose(), C * x.covariance(),
      C * x.covariance() * C.transpose() + R;
  VectorXd mean(5);
  mean << x.mean(), C * x.mean();
  const std::array<Index, 2> measured{3, 4};
  const auto direct = x.measured(C, R, y).value();
  const auto by_joint = GaussianVector::create(mean, joint)->conditional(measured, y).value();
  EXPECT_NEAR((direct.estimate.mean() - by_joint.estimate.mean().head(3)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(
      (direct.estimate.covariance() - by_joint.estimate.covariance().topLeftCorner(3, 3)).norm(),
      0.0, 1e-12 * x.covariance().norm());
  EXPECT_NEAR(direct.log_evidence, by_joint.log_evidence, 1e-11);
}

// x₂ = 2 x₁ for certain: Σ = [1 2; 2 4]; the certain direction is (2, -1)/√5.
TEST(GaussianVector, CertainDirectionsAreNotInverted) {
  const auto line =
      GaussianVector::create(Eigen::Vector2d(1.0, 2.0), Eigen::Matrix2d{{1.0, 2.0}, {2.0, 4.0}})
          .value();
  EXPECT_EQ(line.rank(), 1);
  EXPECT_NEAR(line.squared_distance(Eigen::Vector2d(3.0, 6.0)).value(), 4.0, 1e-12);
  const auto off = line.squared_distance(Eigen::Vector2d(3.0, 6.1));
  ASSERT_FALSE(off);
  EXPECT_TRUE(off.error().is(GaussianError::contradiction));
  const auto density = line.log_density(Eigen::Vector2d(3.0, 6.0));
  ASSERT_FALSE(density);
  EXPECT_TRUE(density.error().is(GaussianError::no_density));
  const auto direction = density.error().evidence().front().values;
  EXPECT_NEAR(direction[0] / direction[1], -2.0, 1e-12);
  // Knowing x₁ is knowing x₂; a second look at the same thing without noise says nothing new.
  const std::array<Index, 1> first{0};
  const auto known = line.conditional(first, VectorXd::Constant(1, 4.0)).value();
  EXPECT_NEAR(known.estimate.mean()(1), 8.0, 1e-12);
  EXPECT_NEAR(known.estimate.covariance().norm(), 0.0, 1e-14);
  const MatrixXd twice = Eigen::Matrix2d{{1.0, 0.0}, {1.0, 0.0}};
  const auto seen = line.measured(twice, MatrixXd::Zero(2, 2), Eigen::Vector2d(4.0, 4.0)).value();
  EXPECT_EQ(seen.rank, 1);
  EXPECT_NEAR(seen.log_evidence, normal_log_pdf(4.0, 1.0, 1.0), 1e-12);
  const auto contradicted = line.measured(twice, MatrixXd::Zero(2, 2), Eigen::Vector2d(4.0, 4.5));
  EXPECT_TRUE(contradicted.error().is(GaussianError::contradiction));
  EXPECT_TRUE(fuse(scalar(1.0, 0.0), scalar(2.0, 0.0)).error().is(GaussianError::contradiction));
  EXPECT_TRUE(fuse(scalar(1.0, 0.0), scalar(1.0, 0.0)));
}

// Seen once without noise, a coordinate or any other direction is known: to see the same again
// changes nothing, although rounding leaves something of its variance.
TEST(GaussianVector, WhatIsKnownIsNotLearntAgain) {
  Random random(8);
  for (int trial = 0; trial < 60; ++trial) {
    const Index n = 2 + trial % 3;
    const auto x = random_vector(random, n, n);
    const MatrixXd C =
        trial % 2 == 0 ? MatrixXd(MatrixXd::Identity(1, n)) : MatrixXd(random_matrix(random, 1, n));
    const MatrixXd R = MatrixXd::Zero(1, 1);
    const VectorXd y = random_matrix(random, 1, 1);
    const auto once = x.measured(C, R, y).value();
    const auto again = once.estimate.measured(C, R, y);
    ASSERT_TRUE(again) << to_string(again.error());
    EXPECT_EQ(again->rank, 0);
    EXPECT_EQ(again->estimate.mean(), once.estimate.mean()) << trial;
    EXPECT_NEAR((again->estimate.covariance() - once.estimate.covariance()).norm(), 0.0,
                1e-13 * x.covariance().norm());
    EXPECT_TRUE(
        once.estimate.measured(C, R, y.array() + 1e-3).error().is(GaussianError::contradiction));
  }
}

// Squares of the deviations overflow long before they do.
TEST(GaussianVector, HugeNumbers) {
  const auto far = scalar(1e308, 1e308);
  EXPECT_NEAR(far.measured(MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1) * 1e308,
                           VectorXd::Constant(1, 0.9e308))
                      ->estimate.mean()(0) /
                  0.95e308,
              1.0, 1e-12);
  EXPECT_TRUE(
      far.measured(MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 1), VectorXd::Constant(1, -1e308))
          .error()
          .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      far.squared_distance(VectorXd::Constant(1, -1e308)).error().is(ArgumentError::out_of_range));
}

TEST(GaussianVector, Refusals) {
  const auto bad =
      GaussianVector::create(Eigen::Vector2d(0.0, 0.0), Eigen::Matrix2d{{1.0, 2.0}, {2.0, 1.0}});
  ASSERT_FALSE(bad);
  EXPECT_TRUE(bad.error().is(ArgumentError::not_positive));
  // The direction is (1, -1)/√2, its variance 1 - 2.
  EXPECT_NEAR(bad.error().evidence()[0].values[0], -1.0, 1e-12);
  EXPECT_NEAR(bad.error().evidence()[1].values[0] / bad.error().evidence()[1].values[1], -1.0,
              1e-12);
  EXPECT_TRUE(GaussianVector::create(VectorXd(), MatrixXd()).error().is(ArgumentError::empty));
  EXPECT_TRUE(GaussianVector::create(Eigen::Vector2d(0.0, 0.0), MatrixXd::Identity(3, 3))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(GaussianVector::create(Eigen::Vector2d(0.0, std::nan("")), MatrixXd::Identity(2, 2))
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_FALSE(
      GaussianVector::create(Eigen::Vector2d(0.0, 0.0), Eigen::Matrix2d{{0.0, 0.1}, {0.1, 1.0}}));
  const auto x =
      GaussianVector::create(Eigen::Vector2d(0.0, 0.0), MatrixXd::Identity(2, 2)).value();
  const std::array<Index, 2> twice{1, 1};
  EXPECT_TRUE(x.marginal(twice).error().is(ArgumentError::out_of_range));
  const std::array<Index, 1> beyond{2};
  EXPECT_TRUE(x.marginal(beyond).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(x.marginal({}).error().is(ArgumentError::empty));
  EXPECT_FALSE(
      x.measured(MatrixXd::Identity(2, 2), -MatrixXd::Identity(2, 2), Eigen::Vector2d(0.0, 0.0)));
  EXPECT_EQ(x.measured(MatrixXd(0, 2), MatrixXd(0, 0), VectorXd())->estimate.covariance(),
            MatrixXd(MatrixXd::Identity(2, 2)));
}

}  // namespace
}  // namespace flyball::gaussian_vector_test
