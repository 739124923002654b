// A swerve drive at full speed that goes straight while it turns (section 11.7): desaturated after
// it was discretised it leaves its line, at once it does not; and setpoints that its modules can
// reach.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/geometry/se2.hpp>
#include <flyball/mechanisms/kinematics/saturation.hpp>
#include <flyball/mechanisms/kinematics/swerve_limiter.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using namespace flyball::mechanisms;

  const auto swerve =
      swerve_kinematics<4>({{{0.3, 0.3}, {0.3, -0.3}, {-0.3, 0.3}, {-0.3, -0.3}}}).value();
  constexpr double period = 0.02;
  constexpr double fastest = 4.5;                                  // m/s, of a module
  const ChassisSpeeds wanted{.vx = 5.0, .vy = 0.0, .omega = 6.0};  // in the field: too much

  // What wheels do that hold their states for a period: an arc.
  const auto after = [&](const Pose2d& pose, const SwerveKinematics<4>::Modules& modules) {
    return pose * Pose2d::exp(period * swerve.chassis(modules).vector());
  };

  Pose2d one_after_the_other;
  Pose2d at_once;
  for (int k = 0; k < 250; ++k) {  // 5 s
    const ChassisSpeeds before = wanted.to_robot(one_after_the_other.rotation());
    const auto slowed =
        desaturated(swerve.modules(held_twist(before, HeldFrame::field, period)), fastest);
    one_after_the_other = after(one_after_the_other, slowed.modules);

    //! [saturated]
    const ChassisSpeeds speeds = wanted.to_robot(at_once.rotation());
    const SaturatedMotion motion = saturated(swerve, speeds, HeldFrame::field, period, fastest);
    at_once = after(at_once, swerve.modules(motion.twist));
    //! [saturated]
  }
  std::printf("after 5 s, off the line: %.3f m desaturated afterwards, %.0e m at once\n",
              one_after_the_other.y(), std::abs(at_once.y()));

  //! [limiter]
  auto limiter = swerve_limiter(swerve,
                                {.max_speed = Velocity(fastest),
                                 .steer_rate = AngularVelocity(12.0),
                                 .acceleration = Acceleration(6.0)},
                                20_ms)
                     .value();
  double time = 0.0;
  while (limiter.update({.vx = 0.0, .vy = 3.0, .omega = 0.0}).progress < 1.0) {
    time += period;
  }
  //! [limiter]
  std::printf("from rest to 3 m/s to the left: %.2f s, the modules' quarter turn included\n", time);
  std::printf("each module: %.2f m/s at %.0f deg\n", limiter.last().modules[0].speed,
              limiter.last().modules[0].angle.angle() * 180.0 / std::numbers::pi);
  return std::abs(at_once.y()) < 1e-9 && std::abs(one_after_the_other.y()) > 0.1 && time < 0.8 ? 0
                                                                                               : 1;
}
