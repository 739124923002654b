#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.tpp>

// The covariance of the Kalman filter, which is symmetric and positive semidefinite whatever P0, Q
// and R are to each other.
namespace flyball::kalman_covariance_test {
namespace {

using Scalar = Eigen::Matrix<double, 1, 1>;
using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

DiscreteSystem<2, 1, 1> cart() {
  DiscreteSystem<2, 1, 1> plant;
  plant.A << 1.0, 0.02, 0.0, 0.95;
  plant.B << 0.001, 0.02;
  plant.C << 1.0, 0.0;
  plant.D << 0.0;
  plant.period = Time(0.02);
  return plant;
}

/// Without any tolerance: each double's square is exact enough in long double.
void expect_covariance(const Eigen::Matrix2d& P) {
  ASSERT_EQ(P(0, 1), P(1, 0));
  ASSERT_GE(P(0, 0), 0.0);
  ASSERT_GE(P(1, 1), 0.0);
  const Long exact = P.cast<long double>();
  ASSERT_GE(exact(0, 0) * exact(1, 1), exact(0, 1) * exact(0, 1));
}

// The forms that subtract (Joseph's among them) lose P's sign here: P0/R from 1e18 on left a
// variance of -0.24 and refused every measurement after the second.
TEST(KalmanCovariance, StaysOneWhateverTheRatioOfItsNoises) {
  const auto plant = cart();
  for (const double Q : {0.0, 1e-12, 1e-8, 1e-4, 1.0}) {
    for (const double P0 : {1.0, 1e4, 1e8, 1e12, 1e16, 1e22, 1e30}) {
      for (const double R : {0.0, 1e-16, 1e-12, 1e-8, 1e-4, 1.0}) {
        SCOPED_TRACE("Q = " + std::to_string(std::log10(Q)) + ", P0 = " + std::to_string(P0) +
                     ", R = " + std::to_string(std::log10(R)));
        auto filter = kalman_filter(plant, Eigen::Matrix2d(Eigen::Matrix2d::Identity() * Q),
                                    Scalar(R), Eigen::Matrix2d(Eigen::Matrix2d::Identity() * P0))
                          .value();
        for (int k = 0; k < 3000; ++k) {
          filter.predict(Scalar(1.0));
          ASSERT_NO_FATAL_FAILURE(expect_covariance(filter.P()));
          ASSERT_EQ(filter.update(Scalar(0.5), Scalar(1.0)), UpdateStatus::updated) << k;
          ASSERT_NO_FATAL_FAILURE(expect_covariance(filter.P()));
          ASSERT_TRUE(filter.x_hat().allFinite());
        }
      }
    }
  }
}

// The two measurements after an ignorant start determine both states: with P0 → ∞ the filter is the
// straight line through them, (y_1, y_2) = (x, x + 0.02 v) at the second sample.
TEST(KalmanCovariance, AnIgnorantStartIsTheLineThroughTheMeasurements) {
  auto plant = cart();
  plant.A(1, 1) = 1.0;
  auto filter = kalman_filter(plant, Eigen::Matrix2d(Eigen::Matrix2d::Zero()), Scalar(1e-6),
                              Eigen::Matrix2d(Eigen::Matrix2d::Identity() * 1e18))
                    .value();
  filter.predict(Scalar(0.0));
  filter.update(Scalar(1.0), Scalar(0.0));
  filter.predict(Scalar(0.0));
  filter.update(Scalar(1.5), Scalar(0.0));
  EXPECT_NEAR(filter.x_hat()(0), 1.5, 1e-9);
  EXPECT_NEAR(filter.x_hat()(1), 25.0, 1e-7);
  // σ² of the slope is 2 R/T², of the end R, and their covariance R/T.
  EXPECT_NEAR(filter.P()(0, 0) / 1e-6, 1.0, 1e-9);
  EXPECT_NEAR(filter.P()(0, 1) / (1e-6 / 0.02), 1.0, 1e-9);
  EXPECT_NEAR(filter.P()(1, 1) / (2e-6 / 4e-4), 1.0, 1e-9);
}

// The defining equations (9.20 to 9.24, Joseph's form) in long double, with noises that are
// correlated.
TEST(KalmanCovariance, IsThatOfTheBook) {
  Random random(11);
  const auto draw = [&](Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }));
  };
  for (int run = 0; run < 20; ++run) {
    DiscreteSystem<3, 1, 2> plant;
    plant.A = 0.5 * draw(3, 3);
    plant.B = draw(3, 1);
    plant.C = draw(2, 3);
    plant.D = draw(2, 1);
    plant.period = Time(0.1);
    // Q of rank two, R with its entries beside the diagonal.
    const Eigen::MatrixXd G = draw(3, 2);
    const Eigen::MatrixXd H = draw(2, 2);
    const Eigen::MatrixXd F = draw(3, 3);
    const Eigen::Matrix3d Q = G * G.transpose();
    const Eigen::Matrix2d R = H * H.transpose() + 0.1 * Eigen::Matrix2d::Identity();
    const Eigen::Matrix3d P0 = F * F.transpose();
    auto filter = kalman_filter(plant, Q, R, P0).value();
    const Long A = plant.A.cast<long double>();
    const Long C = plant.C.cast<long double>();
    Long P = P0.cast<long double>();
    Long x = Long::Zero(3, 1);
    for (int k = 0; k < 100; ++k) {
      const Scalar u(random.normal());
      const Eigen::Vector2d y(random.normal(), random.normal());
      x = (A * x + plant.B.cast<long double>() * u.cast<long double>()).eval();
      P = (A * P * A.transpose() + Q.cast<long double>()).eval();
      filter.predict(u);
      ASSERT_LT((filter.P().cast<long double>() - P).norm(), 1e-11L * P.norm());
      const Long S = C * P * C.transpose() + R.cast<long double>();
      const Long K = S.llt().solve(C * P).transpose();
      x +=
          K * (y.cast<long double>() - C * x - plant.D.cast<long double>() * u.cast<long double>());
      const Long I_KC = Long::Identity(3, 3) - K * C;
      P = (I_KC * P * I_KC.transpose() + K * R.cast<long double>() * K.transpose()).eval();
      ASSERT_EQ(filter.update(y, u), UpdateStatus::updated);
      ASSERT_LT((filter.P().cast<long double>() - P).norm(), 1e-11L * P.norm());
      ASSERT_LT((filter.x_hat().cast<long double>() - x).norm(), 1e-11L * (1.0L + x.norm()));
    }
  }
}

