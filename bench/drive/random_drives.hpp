#pragma once

#include <flyball/core/random.hpp>
#include <flyball/planning/drive/drive_problem.hpp>

namespace bench {

/// A drivetrain of any kind, two to six waypoints, and what Choreo's users draw around them:
/// discs and polygons to keep out of that no waypoint touches, a field, limits, a lane, a target
/// to look at. Every one can be driven.
[[nodiscard]] flyball::DriveProblem random_drive(flyball::Random& random);

}  // namespace bench
