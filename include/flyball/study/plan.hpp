#pragma once

#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/planning/configuration/path_motion.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

namespace flyball::study {

/// A file that describes a configuration space and what is asked of it.
struct PlanJob {
  std::string path{};  ///< Of the file, for errors.
  ConfigurationSpace space;
  std::vector<double> start{};
  std::vector<double> goal{};
  PathSearch search{};
  PathMotionOptions motion{};
  bool ompl = false;        ///< Whether OMPL is to find it, in place of `search`'s method.
  bool has_limits = false;  ///< Whether every axis has limits, so that the path can be timed.
};

/// What became of it.
struct PlanResult {
  PlanJob job;
  ConfigurationPath path{};
  PathMotion motion{};  ///< Empty without limits.
  /// The motion of the other traversal takes so long, s; 0 without limits.
  double other_duration = 0.0;
};

/// What a command line puts in place of the file's values; empty: the file's.
struct PlanOverrides {
  std::string start{};  ///< As in the file, with commas: "-57 deg, 0.5 m".
  std::string goal{};
  std::string method{};
  std::string traversal{};
  std::string seed{};
  std::string seconds{};
};

/// Reads a space file (docs/plan-file.md).
/// @errors FileError; ProjectError and ArgumentError, each with file, line and column.
[[nodiscard]] ExpectedAll<PlanJob> plan_job(const std::string& path,
                                            const PlanOverrides& given = {});

/// A planner of someone else's: from start to goal, an entry an axis, by moves that are free.
using PathBackEnd = Expected<ConfigurationPath> (*)(const ConfigurationSpace& space,
                                                    std::span<const double> start,
                                                    std::span<const double> goal,
                                                    const PathSearch& search);

/// Plans, times and tabulates it.
/// @param ompl  What finds the path of a job that asks for OMPL; null: such a job is refused.
/// @errors ConfigurationError: an end in collision and with what, no path, undecided;
///         ArgumentError.
/// Source: book, chapter 16.
[[nodiscard]] Expected<PlanResult> plan(const PlanJob& job, PathBackEnd ompl = nullptr);

/// The path and its motion as tables and pictures: the space with the path, the motion in time, the
/// mechanism as it moves; CSV, a C++ header. Schema "flyball.plan/1".
[[nodiscard]] Answer answer_of(const PlanResult& result);

}  // namespace flyball::study
