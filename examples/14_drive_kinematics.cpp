// From a robot's motion to its wheels and back (chapter 11): a differential and a swerve drive that
// turn while they move, and what a swerve drive makes of a wheel that slips.
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>
#include <flyball/mechanisms/kinematics/wheel_kinematics.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using namespace flyball::mechanisms;

  //! [differential]
  const auto differential = differential_kinematics(60_cm).value();
  const ChassisSpeeds motion{.vx = 2.0, .vy = 0.0, .omega = 1.0};
  const Eigen::Vector2d wheels = differential.wheels(motion);  // v ∓ ω r_b (11.3), (11.4)
  const ChassisSpeeds back = differential.chassis(wheels);
  //! [differential]
  std::printf("left %.2f m/s, right %.2f m/s, and back: %.2f m/s, %.2f rad/s\n", wheels(0),
              wheels(1), back.vx, back.omega);

  //! [swerve]
  const SwerveKinematics<4> swerve({{{0.3, 0.3}, {0.3, -0.3}, {-0.3, 0.3}, {-0.3, -0.3}}});
  const ChassisSpeeds sideways{.vx = 1.0, .vy = 0.5, .omega = 2.0};
  auto modules = swerve.modules(sideways);
  //! [swerve]
  for (const auto& module : modules) {
    std::printf("%.3f m/s at %7.2f deg\n", module.speed,
                module.angle.angle() * 180.0 / std::numbers::pi);
  }
  const ChassisSpeeds exact = swerve.chassis(modules);
  modules[0].speed *= 1.1;  // slips
  const ChassisSpeeds slipping = swerve.chassis(modules);
  std::printf("back: (%.3f, %.3f) m/s, %.3f rad/s; with a wheel that slips (%.3f, %.3f), %.3f\n",
              exact.vx, exact.vy, exact.omega, slipping.vx, slipping.vy, slipping.omega);
  return std::abs(back.vx - motion.vx) < 1e-12 && std::abs(exact.omega - sideways.omega) < 1e-12 &&
                 std::abs(slipping.omega - 2.0) > 1e-3
             ? 0
             : 1;
}
