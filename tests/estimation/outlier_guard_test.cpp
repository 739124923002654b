#include <flyball/estimation/outlier_guard.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/estimate.hpp>

#include "linear_filter.hpp"
#include "support/oracle.hpp"

namespace flyball::outlier_guard_test {
namespace {

using Vector1 = Eigen::Matrix<double, 1, 1>;
using Scalar = Estimate<Vector1>;

const Vector1 one(1.0);
const MeasurementNoise<1> noise{one};

Scalar scalar(double P) {
  return Scalar::create(Vector1(0.0), Vector1(P)).value();
}

// R's qchisq(p, f): 0.95 at 1, 2, 3, 12 and 0.997 at 2.
TEST(OutlierGuard, ThresholdsAreQuantiles) {
  const auto guard = OutlierGuard::create({.probability = 0.95}).value();
  EXPECT_NEAR(guard.threshold(1), 3.841458821, 1e-8);
  EXPECT_NEAR(guard.threshold(2), 5.991464547, 1e-8);
  EXPECT_NEAR(guard.threshold(3), 7.814727903, 1e-8);
  EXPECT_NEAR(guard.threshold(12), 21.02606982, 1e-7);
  // Beyond, an approximation: qchisq(0.95, c(13, 40)).
  EXPECT_NEAR(guard.threshold(13), 22.36203249, 0.03);
  EXPECT_NEAR(guard.threshold(40), 55.75847928, 0.03);
  EXPECT_NEAR(OutlierGuard::create({.probability = 0.997}).value().threshold(2),
              -2.0 * std::log(0.003), 1e-8);
}

TEST(OutlierGuard, AGateLeavesOutAndRecovers) {
  auto guard = OutlierGuard::create({.recover_after = 3, .inflation = 10.0}).value();
  auto estimate = scalar(1.0);
  // S = 2: 100²/2 is far beyond, and stays so until P has grown by 10, 10, 10, …
  int k = 0;
  for (; k < 20; ++k) {
    const double P = estimate.P()(0);
    const auto correction = correct(estimate, Vector1(100.0), one, noise, {.guard = &guard});
    if (correction.accepted()) {
      break;
    }
    ASSERT_EQ(correction.status, UpdateStatus::rejected);
    ASSERT_EQ(correction.weight, 0.0);
    ASSERT_NEAR(correction.nis, 1e4 / (P + 1.0), 1e-9);
    ASSERT_EQ(estimate.x_hat()(0), 0.0);
    ASSERT_NEAR(estimate.P()(0), k < 2 ? P : 10.0 * P, 1e-12 * P);
    ASSERT_EQ(guard.rejected_in_a_row(), k + 1);
  }
  // 1e4/(P + 1) < 8.8 from P = 1e4 on: two, and then four that inflate.
  EXPECT_EQ(k, 6);
  EXPECT_NEAR(estimate.x_hat()(0), 100.0 * 1e4 / (1e4 + 1.0), 1e-8);
  EXPECT_EQ(guard.rejected_in_a_row(), 0);
}

TEST(OutlierGuard, RecoversByTime) {
  auto guard = OutlierGuard::create({.recover_time = Time(2.0)}).value();
  EXPECT_EQ(guard.judged(0.0), 1.0);
  guard.advance(1.0);
  EXPECT_EQ(guard.judged(0.0), 1.0);
  guard.advance(1.0);
  EXPECT_EQ(guard.judged(0.05), 10.0);
  // Until three fit.
  EXPECT_EQ(guard.judged(0.5), 1.0);
  EXPECT_EQ(guard.judged(0.5), 1.0);
  EXPECT_EQ(guard.judged(0.0), 10.0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(guard.judged(1.0), 1.0);
  }
  EXPECT_EQ(guard.judged(0.0), 1.0);
}

// The robust correction ends where the most probable state is: for Huber's loss with the threshold
// k² and |y - x| > k, x/P = k/√R (the pull is limited); for Student's with ν,
// x/P = (ν + 1) e/(ν R + e²) with e = y - x.
TEST(OutlierGuard, RobustCorrectionsAreTheMostProbable) {
  auto huber = OutlierGuard::create(
                   {.treatment = OutlierTreatment::huber, .probability = 0.95, .iterations = 200})
                   .value();
  auto student = OutlierGuard::create(
                     {.treatment = OutlierTreatment::student, .freedom = 3.0, .iterations = 200})
                     .value();
  const double k = std::sqrt(huber.threshold(1));
  for (const double y : {4.0, 10.0, -30.0}) {
    auto estimate = scalar(0.5);
    const auto limited = correct(estimate, Vector1(y), one, noise, {.guard = &huber});
    EXPECT_TRUE(limited.accepted());
    EXPECT_NEAR(estimate.x_hat()(0), std::copysign(0.5 * k, y), 1e-7);
    EXPECT_NEAR(limited.weight, k / std::abs(y - estimate.x_hat()(0)), 1e-7);
    EXPECT_NEAR(limited.nis, y * y / 1.5, 1e-12);

    auto other = scalar(0.5);
    EXPECT_TRUE(correct(other, Vector1(y), one, noise, {.guard = &student}).accepted());
    const double e = y - other.x_hat()(0);
    EXPECT_NEAR(other.x_hat()(0) / 0.5, 4.0 * e / (3.0 + e * e), 1e-6);
  }
  // A good one is taken as it is.
  for (OutlierGuard* guard : {&huber, &student}) {
    auto estimate = scalar(0.5);
    EXPECT_EQ(correct(estimate, Vector1(0.7), one, noise, {.guard = guard}).weight, 1.0);
    EXPECT_NEAR(estimate.x_hat()(0), 0.7 / 3.0, 1e-15);
  }
}

// One measurement in ten is off by up to 50 σ: the plain filter is drawn along, the others hardly.
TEST(OutlierGuard, EachTreatmentHoldsAgainstOutliers) {
  const auto error_of = [](OutlierGuard* guard) {
    Random random(71);
    auto estimate = scalar(1.0);
    const PlainNoise<1> Q(Vector1(1e-3));
    double x = 0.0;
    double sum = 0.0;
    for (int k = 0; k < 5000; ++k) {
      x += std::sqrt(1e-3) * random.normal();
      estimate.predict(estimate.x_hat(), one, Q);
      const bool off = random.uniform() < 0.1;
      const double y = x + (off ? random.uniform(-50.0, 50.0) : random.normal());
      correct(estimate, Vector1(y), one, noise, {.guard = guard});
      sum += std::pow(estimate.x_hat()(0) - x, 2);
    }
    return std::sqrt(sum / 5000.0);
  };
  const double plain = error_of(nullptr);
  EXPECT_GT(plain, 0.9);
  for (const auto treatment :
       {OutlierTreatment::gate, OutlierTreatment::huber, OutlierTreatment::student}) {
    auto guard = OutlierGuard::create({.treatment = treatment, .recover_after = 5}).value();
    // The optimum without outliers is √P = 0.176.
    EXPECT_LT(error_of(&guard), treatment == OutlierTreatment::huber ? 0.3 : 0.22);
  }
}

// The noise that the corrections show goes to the true one, from ten times more and ten times less,
// where it is what the innovations are made of: their S holds R and the states' part, and what is a
// small part of S is found slowly and to the digits that S is known to.
TEST(AdaptedNoise, GoesToTheTruth) {
  for (const double guess : {0.1, 10.0}) {
    Random random(72);
    test::LinearCase c = test::linear_case(random);
    c.plant.A *= 0.8 / c.plant.A.norm();  // Stable, so that x keeps its digits.
    c.Q *= 0.01;
    const Eigen::Matrix2d truth = c.R;
    c.R *= guess;
    test::LinearFilter<JosephCovariance> filter(c);
    Eigen::Vector3d x = c.x0;
    const Eigen::Matrix2d S = test::cholesky_factor(truth);
    const Eigen::Matrix3d G = test::cholesky_factor(c.Q + 1e-9 * Eigen::Matrix3d::Identity());
    Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
    for (int k = 0; k < 40000; ++k) {
      x = (c.plant.A * x + G * test::normal(random, 3, 1)).eval();
      filter.predict(test::U(0.0));
      const Eigen::Vector2d y = c.plant.C * x + S * test::normal(random, 2, 1);
      filter.R = adapted(filter.R, filter.correct(y, test::U(0.0)), 0.002);
      ASSERT_TRUE(filter.R.usable());
      if (k >= 20000) {
        mean += filter.R.R() / 20000.0;
      }
    }
    EXPECT_LT((mean - truth).norm(), 0.1 * truth.norm()) << guess;
  }
}

TEST(OutlierGuard, Errors) {
  EXPECT_TRUE(OutlierGuard::create({.probability = 0.2}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(OutlierGuard::create({.probability = 1.0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(OutlierGuard::create({.freedom = 0.5}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(OutlierGuard::create({.iterations = 0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(OutlierGuard::create({.recover_after = -1}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      OutlierGuard::create({.recover_time = Time(-1.0)}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(OutlierGuard::create({.inflation = 0.5}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      OutlierGuard::create({.probability = std::nan("")}).error().is(ArgumentError::not_finite));
}

// An R that is no covariance is told, at design time with its evidence, at run time by the status.
TEST(MeasurementNoise, RefusesWhatIsNone) {
  Eigen::Matrix2d indefinite;
  indefinite << 1.0, 2.0, 2.0, 1.0;
  EXPECT_TRUE(MeasurementNoise<2>::create(Eigen::MatrixXd(indefinite))
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(
      MeasurementNoise<2>::create(Eigen::MatrixXd(one)).error().is(ArgumentError::wrong_shape));
  EXPECT_FALSE(MeasurementNoise<2>(indefinite).usable());
  EXPECT_FALSE(MeasurementNoise<1>(Vector1(-1.0)).usable());
  EXPECT_FALSE(MeasurementNoise<1>(Vector1(std::nan(""))).usable());
  auto estimate = scalar(1.0);
  EXPECT_EQ(correct(estimate, one, one, MeasurementNoise<1>(Vector1(-1.0))).status,
            UpdateStatus::invalid_noise);
  EXPECT_EQ(estimate.x_hat()(0), 0.0);
  // Sizes that are known at run time only and do not fit.
  auto of_two = Estimate<Eigen::VectorXd>::create(Eigen::Vector2d(0.0, 0.0),
                                                  Eigen::MatrixXd(Eigen::Matrix2d::Identity()))
                    .value();
  using Noises = MeasurementNoise<Eigen::Dynamic>;
  const Eigen::VectorXd y = Eigen::VectorXd::Ones(1);
  EXPECT_EQ(of_two
                .correct<Eigen::Dynamic>(y, Eigen::MatrixXd(Eigen::Matrix2d::Identity()),
                                         Noises(Eigen::MatrixXd(one)))
                .status,
            UpdateStatus::invalid_noise);
  EXPECT_EQ(
      of_two.correct<Eigen::Dynamic>(y, Eigen::MatrixXd(one), Noises(Eigen::MatrixXd(one))).status,
      UpdateStatus::invalid_noise);
  EXPECT_EQ(
      of_two.correct<Eigen::Dynamic>(y, Eigen::MatrixXd::Ones(1, 2), Noises(Eigen::MatrixXd(one)))
          .status,
      UpdateStatus::updated);
  // L D Lᵀ is R, also of a singular one.
  Random random(73);
  for (int run = 0; run < 100; ++run) {
    const Eigen::MatrixXd F = test::normal(random, 4, 1 + run % 4);
    const Eigen::Matrix4d R = F * F.transpose();
    const MeasurementNoise<4> made(R);
    ASSERT_TRUE(made.usable()) << run;
    ASSERT_LT((made.L() * made.D().asDiagonal() * made.L().transpose() - R).norm(),
              1e-10 * R.norm());
  }
}

}  // namespace
}  // namespace flyball::outlier_guard_test