// A sensor without noise on a plant without noise: P is zero after two measurements, and the filter
// still follows the sensor, which is all that is known.
TEST(KalmanCovariance, ASensorWithoutNoiseIsFollowed) {
  auto filter = kalman_filter(cart(), Eigen::Matrix2d(Eigen::Matrix2d::Zero()), Scalar(0.0),
                              Eigen::Matrix2d(Eigen::Matrix2d::Identity()))
                    .value();
  for (int k = 0; k < 1000; ++k) {
    filter.predict(Scalar(1.0));
    ASSERT_EQ(filter.update(Scalar(0.5), Scalar(1.0)), UpdateStatus::updated) << k;
    ASSERT_NEAR(filter.x_hat()(0), 0.5, 1e-12);
  }
}

// Two equal sensors of which one has noise: the second one says nothing new, but is not refused.
TEST(KalmanCovariance, TwoSensorsOfOneStateAreBothTaken) {
  DiscreteSystem<2, 1, 2> plant;
  plant.A.setIdentity();
  plant.B.setZero();
  plant.C << 1.0, 0.0, 1.0, 0.0;
  plant.D.setZero();
  plant.period = Time(1.0);
  const Eigen::Matrix2d zero = Eigen::Matrix2d::Zero();
  const Eigen::Matrix2d P0 = 1e20 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d R = 1e-6 * Eigen::Matrix2d::Identity();
  auto filter = kalman_filter(plant, zero, R, P0).value();
  EXPECT_EQ(filter.update(Eigen::Vector2d(1.0, 3.0), Scalar(0.0)), UpdateStatus::updated);
  EXPECT_NEAR(filter.x_hat()(0), 2.0, 1e-9);
  EXPECT_NEAR(filter.P()(0, 0), 5e-7, 1e-15);
  EXPECT_EQ(filter.P()(1, 1), 1e20);
}

