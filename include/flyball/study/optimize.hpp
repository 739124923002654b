#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/io/motion/choreo.hpp>
#include <flyball/planning/drive/optimize_drive.hpp>

/// Time-optimal trajectories of a project or of Choreo's files.
namespace flyball::study {

struct Override;

/// Why a file holds nothing to optimise.
enum class OptimizeError {
  no_waypoints,   ///< A file of samples alone: what to pass is not said.
  no_robot,       ///< A trajectory whose robot is not said, and no project beside it.
  unknown_kind,   ///< A constraint that is not known.
  contradiction,  ///< Constraints that cannot all be kept.
  not_found,      ///< No start led to a trajectory.
};
[[nodiscard]] ErrorInfo error_info(OptimizeError code);

/// A trajectory to be found.
struct OptimizeTask {
  std::string name{};
  DriveProblem problem{};
  std::optional<double> given_duration{};  ///< s, of the one that the file holds.
  /// What is written again with the samples that are found; absent: a file of its own is made.
  std::optional<ChoreoTrajectory> file{};
  ChoreoConfig config{};  ///< The robot, for that file.
};

/// What is asked for.
struct OptimizeJob {
  std::string path{};
  std::vector<OptimizeTask> tasks{};
  DriveOptions options{};
  std::optional<ChoreoProject> project{};  ///< Choreo's, where the job is one.
  std::vector<Diagnostic> diagnostics{};
};

/// What was found, a solution a task.
struct OptimizeResult {
  OptimizeJob job{};
  std::vector<DriveSolution> solutions{};
  std::vector<Diagnostic> diagnostics{};
};

/// The job of a file: a project (TOML) with [drive] and [optimize]; Choreo's .traj, whose robot the
/// file itself or the .chor beside it says; Choreo's .chor: of 2024 all its paths, since then all
/// .traj files beside it.
/// @param overrides  Of a project's keys; of Choreo's files none.
/// @errors As `read_project`, `read_choreo_trajectory`, FileError; OptimizeError.
[[nodiscard]] ExpectedAll<OptimizeJob> optimize_job(const std::string& path,
                                                    std::span<const Override> overrides = {});

/// Finds them, one after the other, and tells its progress. @errors as `optimize_drive`.
/// Cost: some ten milliseconds a second of motion.
[[nodiscard]] Expected<OptimizeResult> optimize(const OptimizeJob& job);

/// Durations, what an independent simulation says, pictures, an animation, CSV, .traj files and
/// the .chor beside which Choreo opens them.
/// The refusal is there where a trajectory was not found. Schema "flyball.optimize/1".
[[nodiscard]] Answer answer_of(const OptimizeResult& result);
[[nodiscard]] std::string to_json(const OptimizeResult& result);

}  // namespace flyball::study
