#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/estimate.hpp>
#include <flyball/estimation/forms/information_form.hpp>
#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>

// Numbers from one end of their range to the other.
namespace flyball {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Row = Eigen::Matrix<double, 1, 2>;
using One = Eigen::Matrix<double, 1, 1>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

template <class Form>
class HostileNumbers : public testing::Test {};
using Forms = testing::Types<JosephCovariance<2>, UdCovariance<2>, SquareRootCovariance<2>,
                             InformationForm<2>>;
TYPED_TEST_SUITE(HostileNumbers, Forms);

TYPED_TEST(HostileNumbers, LeaveTheEstimateFinite) {
  Random random(91);
  const auto number = [&] {
    constexpr double all[]{0.0,    1.0,     -0.3,   1e-100, -1e100,   1e100,   1e-160,
                           1e50,   -1e50,   1e-8,   1e8,    5e-324,   1.7e308, -1.7e308,
                           1e-300, -1e-300, 3.7e99, 1e90,   infinity, nan};
    return all[static_cast<std::size_t>(random.uniform(0.0, std::size(all) - 1e-9))];
  };
  const auto variance = [&] {
    constexpr double all[]{0.0, 5e-324, 1e-310, 1e-200, 1e-100, 1e-16,
                           0.1, 1.0,    1e16,   1e120,  1e200};
    return all[static_cast<std::size_t>(random.uniform(0.0, std::size(all) - 1e-9))];
  };
  int corrected = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const Vector2d s(std::sqrt(variance()), std::sqrt(variance()));
    const double correlation = random.uniform(-0.9, 0.9);
    Matrix2d P = s.cwiseProduct(s).asDiagonal();
    P(0, 1) = P(1, 0) = correlation * s(0) * s(1);
    TypeParam form;
    if (!form.set(P)) {
      continue;
    }
    Estimate<Vector2d, TypeParam> estimate(Vector2d(1.0, 2.0), form);
    for (int step = 0; step < 6; ++step) {
      if (step % 2 == 1) {
        Matrix2d F;
        F << number(), number(), number(), number();
        const Matrix2d Q = Vector2d(variance(), variance()).asDiagonal();
        estimate.predict(Vector2d(number(), number()), F, typename TypeParam::Noise(Q));
      } else {
        corrected += estimate.template correct<1>(One(number()), Row(number(), number()),
                                                  MeasurementNoise<1>(One(variance())))
                             .accepted()
                         ? 1
                         : 0;
      }
      ASSERT_TRUE(estimate.x_hat().allFinite());
      ASSERT_TRUE(estimate.P().allFinite()) << estimate.P();
      ASSERT_EQ(estimate.P(), estimate.P().transpose());
      ASSERT_GE(estimate.P().diagonal().minCoeff(), 0.0) << estimate.P();
    }
  }
  EXPECT_GE(corrected, 1000);
}

TYPED_TEST(HostileNumbers, WhatIsNoStateOrNoCovarianceIsRefused) {
  using OfForm = Estimate<Vector2d, TypeParam>;
  const Matrix2d P = Matrix2d::Identity();
  for (const double bad : {nan, infinity, 1e200}) {
    const auto estimate = OfForm::create(Vector2d(0.0, bad), Covariance(P));
    ASSERT_FALSE(estimate);
    EXPECT_TRUE(estimate.error().is(ArgumentError::not_finite)) << to_string(estimate.error());
  }
  auto estimate = OfForm::create(Vector2d(1.0, 2.0), Covariance(P)).value();
  for (const auto& [a, b, c, d] : {std::array{1.0, 0.9, 0.1, 1.0},
                                   {1.0, 5.0, 0.0, 1.0},
                                   {1.0, 0.0, 5.0, 1.0},
                                   {-1.0, 0.0, 0.0, 1.0},
                                   {1.0, 2.0, 2.0, 1.0},
                                   {nan, 0.0, 0.0, 1.0}}) {
    const Matrix2d none = (Matrix2d() << a, b, c, d).finished();
    EXPECT_FALSE(estimate.reset(Vector2d::Zero(), none)) << none;
    EXPECT_EQ(estimate.x_hat(), Vector2d(1.0, 2.0));
    EXPECT_EQ(MeasurementNoise<2>(none).usable(), false) << none;
  }
}

}  // namespace
}  // namespace flyball