// Both without noise: after the first one, what is left of the second one's variance is rounding,
// and an estimate that trusted it could be anything. That is so in any unit of the states, as is
// that two that differ are both taken.
TEST(KalmanCovariance, TwoEqualSensorsWithoutNoiseAreSingular) {
  Random random(13);
  for (int run = 0; run < 200; ++run) {
    DiscreteSystem<3, 1, 2> plant;
    plant.A.setIdentity();
    plant.B.setZero();
    plant.C.row(0) << random.normal(), random.normal(), random.normal();
    plant.C.row(1) = 3.0 * plant.C.row(0);
    plant.D.setZero();
    plant.period = Time(1.0);
    const Eigen::Matrix3d F = std::pow(10.0, run % 17 - 8) *
                              Eigen::Matrix3d::NullaryExpr([&] { return random.normal(); });
    const Eigen::Matrix3d P0 = F * F.transpose();
    const Eigen::Matrix3d Q = Eigen::Matrix3d::Zero();
    const Eigen::Matrix2d R = Eigen::Matrix2d::Zero();
    auto filter = kalman_filter(plant, Q, R, P0).value();
    const Eigen::Matrix3d P = filter.P();
    ASSERT_EQ(filter.update(Eigen::Vector2d(1.0, 1.0), Scalar(0.0)),
              UpdateStatus::singular_innovation);
    ASSERT_TRUE(filter.x_hat().isZero(0.0));
    ASSERT_EQ(filter.P(), P);
    plant.C(1, 0) += 1.0;
    auto both = kalman_filter(plant, Q, R, P0).value();
    ASSERT_EQ(both.update(Eigen::Vector2d(1.0, 1.0), Scalar(0.0)), UpdateStatus::updated);
    ASSERT_NEAR((plant.C * both.x_hat())(1), 1.0, 1e-6);
  }
}

TEST(KalmanCovariance, Errors) {
  const auto plant = cart();
  const Eigen::Matrix2d I = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d indefinite;
  indefinite << 1.0, 2.0, 2.0, 1.0;
  Eigen::Matrix2d beside;
  beside << 0.0, 1.0, 1.0, 1.0;
  for (const Eigen::Matrix2d& bad : {indefinite, beside, Eigen::Matrix2d(-I)}) {
    EXPECT_TRUE(kalman_filter(plant, bad, Scalar(1.0), I).error().is(ArgumentError::out_of_range));
    EXPECT_TRUE(kalman_filter(plant, I, Scalar(1.0), bad).error().is(ArgumentError::out_of_range));
  }
  EXPECT_TRUE(kalman_filter(plant, I, Scalar(-1.0), I).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(kalman_filter(plant, I, Scalar(1.0), Eigen::Matrix2d(1e201 * I))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(kalman_filter(plant, indefinite, Scalar(1.0), I).error()),
            "KalmanFilter: Q is negative in some direction: row 0 and column 0 show it; it must be "
            "positive semidefinite, as every covariance is");
  // What rounding leaves of a covariance of rank one is one.
  const Eigen::Vector2d v(0.1, 1.0 / 3.0);
  EXPECT_TRUE(kalman_filter(plant, Eigen::Matrix2d(v * v.transpose()), Scalar(0.0), I));
}

// U D Uᵀ is the matrix that was factorised, entry by entry relative to its variances, whatever the
// units of the states; of a singular one too.
TEST(KalmanCovariance, FactorsAreTheMatrix) {
  Random random(12);
  for (int run = 0; run < 500; ++run) {
    const Eigen::Index n = 1 + static_cast<Eigen::Index>(random.bits() % 6);
    const Eigen::Index rank = 1 + static_cast<Eigen::Index>(random.bits() % 6);
    Eigen::MatrixXd F = Eigen::MatrixXd::NullaryExpr(n, rank, [&] { return random.normal(); });
    for (Eigen::Index i = 0; i < n; ++i) {
      F.row(i) *= std::pow(10.0, 60.0 * random.uniform() - 30.0);
    }
    const Eigen::MatrixXd P = F * F.transpose();
    Eigen::MatrixXd U;
    Eigen::VectorXd d;
    detail::ud_factorize(P, U, d);
    ASSERT_TRUE((d.array() >= 0.0).all());
    Eigen::MatrixXd product(n, n);
    detail::ud_product(U, d, product);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = 0; i < n; ++i) {
        const double size = std::sqrt(P(i, i)) * std::sqrt(P(j, j));
        ASSERT_NEAR(product(i, j) / size, P(i, j) / size, 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace flyball::kalman_covariance_test
