#include <flyball/study/optimize.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <flyball/core/progress.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"

namespace flyball::study {

ErrorInfo error_info(OptimizeError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"no_waypoints", "the file does not say where to go", ErrorKind::misuse},
      {"no_robot", "nothing says what the robot is", ErrorKind::misuse},
      {"unknown_kind", "there is no such constraint", ErrorKind::misuse},
      {"contradiction", "the constraints cannot all be kept", ErrorKind::no_answer},
      {"not_found", "no trajectory was found", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "optimize", rows);
}

Expected<OptimizeResult> optimize(const OptimizeJob& job) {
  OptimizeResult result{.job = job, .diagnostics = job.diagnostics};
  for (std::size_t i = 0; i < job.tasks.size(); ++i) {
    const OptimizeTask& task = job.tasks[i];
    tell_progress("looks for the fastest trajectory", i, job.tasks.size());
    auto solution = optimize_drive(task.problem, job.options, [&](const DriveProgress& at) {
      if (job.tasks.size() == 1) {
        tell_progress("looks for the fastest trajectory", static_cast<std::size_t>(at.iteration));
      }
      return false;
    });
    if (!solution) {
      return tl::unexpected(
          std::move(solution).error().in(fmt::format("{}: {}", job.path, task.name)));
    }
    if (solution->solved && !solution->message.empty()) {
      warn(result.diagnostics, "between_points", "{}: {}", task.name, solution->message);
    }
    const auto& constraints = task.problem.constraints;
    const bool polygons =
        std::any_of(constraints.begin(), constraints.end(), [](const DriveConstraint& c) {
          return c.kind == DriveConstraintKind::keep_in_polygon ||
                 c.kind == DriveConstraintKind::keep_out_polygon;
        });
    if (solution->solved && polygons) {
      note(result.diagnostics, "not_in_choreo",
           "Choreo has no polygons: {}'s .traj is as they ask for, but they do not stand in it",
           task.name);
    }
    result.solutions.push_back(*std::move(solution));
  }
  return result;
}

}  // namespace flyball::study
