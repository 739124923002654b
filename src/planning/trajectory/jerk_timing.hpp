#pragma once

#include <memory>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/trajectory/path_trajectory.hpp>

#include "planning/trajectory/cell_rows.hpp"
#include "planning/trajectory/motion_limit.hpp"

namespace flyball::detail {

/// What is asked of a motion whose jerk is limited.
struct JerkEnds {
  double first = 0.0;      ///< x at the start of the path.
  double last = 0.0;       ///< x at its end.
  double tolerance = 0.0;  ///< As of `time_optimal`.
  bool travels = false;    ///< Whether accelerations are continuous along the plane alone.
};

/// The fastest motion under limits of jerks beside all others, by convex programs one after the
/// other (`JerkRows`), each about the motion of the one before it. From stop to stop: there the
/// acceleration vanishes, and d³s/dt³ is constant in the first and the last interval.
/// @param limits  Of velocities and accelerations. @param all  The same limits with their jerks.
/// @param coarse, motion  The fastest motion without limits of jerks.
/// @errors ArgumentError::out_of_range where no motion was found.
[[nodiscard]] Expected<std::vector<PathTrajectory::Span>> jerk_limited(
    const Path& path, CellRows& limits, const std::vector<std::unique_ptr<MotionLimit>>& all,
    const std::vector<TimingCell>& coarse, const std::vector<Bezier2>& motion,
    const JerkEnds& ends);

}  // namespace flyball::detail
