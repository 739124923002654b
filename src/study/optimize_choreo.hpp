#pragma once

#include <flyball/study/optimize.hpp>

/// Choreo's files as tasks, and back.
namespace flyball::study {

/// Whether a name is one of Choreo's.
[[nodiscard]] bool is_choreo(const std::string& path);
/// @errors as optimize_job.
[[nodiscard]] ExpectedAll<OptimizeJob> choreo_job(const std::string& path);
/// The task's file with what was found; made anew where there is none.
[[nodiscard]] ChoreoTrajectory choreo_of(const OptimizeTask& task, const DriveSolution& solution);
/// A motor's limits as Choreo says them.
[[nodiscard]] ChoreoConfig config_of(const DriveModel& model, double gearing, double radius);

}  // namespace flyball::study
