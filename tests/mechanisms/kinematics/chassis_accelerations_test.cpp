#include <flyball/mechanisms/kinematics/chassis_accelerations.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/kinematics/saturation.hpp>

namespace flyball::mechanisms::chassis_accelerations_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;
using Eigen::Vector3d;

template <std::size_t N>
std::array<Vector2d, N> random_places(Random& random) {
  std::array<Vector2d, N> places;
  for (auto& r : places) {
    r = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)};
  }
  return places;
}

Vector3d random_three(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

/// A smooth motion of the speeds in the robot's frame.
ChassisSpeeds speeds_at(double t, const Vector3d& start, const Vector3d& rate) {
  return ChassisSpeeds::from(start + t * rate);
}

// The derivatives of what inverse kinematics gives along a motion, by differences of fourth order.
template <std::size_t N>
void expect_derivatives(Random& random) {
  const auto kinematics = swerve_kinematics(random_places<N>(random)).value();
  const Vector3d start = random_three(random, 4.0);
  const Vector3d rate = random_three(random, 5.0);
  const ChassisSpeeds speeds = ChassisSpeeds::from(start);
  const auto accelerations = ChassisAccelerations::from_rates(speeds, rate);
  EXPECT_LE((accelerations.rates(speeds) - rate).norm(), 1e-14 * 40.0);
  const auto modules = kinematics.modules(speeds);
  const auto rates = module_rates(kinematics, modules, accelerations, speeds.omega);
  for (std::size_t i = 0; i < N; ++i) {
    if (modules[i].speed < 0.3) {
      continue;  // the differences are poor there
    }
    const double h = 1e-4;
    const auto at = [&](double t) { return kinematics.modules(speeds_at(t, start, rate))[i]; };
    const auto slope = [&](const auto& f) {
      return (8.0 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12.0 * h);
    };
    EXPECT_NEAR(rates[i].acceleration, slope([&](double t) { return at(t).speed; }), 1e-8);
    const auto turned = [&](double t) {
      return (at(t).angle * modules[i].angle.inverse()).angle();
    };
    EXPECT_NEAR(rates[i].steer_rate, slope(turned), 1e-7);
  }
  // Forward of inverse is the identity; of modules driven backward too.
  auto backward = modules;
  for (std::size_t i = 0; i < N; i += 2) {
    backward[i] = {-modules[i].speed, modules[i].angle * Rotation2d(std::numbers::pi)};
  }
  for (const auto& driven : {modules, backward}) {
    const auto back = chassis_accelerations(
        kinematics, driven, module_rates(kinematics, driven, accelerations, speeds.omega),
        speeds.omega);
    EXPECT_LE((back.vector() - accelerations.vector()).norm(), 1e-12 * (1.0 + rate.norm()) * 40.0);
  }
}

TEST(ChassisAccelerations, OfSwerveModules) {
  Random random(114);
  for (int trial = 0; trial < 100; ++trial) {
    expect_derivatives<3>(random);
    expect_derivatives<4>(random);
    expect_derivatives<6>(random);
    expect_derivatives<8>(random);
  }
}

// Turning on the spot at ω each wheel goes round a circle: ω² r towards the middle, no rates. A
// robot that goes straight while it turns steers its modules at -ω.
TEST(ChassisAccelerations, SecondOrderTerms) {
  const auto kinematics =
      swerve_kinematics(std::array{Vector2d(0.3, 0.3), Vector2d(0.3, -0.3), Vector2d(-0.3, 0.0)})
          .value();
  const auto spot = ChassisAccelerations{}.at(Vector2d(0.3, 0.0), 2.0);
  EXPECT_EQ(spot.ax, -1.2);
  EXPECT_EQ(spot.ay, 0.0);
  const ChassisSpeeds turning{0.0, 0.0, 2.0};
  for (const auto& rate : module_rates(kinematics, kinematics.modules(turning), {}, 2.0)) {
    EXPECT_NEAR(rate.acceleration, 0.0, 1e-15);
    EXPECT_NEAR(rate.steer_rate, 0.0, 1e-15);
  }
  const ChassisSpeeds straight{3.0, 0.0, 1e-9};
  for (const auto& rate : module_rates(kinematics, kinematics.modules(straight), {}, 1e-9)) {
    EXPECT_NEAR(rate.steer_rate, -1e-9, 1e-15);
  }
  // A held twist is an arc: v ω towards its middle.
  const auto arc = ChassisAccelerations::from_rates({3.0, 0.0, 2.0}, Vector3d::Zero());
  EXPECT_EQ(arc.vector(), Vector3d(0.0, 6.0, 0.0));
  const auto rates = module_rates(kinematics, kinematics.modules({3.0, 0.0, 2.0}), arc, 2.0);
  for (const auto& rate : rates) {
    EXPECT_NEAR(rate.acceleration, 0.0, 1e-14);
    EXPECT_NEAR(rate.steer_rate, 0.0, 1e-14);
  }
  // A module that stands has no steer rate.
  EXPECT_EQ(module_rates(kinematics, {}, {1.0, 2.0, 3.0}, 0.0)[0].steer_rate, 0.0);
}

TEST(ChassisAccelerations, OfFixedWheels) {
  Random random(115);
  const auto mecanum =
      mecanum_kinematics({Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}}).value();
  const auto differential = differential_kinematics(0.6_m).value();
  for (int trial = 0; trial < 100; ++trial) {
    const ChassisSpeeds speeds = ChassisSpeeds::from(random_three(random, 4.0));
    const ChassisAccelerations a = {random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
                                    random.uniform(-5.0, 5.0)};
    const Eigen::Vector4d wheels = wheel_accelerations(mecanum, a, speeds);
    const Eigen::Vector4d step =
        mecanum.wheels(ChassisSpeeds::from(speeds.vector() + a.rates(speeds))) -
        mecanum.wheels(speeds);
    EXPECT_LE((wheels - step).norm(), 1e-12);
    EXPECT_LE((chassis_accelerations(mecanum, wheels, speeds).vector() - a.vector()).norm(), 1e-12);
    // Forward at 3 m/s, turning at 2 rad/s: 6 m/s² to the left that no wheel shows.
    const auto arc = chassis_accelerations(differential, Vector2d(0.0, 0.0), {3.0, 0.0, 2.0});
    EXPECT_EQ(arc.vector(), Vector3d(0.0, 6.0, 0.0));
  }
}

}  // namespace
}  // namespace flyball::mechanisms::chassis_accelerations_test
