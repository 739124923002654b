// Followers of a pose (sections 8.7 to 8.9): a differential drive that starts beside its path comes
// back to it by Ramsete, by the time-varying unicycle regulator, by the regulator of its whole
// state and by pure pursuit, within 12 V.
#include <cmath>
#include <cstdio>
#include <vector>

#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/control/followers/ramsete.hpp>
#include <flyball/mechanisms/drivetrain/pose_drive.hpp>
#include <flyball/systems/model_step.hpp>

using namespace flyball;
using namespace flyball::literals;
using State = Eigen::Vector<double, 5>;  // x, y, heading, left and right velocity

int main() {
  constexpr Length trackwidth = 0.6_m;
  constexpr double width = trackwidth.si();
  const auto drive = mechanisms::differential_drive({.motor = mechanisms::neo(2),
                                                     .left_gearing = 8.0,
                                                     .right_gearing = 8.0,
                                                     .mass = 52_kg,
                                                     .wheel_radius = 2_in,
                                                     .trackwidth = trackwidth,
                                                     .moment_of_inertia = 6_kg_m2})
                         .value();
  const auto model = mechanisms::pose_drive(drive, trackwidth).value();  // (8.11)

  const std::vector<Pose2d> waypoints{{0.0, 0.0, 0.0}, {6.0, 2.0, 0.0}};
  const auto path = sample_path(quintic_spline(waypoints).value()).value();
  const auto trajectory = time_path(path, {.velocity = 2.5, .acceleration = 2.0}).value();

  //! [followers]
  const SpeedLimits limits{.wheel_velocity = 3.5, .trackwidth = width};
  const auto ramsete = RamseteFollower::create({.b = 2.0, .zeta = 0.7, .limits = limits}).value();
  const auto unicycle = LtvUnicycleFollower::create({.limits = limits}).value();
  const auto whole_state = LtvDriveFollower::create(drive, trackwidth).value();
  auto pursuit =
      PurePursuitFollower::create(path, {.velocity = 2.5, .acceleration = 2.0, .limits = limits})
          .value();
  // What makes voltages of the velocities that the others ask for.
  const auto tracker = DriveVelocityTracker::create(drive).value();
  //! [followers]

  bool all_arrive = true;
  const auto run = [&](const char* name, auto follower) {
    State x{0.0, 0.4, 0.6, 0.0, 0.0};
    int saturated = 0;
    for (double t = 0.0; t < trajectory.total_time() + 0.5; t += 0.02) {
      const DriveCommand command = follower(t, x);
      saturated += command.status == FollowerStatus::saturated ? 1 : 0;
      for (int i = 0; i < 4; ++i) {
        x = rk4(model, x, command.voltage, 0.005);
      }
    }
    const Eigen::Vector3d error =
        tracking_error({x(0), x(1), x(2)}, trajectory.points().back().pose);
    std::printf(
        "%-12s ends %5.1f cm ahead, %5.1f cm to the left, %5.2f deg; %d periods at limits\n", name,
        -100.0 * error(0), -100.0 * error(1), -57.3 * error(2), saturated);
    all_arrive = all_arrive && std::hypot(error(0), error(1)) < 0.1 && std::abs(error(2)) < 0.1;
  };
  const auto r_at = [&](double t) { return tracking_point(trajectory.sample(t)); };

  //! [speeds]
  // Velocities from the pose, voltages from the velocities.
  const auto by_speeds = [&](const auto& follower) {
    return [&](double t, const State& x) {
      const FollowerCommand command = follower.calculate({x(0), x(1), x(2)}, r_at(t));
      const Eigen::Vector2d sides = side_velocities(command.speeds, width);
      const Eigen::Vector2d change =
          side_velocities(r_at(t + 0.02).speeds, width) - side_velocities(r_at(t).speeds, width);
      return tracker.calculate(x.tail<2>(), sides, sides + change);
    };
  };
  //! [speeds]
  run("Ramsete", by_speeds(ramsete));
  run("LTV unicycle", by_speeds(unicycle));
  //! [voltages]
  // Voltages from the whole state.
  run("LTV drive", [&](double t, const State& x) {
    return whole_state.calculate({{x(0), x(1), x(2)}, x(3), x(4)}, drive_state(r_at(t), width),
                                 drive_state(r_at(t + 0.02), width));
  });
  //! [voltages]
  run("pure pursuit", [&](double, const State& x) {
    const FollowerCommand command = pursuit.calculate({x(0), x(1), x(2)});
    const Eigen::Vector2d sides = side_velocities(command.speeds, width);
    return tracker.calculate(x.tail<2>(), sides, sides);
  });
  return all_arrive ? 0 : 1;
}
