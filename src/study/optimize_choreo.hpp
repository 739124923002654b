#pragma once

#include <array>
#include <string_view>

#include <flyball/study/optimize.hpp>

/// Choreo's files as tasks, and back.
namespace flyball::study {

/// Choreo's name of a constraint.
struct ChoreoKind {
  std::string_view name;
  DriveConstraintKind kind;
};
inline constexpr std::array choreo_kinds{
    ChoreoKind{"StopPoint", DriveConstraintKind::stop_point},
    ChoreoKind{"MaxVelocity", DriveConstraintKind::max_velocity},
    ChoreoKind{"MaxAcceleration", DriveConstraintKind::max_acceleration},
    ChoreoKind{"MaxAngularVelocity", DriveConstraintKind::max_angular_velocity},
    ChoreoKind{"PointAt", DriveConstraintKind::point_at},
    ChoreoKind{"KeepInCircle", DriveConstraintKind::keep_in_circle},
    ChoreoKind{"KeepInRectangle", DriveConstraintKind::keep_in_rectangle},
    ChoreoKind{"KeepInLane", DriveConstraintKind::keep_in_lane},
    ChoreoKind{"KeepOutCircle", DriveConstraintKind::keep_out_circle}};

/// Whether a name is one of Choreo's.
[[nodiscard]] bool is_choreo(const std::string& path);
/// @errors as optimize_job.
[[nodiscard]] ExpectedAll<OptimizeJob> choreo_job(const std::string& path);
/// The task's file with what was found; made anew where there is none.
[[nodiscard]] ChoreoTrajectory choreo_of(const OptimizeTask& task, const DriveSolution& solution);
/// The project that its trajectories stand beside; of 2024, whose projects hold them, with what was
/// found. Made anew where the job has none. What is not known of is kept.
[[nodiscard]] Expected<ChoreoProject> choreo_project_of(const OptimizeResult& result);
/// A motor's limits as Choreo says them.
[[nodiscard]] ChoreoConfig config_of(const DriveModel& model, double gearing, double radius);

}  // namespace flyball::study
