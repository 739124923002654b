#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>

#include "filter_cases.hpp"
#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

// The laws of every filter on a linear system.
namespace flyball {
namespace {

using Eigen::Vector2d;
using test::LinearCase;
using test::U;

template <class Filter>
class FilterLaw : public testing::Test {};

using Filters = testing::Types<
    test::LinearFilter<JosephCovariance>, test::LinearFilter<UdCovariance>,
    test::LinearFilter<SquareRootCovariance>, test::LinearFilter<InformationForm>,
    test::OfModel<ExtendedKalmanFilter<test::Plant>>,
    test::OfModel<ExtendedKalmanFilter<test::Plant, SquareRootCovariance<3>>>,
    test::OfModel<UnscentedKalmanFilter<test::Plant>>,
    test::OfModel<SquareRootUnscentedKalmanFilter<test::Plant>>,
    test::OfModel<SquareRootUnscentedKalmanFilter<test::Plant, SimplexPoints>>,
    test::OfModel<ModelFilter<test::Plant, UdCovariance<3>, Unscented<SimplexPoints>>>>;
TYPED_TEST_SUITE(FilterLaw, Filters);

TYPED_TEST(FilterLaw, IsTheBooksFilter) {
  Random random(31);
  for (int run = 0; run < 20; ++run) {
    const LinearCase c = test::linear_case(random);
    TypeParam filter(c);
    test::Reference book(c);
    double log_likelihood = 0.0;
    for (int k = 0; k < 100; ++k) {
      const U u(random.normal());
      const Vector2d y(random.normal(), random.normal());
      ASSERT_TRUE(filter.predict(u));
      book.predict(u);
      const auto correction = filter.correct(y, u);
      book.correct(y, u);
      ASSERT_EQ(correction.status, UpdateStatus::updated);
      ASSERT_EQ(correction.weight, 1.0);
      log_likelihood += correction.log_likelihood();
      ASSERT_LT((filter.x_hat().template cast<long double>() - book.x).norm(),
                1e-9L * (1.0L + book.x.norm()));
      ASSERT_LT((filter.P().template cast<long double>() - book.P).norm(), 1e-9L * book.P.norm());
    }
    // The product of the conditional densities is the joint density of all measurements.
    ASSERT_NEAR(log_likelihood, static_cast<double>(book.log_likelihood),
                1e-9 * std::abs(log_likelihood));
  }
}

// The covariance goes to the Riccati equation's.
TYPED_TEST(FilterLaw, SettlesWhereTheRiccatiEquationSays) {
  Random random(32);
  for (int run = 0; run < 10; ++run) {
    const LinearCase c = test::linear_case(random);
    const auto gain = kalman_gain(c.plant, c.Q, c.R).value();
    TypeParam filter(c);
    for (int k = 0; k < 2000; ++k) {
      filter.predict(U(0.0));
      filter.correct(Vector2d::Zero(), U(0.0));
    }
    ASSERT_LT((filter.P() - gain.P_posterior).norm(), 1e-9 * gain.P_posterior.norm());
  }
}

// S, ν and the whitened innovation of the first correction, from their definitions.
TYPED_TEST(FilterLaw, TellsItsInnovation) {
  Random random(33);
  const LinearCase c = test::linear_case(random);
  TypeParam filter(c);
  const U u(0.3);
  const Vector2d y(0.7, -2.0);
  const Vector2d nu = y - c.plant.C * c.x0 - c.plant.D * u;
  const Eigen::Matrix2d S = c.plant.C * c.P0 * c.plant.C.transpose() + c.R;
  const auto correction = filter.correct(y, u);
  EXPECT_LT((correction.innovation - nu).norm(), 1e-12);
  EXPECT_LT((correction.S() - S).norm(), 1e-10 * S.norm());
  const double nis = test::squared_distance(S, nu);
  EXPECT_NEAR(correction.nis, nis, 1e-9 * nis);
  EXPECT_NEAR(correction.normalized().squaredNorm(), nis, 1e-9 * nis);
}

TYPED_TEST(FilterLaw, LeavesOutWhatIsNotFinite) {
  Random random(34);
  const LinearCase c = test::linear_case(random);
  TypeParam filter(c);
  filter.predict(U(1.0));
  const Eigen::Vector3d x_hat = filter.x_hat();
  const Eigen::Matrix3d P = filter.P();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, infinity, -infinity, 1e200}) {
    EXPECT_EQ(filter.correct(Vector2d(1.0, bad), U(0.0)).status, UpdateStatus::not_finite);
    EXPECT_EQ(filter.x_hat(), x_hat);
    EXPECT_EQ(filter.P(), P);
  }
  // An input that is none counts as zero, and is told.
  TypeParam other = filter;
  EXPECT_FALSE(filter.predict(U(nan)));
  EXPECT_TRUE(other.predict(U(0.0)));
  EXPECT_EQ(filter.x_hat(), other.x_hat());
  EXPECT_EQ(filter.P(), other.P());
}

// A measurement whose entry is missing is the measurement of the others, with their noise's part of
// R.
TYPED_TEST(FilterLaw, TakesWhatIsThere) {
  Random random(35);
  const LinearCase c = test::linear_case(random);
  const CorrectionOptions missing{.missing_entries = true};
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (int gone = 0; gone < 2; ++gone) {
    const int there = 1 - gone;
    TypeParam filter(c);
    Vector2d y(0.4, -0.8);
    y(gone) = nan;
    const auto correction = filter.correct(y, U(0.0), missing);
    ASSERT_EQ(correction.status, UpdateStatus::updated);
    EXPECT_EQ(correction.entries, 1);
    const Eigen::RowVector3d h = c.plant.C.row(there);
    const double s = h * c.P0 * h.transpose() + c.R(there, there);
    const Eigen::Vector3d K = c.P0 * h.transpose() / s;
    const double nu = y(there) - h * c.x0;
    EXPECT_LT((filter.x_hat() - c.x0 - K * nu).norm(), 1e-10);
    EXPECT_LT((filter.P() - (c.P0 - K * s * K.transpose())).norm(), 1e-10);
    EXPECT_NEAR(correction.log_likelihood(),
                -0.5 * (nu * nu / s + std::log(2.0 * std::numbers::pi * s)), 1e-10);
  }
  TypeParam filter(c);
  EXPECT_EQ(filter.correct(Vector2d(nan, nan), U(0.0), missing).status, UpdateStatus::not_finite);
  EXPECT_EQ(filter.x_hat(), c.x0);
}

TYPED_TEST(FilterLaw, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  Random random(36);
  TypeParam filter(test::linear_case(random));
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    filter.predict(U(0.1 * k));
    filter.correct(Vector2d(0.2, 0.1), U(0.0));
    filter.correct(Vector2d(0.2, std::numeric_limits<double>::quiet_NaN()), U(0.0),
                   {.missing_entries = true});
  }
  EXPECT_EQ(counter.count(), 0u);
}

}  // namespace
}  // namespace flyball
