#include <flyball/control/followers/ltv_unicycle.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball::ltv_unicycle_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
using CrossTrack = LowSpeed::CrossTrack;

LtvUnicycleSettings of_book() {
  LtvUnicycleSettings settings{.velocity_tolerance = 0.95, .angular_velocity_tolerance = 0.95};
  settings.low_speed = {1e-9, CrossTrack::holds};
  return settings;
}

/// K of Theorem 8.9.1 the way it is printed: matrices, zero-order hold, Riccati equation.
Eigen::MatrixXd by_riccati(const LtvUnicycleSettings& s, double v) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  A(1, 2) = v;
  Eigen::Matrix<double, 3, 2> B = Eigen::Matrix<double, 3, 2>::Zero();
  B(0, 0) = B(2, 1) = 1.0;
  const auto plant = discretize_zoh(A, B, s.period).value();
  return lqr(plant.A, plant.B, bryson({s.x_tolerance, s.y_tolerance, s.heading_tolerance}),
             bryson({s.velocity_tolerance, s.angular_velocity_tolerance}))
      .value()
      .K;
}

// The gains of the book's script (frccontrol b0a237a, SciPy) where the reference has 0.63 and
// 3.5 m/s. Where it stands the script solves the equation at 1e-9 m/s and has 7.5712689 for k_y:
// SciPy's solution has five digits there. Doubling with 50 digits (mpmath) gives these.
TEST(LtvUnicycle, GainsOfTheBooksScript) {
  const auto follower = LtvUnicycleFollower::create(of_book()).value();
  const auto expect = [&](double v, double k_x, double k_y, double k_heading) {
    const auto K = follower.K(v);
    EXPECT_NEAR(K(0, 0), k_x, 1e-12 * k_x);
    EXPECT_NEAR(K(1, 1), k_y, 1e-12 * k_y) << v;
    EXPECT_NEAR(K(1, 2), k_heading, 1e-12 * k_heading) << v;
    EXPECT_EQ(K(0, 1), 0.0);
    EXPECT_EQ(K(0, 2), 0.0);
    EXPECT_EQ(K(1, 0), 0.0);
  };
  expect(0.0, 13.06418773951354, 7.5711748702876786, 0.37855876351438340);
  expect(0.63, 13.06418773951353, 7.366715543539016, 3.0688324864038203);
  expect(3.5, 13.06418773951354, 7.064817759800004, 7.041200426315726);
}

// The closed form is the Riccati equation's solution.
TEST(LtvUnicycle, ClosedFormIsTheRiccatiSolution) {
  Random random(5);
  const auto decade = [&](double low, double high) { return std::exp(random.uniform(low, high)); };
  for (int k = 0; k < 300; ++k) {
    LtvUnicycleSettings s{decade(-4.0, 1.0), decade(-4.0, 1.0), decade(-2.0, 3.0),
                          decade(-2.0, 2.0), decade(-2.0, 2.0), Time(decade(-6.0, -1.0))};
    s.low_speed = {1e-6, CrossTrack::holds};
    const double v = (k % 2 == 0 ? 1.0 : -1.0) * decade(-2.0, 2.0);
    const auto K = LtvUnicycleFollower::create(s).value().K(v);
    const Eigen::MatrixXd expected = by_riccati(s, v);
    ASSERT_LE((K - expected).norm(), 1e-8 * expected.norm()) << k << "\n" << K << "\n" << expected;
  }
}

// A tolerance that does not matter has no gain: with y out of the cost, the heading is an
// integrator of its own, k T = m/(√(m + m²/4) + m/2), m = (ω̄ T/θ̄)².
TEST(LtvUnicycle, InfiniteTolerances) {
  LtvUnicycleSettings s = of_book();
  s.y_tolerance = infinity;
  const auto K = LtvUnicycleFollower::create(s).value().K(2.0);
  EXPECT_EQ(K(1, 1), 0.0);
  const double m = std::pow(0.95 * 0.02 / 2.5, 2.0);
  EXPECT_NEAR(K(1, 2), m / (std::sqrt(m + m * m / 4.0) + m / 2.0) / 0.02, 1e-12);
  s.heading_tolerance = infinity;
  s.x_tolerance = infinity;
  EXPECT_EQ(LtvUnicycleFollower::create(s).value().K(2.0).norm(), 0.0);
}

// Below its speed the cross-track gain goes to zero, or stays; backwards it is negated.
TEST(LtvUnicycle, NearRest) {
  LtvUnicycleSettings s;
  s.low_speed = {0.2, CrossTrack::fades};
  const auto fading = LtvUnicycleFollower::create(s).value();
  s.low_speed.cross_track = CrossTrack::holds;
  const auto holding = LtvUnicycleFollower::create(s).value();
  const double full = fading.K(0.2)(1, 1);
  EXPECT_NEAR(fading.K(0.05)(1, 1), 0.25 * full, 1e-14);
  EXPECT_EQ(fading.K(0.0)(1, 1), 0.0);
  EXPECT_NEAR(fading.K(-0.05)(1, 1), -0.25 * full, 1e-14);
  EXPECT_EQ(fading.K(-0.2)(1, 1), -full);
  EXPECT_EQ(holding.K(0.0)(1, 1), full);
  EXPECT_EQ(holding.K(-1e-9)(1, 1), -full);
  EXPECT_EQ(fading.K(0.0)(1, 2), holding.K(0.1)(1, 2));
  EXPECT_EQ(fading.K(std::nan(""))(1, 1), 0.0);
}

TEST(LtvUnicycle, Errors) {
  const auto refused = [](auto change) {
    LtvUnicycleSettings s;
    change(s);
    const auto follower = LtvUnicycleFollower::create(s);
    return follower ? std::string() : to_string(follower.error());
  };
  EXPECT_EQ(refused([](auto& s) { s.y_tolerance = 0.0; }),
            "LtvUnicycleFollower: y_tolerance is 0 m; it must be greater than zero");
  EXPECT_EQ(refused([](auto& s) { s.heading_tolerance = 1e-30; }),
            "LtvUnicycleFollower: heading_tolerance is 1e-30 rad; it must be at least 1e-25 rad");
  EXPECT_NE(refused([](auto& s) { s.x_tolerance = std::nan(""); }), "");
  EXPECT_NE(refused([](auto& s) { s.velocity_tolerance = infinity; }), "");
  EXPECT_NE(refused([](auto& s) { s.angular_velocity_tolerance = -1.0; }), "");
  EXPECT_NE(refused([](auto& s) { s.period = Time(0.0); }), "");
  EXPECT_NE(refused([](auto& s) { s.low_speed.velocity = 0.0; }), "");
  EXPECT_NE(refused([](auto& s) { s.limits.angular_velocity = 0.0; }), "");
}

}  // namespace
}  // namespace flyball::ltv_unicycle_test
