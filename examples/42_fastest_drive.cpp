// The fastest way of a swerve drive around a post, and what is said where there is none (chapter
// 17).
#include <cmath>
#include <cstdio>

#include <flyball/planning/drive/optimize_drive.hpp>

int main() {
  using namespace flyball;
  using Eigen::Vector2d;

  //! [problem]
  DriveProblem problem;
  DriveModel& robot = problem.model;
  robot.mass = 54.0;
  robot.moment_of_inertia = 6.0;
  robot.wheels = {Vector2d(0.27, 0.27), Vector2d(0.27, -0.27), Vector2d(-0.27, 0.27),
                  Vector2d(-0.27, -0.27)};
  robot.max_force = 110.0;    // N, of a wheel: the limit of the current
  robot.stall_force = 240.0;  // N, and 5.2 m/s: the motor's line
  robot.free_speed = 5.2;
  robot.max_speed = 5.0;
  robot.friction = 1.1 * 54.0 * 9.80665 / 4.0;
  robot.corners = {Vector2d(0.42, 0.42), Vector2d(-0.42, 0.42), Vector2d(-0.42, -0.42),
                   Vector2d(0.42, -0.42)};
  problem.waypoints = {{.x = 1.5, .y = 1.5, .heading = 0.0, .stop = true},
                       {.x = 6.0, .y = 2.5, .heading = 1.57, .stop = true}};
  problem.constraints = {{.kind = DriveConstraintKind::keep_out_circle,
                          .from = 0,
                          .to = -1,
                          .x = 3.8,
                          .y = 2.2,
                          .radius = 0.3}};
  const auto found = optimize_drive(problem);
  //! [problem]
  if (!found || !found->solved) {
    std::fprintf(stderr, "%s\n", found ? found->message.c_str() : to_string(found.error()).c_str());
    return 1;
  }
  for (const DriveAttempt& attempt : found->attempts) {
    std::printf("%-48s %.4f s, %d iterations\n", attempt.name.c_str(), attempt.duration,
                attempt.iterations);
  }
  double worst = 0.0;
  for (const DriveViolation& v : found->violations) {
    worst = std::max(worst, v.share);
  }
  std::printf("%s: %.4f s; simulated, it misses waypoints by %.1e m and limits by %.1e\n",
              found->best.c_str(), found->duration, found->waypoint_error, worst);

  //! [contradiction]
  // A wall from side to side: what cannot be kept is named, and where.
  problem.constraints.push_back({.kind = DriveConstraintKind::keep_in_circle,
                                 .from = 1,
                                 .x = 2.0,
                                 .y = 2.0,
                                 .radius = 1.5,
                                 .name = "the starting zone"});
  const auto none = optimize_drive(problem);
  //! [contradiction]
  if (!none) {
    return 1;
  }
  std::printf("%s\n", none->message.c_str());
  const bool named = !none->relaxed.empty() && none->relaxed.front().name == "the starting zone";
  return worst < 1e-3 && found->waypoint_error < 1e-3 && !none->solved && named ? 0 : 1;
}
