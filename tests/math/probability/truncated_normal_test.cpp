#include <flyball/math/probability/truncated_normal.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace flyball::truncated_normal_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Case {
  double lower, upper, mean, variance;
};

// The closed forms in 120 digits (python's decimal): m = (φ(a) - φ(b))/Z,
// v = 1 + (a φ(a) - b φ(b))/Z - m², Z by the series of Φ below 12 and the continued fraction above.
TEST(TruncatedNormal, HasTheMomentsOfTheClosedForm) {
  const Case cases[] = {{0.0, infinity, 0.79788456080286541, 0.36338022763241867},
                        {-1.0, 2.0, 0.22963717909132897, 0.51976253921153392},
                        {3.0, 3.001, 3.000499749958379, 8.3333293043071519e-08},
                        {8.0, infinity, 8.1213681122361123, 0.014324883443340911},
                        {50.0, 51.0, 50.019984031905636, 0.00039904318680389957},
                        {1000.0, infinity, 1000.000999998, 9.9999400004999951e-07},
                        {-0.001, 40.0, 0.79724805005643307, 0.36359829863115872}};
  for (const Case& c : cases) {
    // The limits are those of the numbers, the width of (3, 3.001) not.
    const double loose = c.upper - c.lower < 0.1 ? 1e-11 : 1e-13;
    const Moments cut = truncated_normal(0.0, 1.0, c.lower, c.upper);
    EXPECT_NEAR(cut.mean, c.mean, 1e-14 * std::abs(c.mean)) << c.lower;
    EXPECT_NEAR(cut.variance, c.variance, 10.0 * loose * c.variance) << c.lower;
    // Mirrored, moved and stretched.
    const Moments other = truncated_normal(7.0, 4.0, 7.0 - 2.0 * c.upper, 7.0 - 2.0 * c.lower);
    EXPECT_NEAR(other.mean, 7.0 - 2.0 * c.mean, 1e-12 * (7.0 + std::abs(c.mean)));
    EXPECT_NEAR(other.variance, 4.0 * c.variance, 1e-9 * c.variance);
  }
}

TEST(TruncatedNormal, LimitsThatAreFarOrOneLeaveNothingToCut) {
  for (const double far : {9.5, 1e9, infinity}) {
    const Moments all = truncated_normal(2.0, 9.0, 2.0 - 3.0 * far, 2.0 + 3.0 * far);
    EXPECT_EQ(all.mean, 2.0);
    EXPECT_EQ(all.variance, 9.0);
  }
  const Moments point = truncated_normal(2.0, 9.0, 5.0, 5.0);
  EXPECT_EQ(point.mean, 5.0);
  EXPECT_EQ(point.variance, 0.0);
  // Ever farther in the tail: an exponential distribution's 1/a and 1/a².
  const Moments tail = truncated_normal(0.0, 1.0, 1e8, infinity);
  EXPECT_NEAR(tail.variance * 1e16, 1.0, 1e-12);
}

TEST(TruncatedNormal, WhatIsNoDistributionIsNoNumber) {
  for (const Moments m :
       {truncated_normal(0.0, 1.0, 1.0, 0.0), truncated_normal(nan, 1.0, 0.0, 1.0),
        truncated_normal(0.0, 0.0, 0.0, 1.0), truncated_normal(0.0, -1.0, 0.0, 1.0),
        truncated_normal(0.0, 1.0, nan, 1.0), truncated_normal(0.0, 1.0, infinity, infinity),
        truncated_normal(0.0, 1.0, -infinity, -infinity)}) {
    EXPECT_TRUE(std::isnan(m.mean) && std::isnan(m.variance));
  }
}

}  // namespace
}  // namespace flyball::truncated_normal_test
