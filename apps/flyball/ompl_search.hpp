#pragma once

#include <span>

#include <flyball/core/expected.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

namespace flyball::app {

/// A path by OMPL's RRT-Connect, if the command is built with it: its trees, our judgement of
/// moves, along their whole length. @param search  Its seed, seconds and whether detours are taken
/// out.
/// @errors ConfigurationError::undecided; ArgumentError::out_of_range where it is built without
/// OMPL.
[[nodiscard]] Expected<ConfigurationPath> plan_by_ompl(const ConfigurationSpace& space,
                                                       std::span<const double> start,
                                                       std::span<const double> goal,
                                                       const PathSearch& search);

}  // namespace flyball::app
