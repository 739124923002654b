#include <flyball/systems/plane_curves.hpp>

#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace flyball::plane_curves_test {
namespace {

constexpr double pi = std::numbers::pi;

// ζ = -Re s/|s| along a ray, which is ln|z| over its distance from the origin of ln z; the ray of
// ζ = 0 is the half of the unit circle, and each ends at Im s = π/T where z is negative and real.
TEST(PlaneCurves, Damping) {
  const std::array<double, 4> ratios{0.0, 0.3, 0.7, 1.0};
  const double T = 0.05;
  const auto curves = damping_curves(ratios, Time(T), 50).value();
  ASSERT_EQ(curves.size(), 4U);
  for (const PlaneCurve& curve : curves) {
    ASSERT_EQ(curve.s.size(), 50U);
    EXPECT_EQ(curve.z.front(), 1.0);
    for (std::size_t k = 1; k < curve.s.size(); ++k) {
      EXPECT_NEAR(-curve.s[k].real() / std::abs(curve.s[k]), curve.value, 1e-14);
      const std::complex<double> back = std::log(curve.z[k]) / T;
      if (k + 1 < curve.s.size()) {
        EXPECT_NEAR(std::abs(back - curve.s[k]), 0.0, 1e-9);
      }
    }
    if (curve.value < 0.8) {
      EXPECT_NEAR(curve.s.back().imag(), pi / T, 1e-9);
      EXPECT_NEAR(curve.z.back().imag(), 0.0, 1e-12);
      EXPECT_LT(curve.z.back().real(), 0.0);
    }
  }
}

// |s| = ω_n along an arc, from the imaginary axis, or Nyquist's frequency, to the real one.
TEST(PlaneCurves, NaturalFrequency) {
  const std::array<double, 3> frequencies{1.0, 40.0, 100.0};
  const double T = 0.05;
  const auto curves = frequency_curves(frequencies, Time(T)).value();
  for (const PlaneCurve& curve : curves) {
    for (const auto& s : curve.s) {
      EXPECT_NEAR(std::abs(s) / curve.value, 1.0, 1e-14);
      EXPECT_LE(s.imag(), pi / T * (1.0 + 1e-12));
      EXPECT_LE(s.real(), 1e-12);
    }
    EXPECT_NEAR(curve.z.back().real(), std::exp(-curve.value * T), 1e-14);
    EXPECT_EQ(curve.z.back().imag(), 0.0);
  }
  EXPECT_NEAR(curves[0].s.front().real(), 0.0, 1e-15);
  EXPECT_NEAR(curves[2].s.front().imag(), pi / T, 1e-12);
}

TEST(PlaneCurves, Errors) {
  const std::array<double, 1> bad{1.5};
  const std::array<double, 1> zero{0.0};
  EXPECT_TRUE(damping_curves(bad, Time(0.1)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(frequency_curves(zero, Time(0.1)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(damping_curves(zero, Time(0.0)).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(damping_curves(zero, Time(0.1), 1).error().is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::plane_curves_test
