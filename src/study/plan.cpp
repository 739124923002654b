#include <flyball/study/plan.hpp>

#include <utility>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::study {

Expected<PlanResult> plan(const PlanJob& job, PathBackEnd ompl) {
  PlanResult result{.job = job};
  // The ends are told of without the buffer first: what breaks a constraint, then what is too near.
  FLYBALL_CHECK(job.space.check(job.start, "plan", "the start"));
  FLYBALL_CHECK(job.space.check(job.goal, "plan", "the goal"));
  FLYBALL_TRY(ConfigurationSpace tight, job.space.with_buffer(job.motion.error));
  FLYBALL_CHECK(tight.check(job.start, "plan", "the start, with the tracking error,"));
  FLYBALL_CHECK(tight.check(job.goal, "plan", "the goal, with the tracking error,"));
  if (job.ompl && ompl == nullptr) {
    return refusal(ArgumentError::out_of_range, "plan", "the method ompl")
        .got("asked of a program without OMPL")
        .expected("one of Flyball's own");
  }
  FLYBALL_TRY(result.path, job.ompl ? ompl(tight, job.start, job.goal, job.search)
                                    : plan_path(tight, job.start, job.goal, job.search));
  if (job.has_limits) {
    FLYBALL_TRY(result.motion, move_along(job.space, result.path.waypoints, job.motion));
    PathMotionOptions other = job.motion;
    other.traversal = other.traversal == Traversal::synchronized ? Traversal::sequential
                                                                 : Traversal::synchronized;
    FLYBALL_TRY(const PathMotion motion, move_along(job.space, result.path.waypoints, other));
    result.other_duration = motion.duration;
  }
  return result;
}

}  // namespace flyball::study
