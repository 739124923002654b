#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/recording/trajectory_file.hpp>

/// What all readers of a motion do at the end.
namespace flyball::recording {

/// Two samples or more, times that ascend. @errors TrajectoryFileError::too_few, time_order.
[[nodiscard]] Expected<void> check_samples(const RobotTrajectory& trajectory);

/// Its times begin at zero, and a diagnostic warns of velocities that tell of another motion than
/// the poses. @param trajectory  Checked.
void settle(RobotTrajectory& trajectory);

/// Accelerations are what the velocities change by, half from each side.
void differentiate_velocities(RobotTrajectory& trajectory);

}  // namespace flyball::recording
