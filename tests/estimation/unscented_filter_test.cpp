#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>

#include "field_drive.hpp"
#include "support/allocation_count.hpp"

namespace flyball::unscented_filter_test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

MatrixXd normal(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// Curved in every direction.
Vector2d curve(const Vector3d& x) {
  return {std::sin(x(0)) + x(1) * x(2), std::exp(0.3 * x(1)) - x(0) * x(0)};
}

/// Mean, covariance and cross covariance by the weights of the literature.
struct Weighted {
  Vector2d mean;
  Eigen::Matrix2d covariance;
  Eigen::Matrix<double, 3, 2> cross;
};
template <class Points>
Weighted weighted(const Points& points, const Vector3d& x, const Matrix3d& S, double outer_mean,
                  double alpha, double beta) {
  const int count = Points::outer(3);
  const double centre_mean = 1.0 - count * outer_mean;
  const double centre_covariance = centre_mean + 1.0 - alpha * alpha + beta;
  Weighted w;
  w.mean = centre_mean * curve(x);
  for (int i = 0; i < count; ++i) {
    w.mean += outer_mean * curve(x + points.place(S, i));
  }
  const Vector2d e0 = curve(x) - w.mean;
  w.covariance = centre_covariance * e0 * e0.transpose();
  w.cross.setZero();
  for (int i = 0; i < count; ++i) {
    const Vector3d delta = points.place(S, i);
    const Vector2d e = curve(x + delta) - w.mean;
    w.covariance += outer_mean * e * e.transpose();
    w.cross += outer_mean * delta * e.transpose();
  }
  return w;
}

template <class Points>
void expect_the_weights(const Points& points, double outer_mean, double alpha, double beta) {
  Random random(51);
  const Matrix3d S = normal(random, 3, 3).triangularView<Eigen::Lower>();
  const Vector3d x = normal(random, 3, 1);
  const Weighted w = weighted(points, x, S, outer_mean, alpha, beta);
  MatrixXd E(2, Points::outer(3));
  for (int i = 0; i < E.cols(); ++i) {
    E.col(i) = curve(x + points.place(S, i)) - curve(x);
  }
  Vector2d m;
  MatrixXd Z(2, 3 + Points::rest(3));
  const double c = points.regress(E, m, Z);
  EXPECT_LT((curve(x) + m - w.mean).norm(), 1e-13);
  EXPECT_LT((Z * Z.transpose() + c * m * m.transpose() - w.covariance).norm(), 1e-12);
  EXPECT_LT((S * Z.leftCols(3).transpose() - w.cross).norm(), 1e-13);
}

// The sums over the weights of van der Merwe (2004) and Julier (2003), for settings of both signs
// of the centre's.
TEST(SigmaPoints, AreTheWeightsOfTheLiterature) {
  for (const double alpha : {0.1, 0.5, 1.0, 1.5}) {
    for (const double beta : {0.0, 2.0}) {
      for (const double kappa : {0.0, 1.0}) {
        SCOPED_TRACE(testing::Message() << alpha << " " << beta << " " << kappa);
        expect_the_weights(ScaledPoints{alpha, beta, kappa},
                           1.0 / (2.0 * alpha * alpha * (3.0 + kappa)), alpha, beta);
      }
      for (const double w0 : {0.0, 0.4}) {
        SCOPED_TRACE(testing::Message() << alpha << " " << beta << " " << w0);
        expect_the_weights(SimplexPoints{alpha, beta, w0}, (1.0 - w0) / (4.0 * alpha * alpha),
                           alpha, beta);
      }
    }
  }
}

// y = x² of x ~ N(μ, σ²) has the mean μ² + σ² and the variance 4 μ² σ² + 2 σ⁴: exactly that for
// β = 2 - 2 α², whatever α.
TEST(SigmaPoints, AreExactForASquare) {
  const double mu = 1.3;
  const double sigma = 0.7;
  for (const double alpha : {0.1, 0.5, 0.9}) {
    const ScaledPoints points{alpha, 2.0 - 2.0 * alpha * alpha};
    const Eigen::Matrix<double, 1, 1> S(sigma);
    Eigen::Matrix<double, 1, 2> E;
    for (int i = 0; i < 2; ++i) {
      const double x = mu + points.place(S, i)(0);
      E(i) = x * x - mu * mu;
    }
    Eigen::Matrix<double, 1, 1> m;
    Eigen::Matrix<double, 1, 2> Z;
    const double c = points.regress(E, m, Z);
    EXPECT_NEAR(m(0), sigma * sigma, 1e-13);
    EXPECT_NEAR(Z.squaredNorm() + c * m(0) * m(0),
                4.0 * mu * mu * sigma * sigma + 2.0 * std::pow(sigma, 4), 1e-12);
  }
}

template <class Filter>
Filter drive_filter(const typename Filter::Method& method = {}) {
  const test::FieldDrive model;
  Eigen::Vector<double, 5> sigma_q;
  sigma_q << 2e-3, 2e-3, 1e-3, 0.05, 0.05;
  Eigen::Vector<double, 5> sigma_0;
  sigma_0 << 0.3, 0.3, 0.2, 0.1, 0.1;
  return Filter::create(
             model, MatrixXd(sigma_q.cwiseAbs2().asDiagonal()),
             standard_deviations({0.01, 0.02, 0.02}),
             {Eigen::Vector<double, 5>::Zero(), MatrixXd(sigma_0.cwiseAbs2().asDiagonal())},
             Time(0.02), Covariance(MatrixXd(0, 0)), method)
      .value();
}

/// Heading and wheels alone are measured: x and y are never seen, the case in which a wrong
/// triangular factor shows.
template <class Root, class Whole>
void expect_the_same(Root root, Whole whole, double tolerance) {
  Random random(52);
  for (int k = 0; k < 500; ++k) {
    const Vector2d u(4.0 + random.normal(), 6.0 + random.normal());
    const Vector3d y(0.01 * k + 0.01 * random.normal(), 1.0 + 0.02 * random.normal(),
                     1.5 + 0.02 * random.normal());
    ASSERT_TRUE(root.predict(u));
    ASSERT_TRUE(whole.predict(u));
    ASSERT_TRUE(root.correct(y, u).accepted());
    ASSERT_TRUE(whole.correct(y, u).accepted());
    ASSERT_LT((root.x_hat() - whole.x_hat()).norm(), tolerance);
    ASSERT_LT((root.P() - whole.P()).norm(), tolerance * whole.P().norm()) << k;
    ASSERT_LT((root.F() - whole.F()).norm(), tolerance * whole.F().norm());
    const Eigen::Matrix<double, 5, 5> S = root.estimate().form().factor();
    ASSERT_TRUE(S.isLowerTriangular(0.0));
    ASSERT_TRUE((S.diagonal().array() > 0.0).all());
    ASSERT_LT((S * S.transpose() - root.P()).norm(), 1e-14 * root.P().norm());
  }
  EXPECT_GT(whole.P()(0, 0), 0.09);  // Nobody has seen where it is.
}

TEST(SquareRootUnscentedKalmanFilter, IsTheUnscentedOneWherePartOfTheStateIsUnseen) {
  using Scaled = ScaledPoints;
  for (const Scaled points : {Scaled{0.5, 2.0}, Scaled{1.0, 0.0, 0.0}, Scaled{0.05, 2.0, 0.0}}) {
    SCOPED_TRACE(points.alpha);
    expect_the_same(drive_filter<SquareRootUnscentedKalmanFilter<test::FieldDrive>>(points),
                    drive_filter<UnscentedKalmanFilter<test::FieldDrive>>(points), 1e-9);
  }
  expect_the_same(drive_filter<SquareRootUnscentedKalmanFilter<test::FieldDrive, SimplexPoints>>(),
                  drive_filter<UnscentedKalmanFilter<test::FieldDrive, SimplexPoints>>(), 1e-9);
}

/// x⁺ = x1² + x2², twice.
struct Bowl {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  X next(const X& x, const U&, double) const {
    X y = x;
    y(0) = y(1) = x(0) * x(0) + x(1) * x(1);
    return y;
  }
};

// Around the minimum with P = I, n = 2 and γ² = 2 the values on an axis sum to s = 4 each, so that
// m = 2, Σ s²/4γ² = 4 and, with β = -4, c m² = -5 · 4: what would be subtracted is left out and
// counted, and P stays a covariance.
TEST(SquareRootUnscentedKalmanFilter, SeesADowndateThatFails) {
  auto filter = SquareRootUnscentedKalmanFilter<Bowl>::create(
                    Bowl{}, MatrixXd(1e-4 * Eigen::Matrix2d::Identity()),
                    MatrixXd(Eigen::Matrix2d::Identity()),
                    {Vector2d(0.0, 0.0), MatrixXd(Eigen::Matrix2d::Identity())}, Time(1.0),
                    Covariance(MatrixXd(0, 0)), Unscented<ScaledPoints>({1.0, -4.0, 0.0}))
                    .value();
  EXPECT_TRUE(filter.predict(Eigen::Matrix<double, 1, 1>(0.0)));
  EXPECT_EQ(filter.method().downdates_left_out(), 1);
  EXPECT_NEAR(filter.x_hat()(0), 2.0, 1e-12);
  EXPECT_NEAR(filter.P()(0, 0), 4.0 + 1e-4, 1e-9);
  const Eigen::Matrix2d P = filter.P();
  EXPECT_GT(P.determinant(), 0.0);
  EXPECT_TRUE(filter.correct(Vector2d(1.0, 1.0), Eigen::Matrix<double, 1, 1>(0.0)).accepted());
}

// A precise measurement far from the prediction, y = x² of x ~ N(1, 1): the posterior's mean and
// deviation, by a sum over a grid, are hit only where the points stand around what is known after
// the measurement. A straight h needs no second look.
TEST(UnscentedKalmanFilter, IteratesToTheLineOfThePosterior) {
  using State = Eigen::Vector2d;
  const auto created = [] {
    return Estimate<State>::create({1.0, 0.0}, Covariance(Eigen::Matrix2d::Identity())).value();
  };
  using Vector1 = Eigen::Matrix<double, 1, 1>;
  const double y = 6.0;
  const double R = 0.04;
  const MeasurementNoise<1> noise{Vector1(R)};
  const auto square = [](const State& x) { return Vector1(x(0) * x(0)); };
  double total = 0.0;
  double mean = 0.0;
  double second = 0.0;
  for (double x = 0.0; x < 6.0; x += 1e-4) {
    const double off = y - x * x;
    const double weight = std::exp(-0.5 * (x - 1.0) * (x - 1.0) - 0.5 * off * off / R);
    total += weight;
    mean += weight * x;
    second += weight * x * x;
  }
  mean /= total;
  const double deviation = std::sqrt(second / total - mean * mean);
  auto once = created();
  auto iterated = created();
  EXPECT_TRUE(Unscented<>().correct(once, Vector1(y), square, noise).accepted());
  EXPECT_TRUE(
      Unscented<>().correct(iterated, Vector1(y), square, noise, {.iterations = 30}).accepted());
  EXPECT_GT(std::abs(once.x_hat()(0) - mean), 0.1);
  EXPECT_NEAR(iterated.x_hat()(0), mean, 1e-3);
  EXPECT_NEAR(std::sqrt(iterated.P()(0, 0)), deviation, 1e-2 * deviation);

  const auto straight = [](const State& x) { return Vector1(2.0 * x(0) - x(1)); };
  auto plain = created();
  auto again = created();
  Unscented<>().correct(plain, Vector1(y), straight, noise);
  Unscented<>().correct(again, Vector1(y), straight, noise, {.iterations = 5});
  EXPECT_LT((plain.x_hat() - again.x_hat()).norm(), 1e-13);
  EXPECT_LT((plain.P() - again.P()).norm(), 1e-13);
}

// Every look of an iterated correction asks the guard, and one measurement is judged once.
TEST(UnscentedKalmanFilter, AnIteratedMeasurementIsJudgedOnce) {
  using Vector1 = Eigen::Matrix<double, 1, 1>;
  auto estimate =
      Estimate<Vector2d>::create({1.0, 0.0}, Covariance(Eigen::Matrix2d::Identity())).value();
  auto guard = OutlierGuard::create({.treatment = OutlierTreatment::gate}).value();
  auto other = guard;
  const MeasurementNoise<1> noise{Vector1(1e-4)};
  const auto square = [](const Vector2d& x) { return Vector1(x(0) * x(0)); };
  auto same = estimate;
  for (int k = 0; k < 3; ++k) {
    Unscented<>().correct(estimate, Vector1(900.0), square, noise,
                          {.guard = &guard, .iterations = 5});
    Unscented<>().correct(same, Vector1(900.0), square, noise, {.guard = &other});
  }
  EXPECT_EQ(estimate.x_hat(), same.x_hat());
  EXPECT_EQ(estimate.P(), same.P());
}

TEST(UnscentedKalmanFilter, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto scaled = drive_filter<SquareRootUnscentedKalmanFilter<test::FieldDrive>>();
  auto simplex = drive_filter<UnscentedKalmanFilter<test::FieldDrive, SimplexPoints>>();
  const MeasurementNoise<2> R = test::sighting_noise();
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    const Vector2d u(3.0, 4.0);
    scaled.predict(u);
    simplex.predict(u);
    scaled.correct(Vector3d(0.1, 0.2, 0.3), u);
    simplex.correct(Vector2d(5.0, 0.3), test::Sighting{test::beacons[0]}, R, {},
                    AngleDifference<1>{});
  }
  EXPECT_EQ(counter.count(), 0u);
}

