#include <flyball/estimation/covariance.hpp>

#include <limits>
#include <type_traits>

#include <gtest/gtest.h>

#include <flyball/systems/discretize.hpp>

namespace flyball::covariance_test {
namespace {

// diag(0.05², 1²)
TEST(Covariance, FromStandardDeviations) {
  const Eigen::MatrixXd Q = standard_deviations({0.05, 1.0}).value();
  EXPECT_DOUBLE_EQ(Q(0, 0), 0.0025);
  EXPECT_DOUBLE_EQ(Q(1, 1), 1.0);
  EXPECT_EQ(Q(0, 1), 0.0);
  EXPECT_EQ(standard_deviations({0.0}).value()(0, 0), 0.0);
}

TEST(Covariance, RefusesAndNamesTheEntry) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const auto negative = standard_deviations({1.0, -2.0});
  EXPECT_TRUE(negative.error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(negative.error()),
            "standard_deviations: standard deviation 1 is -2; it must be zero or greater");
  EXPECT_TRUE(standard_deviations({nan}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(standard_deviations({infinity}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(standard_deviations({}).error().is(ArgumentError::empty));
}

// A spectral density is not a covariance: only `discretize` makes one of it.
TEST(Covariance, IsNotADensity) {
  static_assert(!std::is_convertible_v<ProcessDensity, Covariance>);
  static_assert(!std::is_convertible_v<MeasurementDensity, Covariance>);
  static_assert(std::is_convertible_v<Expected<Eigen::MatrixXd>, Covariance>);
  static_assert(std::is_convertible_v<Eigen::Matrix2d, Covariance>);
  SUCCEED();
}

}  // namespace
}  // namespace flyball::covariance_test
