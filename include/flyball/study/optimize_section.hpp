#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// [optimize]: where a drivetrain is to go as fast as it can, and what holds on the way.
struct OptimizeSection {
  std::vector<std::string>
      waypoints{};  ///< "x, y", "x, y, heading", with "stop", "moving", "guess".
  std::vector<std::string> keep_out{};  ///< "x, y, radius", or three corners "x, y" and more.
  std::vector<std::string> keep_in{};   ///< The same, or "x, y, width, height".
  std::vector<std::string> lanes{};     ///< "from, to, tolerance".
  std::vector<std::string> point_at{};  ///< "from, to, x, y, tolerance".
  std::optional<Velocity> max_velocity{};
  std::optional<Acceleration> max_acceleration{};
  std::optional<AngularVelocity> max_angular_velocity{};
  Time interval{0.04};    ///< Of the mesh.
  int attempts = 4;       ///< Starts that are tried.
  Time longest{120.0};    ///< That the way from a waypoint to the next may take.
  Time time_limit{60.0};  ///< Of the search for a trajectory.
};

}  // namespace flyball::study
