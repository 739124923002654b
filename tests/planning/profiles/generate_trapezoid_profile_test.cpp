#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>

#include <limits>

#include <gtest/gtest.h>

namespace flyball::generate_trapezoid_profile_test {
namespace {

// Figure 15.1: max_v 7, 2 s to it, 50 m, at 50 ms; a = 3.5, cruise ends at 50/7 s, end 9.142857 s.
// The golden numbers are those that Snippet 15.1 draws (checkpoints of its three lines).
TEST(GenerateTrapezoidProfile, IsTheBooksFigure) {
  const auto profile = generate_trapezoid_profile(7.0, Time(2.0), Time(0.05), 50.0).value();
  const auto& x = *profile.find("position");
  const auto& v = *profile.find("velocity");
  const auto& a = *profile.find("acceleration");
  ASSERT_EQ(profile.rows(), 184u);
  EXPECT_DOUBLE_EQ(x[1], 0.00875);
  EXPECT_NEAR(x[23], 2.415, 1e-12);
  EXPECT_NEAR(x[92], 25.375000000000032, 1e-12);
  EXPECT_NEAR(x[160], 47.813750000000155, 1e-12);
  EXPECT_NEAR(x[183], 50.000000000000206, 1e-12);
  EXPECT_NEAR(v[23], 4.025000000000001, 1e-13);
  EXPECT_EQ(v[69], 7.0);
  EXPECT_NEAR(v[160], 4.000000000000073, 1e-12);
  EXPECT_EQ(v[183], 0.0);
  EXPECT_EQ(a[39], 3.5);
  EXPECT_EQ(a[40], 0.0);
  EXPECT_EQ(a[142], 0.0);
  EXPECT_EQ(a[143], -3.5);
  EXPECT_EQ(a[183], 0.0);
}

// Figures 2.3 and 6.9: as many rows as the book's scripts have.
TEST(GenerateTrapezoidProfile, HasTheBooksRows) {
  const auto elevator = generate_trapezoid_profile(0.5, Time(0.5), Time(0.005), 3.0).value();
  EXPECT_EQ(elevator.rows(), 1302u);
  EXPECT_NEAR((*elevator.find("position"))[325], 0.6887499999999964, 1e-13);
  EXPECT_NEAR(elevator.find("position")->back(), 3.0000000000000053, 1e-13);
  EXPECT_EQ(generate_trapezoid_profile(0.5, Time(0.5), Time(0.005), 1.04).value().rows(), 518u);
}

// goal < max_v time_to_max_v: a triangle with the peak sqrt(goal a), each side sqrt(goal/a) long.
TEST(GenerateTrapezoidProfile, IsATriangleWhenShort) {
  const auto profile = generate_trapezoid_profile(4.0, Time(2.0), Time(1e-3), 2.0).value();
  const auto& v = *profile.find("velocity");
  double peak = 0.0;
  for (const double velocity : v) {
    peak = std::max(peak, velocity);
  }
  EXPECT_NEAR(peak, 2.0, 2e-3 * 2.0);
  EXPECT_NEAR(profile.time().back(), 2.0, 1.5e-3);
  EXPECT_NEAR(profile.find("position")->back(), 2.0, 1e-9);
}

TEST(GenerateTrapezoidProfile, RefusesWhatMakesNoProfile) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto generate = [](double v, double ramp, double dt, double goal) {
    return generate_trapezoid_profile(v, Time(ramp), Time(dt), goal);
  };
  EXPECT_TRUE(generate(0.0, 1.0, 0.1, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(generate(1.0, -1.0, 0.1, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(generate(1.0, 1.0, 0.0, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(generate(1.0, 1.0, 0.1, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(generate(1.0, 1.0, 0.1, nan).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(generate(1.0, 1.0, 1e-9, 1e3).error().is(ArgumentError::out_of_range));
  EXPECT_EQ(generate(1.0, 1.0, 0.1, 0.0).value().rows(), 1u);
}

}  // namespace
}  // namespace flyball::generate_trapezoid_profile_test
