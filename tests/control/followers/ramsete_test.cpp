#include <flyball/control/followers/ramsete.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/integration/fixed_step.hpp>

namespace flyball::ramsete_test {
namespace {

constexpr double pi = std::numbers::pi;

// By hand: the robot at the origin, the reference at (1, 2) and π/2 with v_d = 1, ω_d = 2; b = 2,
// ζ = 1/2. k = √(4 + 2) ; v = 0 + k·1; ω = 2 + k π/2 + 2·1·(1/(π/2))·2.
TEST(Ramsete, ByHand) {
  const auto follower = RamseteFollower::create({.b = 2.0, .zeta = 0.5}).value();
  const auto command = follower.calculate({}, {{1.0, 2.0, pi / 2.0}, {1.0, 0.0, 2.0}});
  const double k = std::sqrt(6.0);
  EXPECT_NEAR(command.speeds.vx, k, 1e-14);
  EXPECT_EQ(command.speeds.vy, 0.0);
  EXPECT_NEAR(command.speeds.omega, 2.0 + k * pi / 2.0 + 8.0 / pi, 1e-14);
  EXPECT_EQ(command.status, FollowerStatus::tracking);
}

// sinc(0) = 1, and near it nothing is lost.
TEST(Ramsete, SincIsSmooth) {
  const auto follower = RamseteFollower::create({.b = 1.0, .zeta = 0.5}).value();
  for (const double e : {0.0, 1e-300, 1e-9, 0.99e-4, 1.01e-4, 1e-3}) {
    const auto command = follower.calculate({}, {{0.0, 1.0, e}, {1.0, 0.0, 0.0}});
    const double sinc = e == 0.0 ? 1.0 : std::sin(e) / e;
    EXPECT_NEAR(command.speeds.omega, e + sinc, 5e-16) << e;
  }
}

/// A unicycle that moves as it is told, and its reference, for one step of RK4.
void move(const RamseteFollower& follower, Eigen::Vector<double, 6>& both, double v_d,
          double omega_d, double dt) {
  both = rk4(
      [&](const Eigen::Vector<double, 6>& at) {
        const auto command =
            follower.calculate({at(0), at(1), at(2)}, {{at(3), at(4), at(5)}, {v_d, 0.0, omega_d}});
        Eigen::Vector<double, 6> rate;
        rate << command.speeds.vx * std::cos(at(2)), command.speeds.vx * std::sin(at(2)),
            command.speeds.omega, v_d * std::cos(at(5)), v_d * std::sin(at(5)), omega_d;
        return rate;
      },
      both, dt);
}

// Theorem 8.8.1: along any run V does not grow, its rate is -k b e_x² - k e_θ², and the error
// vanishes. Starts: anywhere within 3 m, any heading; references: any constant v_d, ω_d.
TEST(Ramsete, LyapunovFunctionFalls) {
  Random random(11);
  for (int run = 0; run < 12; ++run) {
    const auto follower =
        RamseteFollower::create({.b = random.uniform(0.5, 4.0), .zeta = random.uniform(0.3, 0.9)})
            .value();
    const double v_d = (run % 2 == 0 ? 1.0 : -1.0) * random.uniform(0.5, 3.0);
    const double omega_d = random.uniform(-1.5, 1.5);
    Eigen::Vector<double, 6> both;
    both << random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(-pi, pi), 0.0, 0.0,
        0.0;
    constexpr double dt = 4e-3;
    const auto error = [&] {
      return tracking_error({both(0), both(1), both(2)}, {both(3), both(4), both(5)});
    };
    const TrackingPoint r{{}, {v_d, 0.0, omega_d}};
    double V = follower.lyapunov(error());
    const double V_0 = V;
    for (int k = 0; k < 5000; ++k) {
      const double turn = error()(2);
      // Simpson's rule over the step.
      double rate = follower.lyapunov_rate(error(), r);
      move(follower, both, v_d, omega_d, 0.5 * dt);
      rate += 4.0 * follower.lyapunov_rate(error(), r);
      move(follower, both, v_d, omega_d, 0.5 * dt);
      rate = (rate + follower.lyapunov_rate(error(), r)) / 6.0;
      const double after = follower.lyapunov(error());
      // At half a turn the error's angle may go over the edge, from π to -π.
      if (std::abs(turn) < 3.1) {
        ASSERT_LE(after, V + 1e-12 * V_0) << run << " at step " << k;
        ASSERT_NEAR((after - V) / dt, rate, 1e-4 * std::abs(rate) + 1e-9 * V_0);
      }
      V = after;
    }
    EXPECT_LT(V, 1e-3 * V_0) << run << ": v " << v_d << ", omega " << omega_d;
  }
}

// Section 8.8.3: with b in rad²/m² and ζ in 1/rad, each term has the unit of its side. Angles
// count: radians are compared, too.
TEST(Ramsete, DimensionalAnalysis) {
  const auto unit = [](const char* text) { return parse_si_unit(text).value().dimension; };
  const auto same = [](const SiDimension& a, const SiDimension& b) {
    return a.exponents == b.exponents;
  };
  const SiDimension b = unit("rad^2/m^2");
  const SiDimension zeta = unit("1/rad");
  const SiDimension v = unit("m/s");
  const SiDimension omega = unit("rad/s");
  const SiDimension angle = unit("rad");
  const SiDimension length = unit("m");
  const SiDimension sinc = unit("1") / angle;
  EXPECT_TRUE(same(power(omega, 2.0), b * power(v, 2.0)));
  const SiDimension k = zeta * power(power(omega, 2.0), 0.5);
  EXPECT_TRUE(same(k, unit("1/s")));
  EXPECT_TRUE(same(k * length, v));                              // (8.25)
  EXPECT_TRUE(same(k * angle, omega));                           // (8.26)
  EXPECT_TRUE(same(b * v * sinc * length, omega));               // (8.26)
  EXPECT_TRUE(same(b * power(length, 2.0), power(angle, 2.0)));  // V
}

TEST(Ramsete, Errors) {
  EXPECT_EQ(to_string(RamseteFollower::create({.b = 0.0}).error()),
            "RamseteFollower: b is 0 rad²/m²; it must be greater than zero");
  EXPECT_FALSE(RamseteFollower::create({.b = std::nan("")}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.b = 1e200}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.zeta = 1.5}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.zeta = -0.1}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.limits = {.velocity = -1.0}}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.limits = {.velocity = std::nan("")}}).has_value());
  EXPECT_FALSE(RamseteFollower::create({.limits = {.trackwidth = -0.1}}).has_value());
}

}  // namespace
}  // namespace flyball::ramsete_test