/// A matrix's factor, moved along v and back.
TEST(CholeskyFactor, GoesUpAndDown) {
  Random random(53);
  for (int run = 0; run < 300; ++run) {
    const Eigen::Index n = 1 + static_cast<Eigen::Index>(random.bits() % 6);
    const MatrixXd F = normal(random, n, n);
    const MatrixXd P = F * F.transpose() + 0.01 * MatrixXd::Identity(n, n);
    MatrixXd S;
    ASSERT_TRUE(cholesky_factor(P, S));
    ASSERT_LT((S * S.transpose() - P).norm(), 1e-13 * P.norm());
    const VectorXd v = normal(random, n, 1);
    MatrixXd up = S;
    cholesky_update(up, v);
    ASSERT_TRUE(up.isLowerTriangular(0.0));
    ASSERT_LT((up * up.transpose() - P - v * v.transpose()).norm(), 1e-13 * up.squaredNorm());
    ASSERT_TRUE(cholesky_downdate(up, v));
    ASSERT_LT((up * up.transpose() - P).norm(), 1e-12 * (P.norm() + v.squaredNorm()));
    // S p with |p| slightly more than one is too much, slightly less is not.
    VectorXd p = normal(random, n, 1).normalized();
    const MatrixXd before = S;
    ASSERT_FALSE(cholesky_downdate(S, VectorXd(S * p * (1.0 + 1e-9))));
    ASSERT_EQ(S, before);
    ASSERT_TRUE(cholesky_downdate(S, VectorXd(S * p * (1.0 - 1e-9))));
    ASSERT_TRUE((S.diagonal().array() >= 0.0).all());
  }
}

}  // namespace
}  // namespace flyball::unscented_filter_test
