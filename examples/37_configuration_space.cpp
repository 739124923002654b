// The configuration space of an elevator with an arm, a path around what is forbidden, and its
// motion (chapter 16).
#include <cstdio>
#include <numbers>
#include <vector>

#include <flyball/planning/configuration/path_motion.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

int main() {
  using namespace flyball;
  constexpr double pi = std::numbers::pi;
  //! [space]
  auto space = ConfigurationSpace::create(
                   {{.name = "arm", .unit = "rad", .low = -0.75 * pi, .high = 0.75 * pi},
                    {.name = "elevator", .unit = "m", .low = 0.0, .high = 5.0}})
                   .value();
  // Pointing down, the arm needs the elevator 2 m up.
  const bool known =
      space.forbid("chassis", Region::box({-pi / 4, 0.0}, {pi / 4, 2.0})).has_value();

  const std::vector<double> x{-1.0, 0.5};
  const std::vector<double> r{1.0, 0.5};
  const MoveCheck straight = space.check_move(x, space.difference(x, r));
  //! [space]
  std::printf("straight ahead: stopped by the %s at %.3f of the way\n", straight.constraint.c_str(),
              straight.at);

  //! [path]
  // Tracking may be off by 0.05 rad and 5 cm: plan where that is still valid.
  const std::vector<double> error{0.05, 0.05};
  const auto path = plan_path(space.with_buffer(error).value(), x, r).value();
  //! [path]
  for (const auto& waypoint : path.waypoints) {
    std::printf("  %7.4f rad  %6.4f m\n", waypoint[0], waypoint[1]);
  }

  //! [motion]
  PathMotionOptions options{
      .limits = {{.velocity = 3.0, .acceleration = 10.0}, {.velocity = 2.0, .acceleration = 6.0}},
      .error = error};
  const auto along = move_along(space, path.waypoints, options).value();
  options.traversal = Traversal::sequential;
  const auto onwards = move_along(space, path.waypoints, options).value();
  //! [motion]
  std::printf("along the lines %.3f s, on as soon as it is safe %.3f s\n", along.duration,
              onwards.duration);
  return known && path.waypoints.size() == 4 && onwards.duration <= along.duration ? 0 : 1;
}
