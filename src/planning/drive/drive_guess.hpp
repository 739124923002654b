#pragma once

#include <vector>

#include <flyball/planning/drive/drive_problem.hpp>

#include "planning/drive/drive_transcription.hpp"

/// Starts for the search of a drive trajectory.
namespace flyball::drive_guess {

/// A way to look: on which side of each obstacle, and how headings turn.
struct Choice {
  std::vector<int> sides{};  ///< Of each constraint: 1 left, -1 right, 0 no obstacle in the way.
  bool curved = true;        ///< Of what steers: along its headings, not straight.
  bool as_typed = false;     ///< Headings as they are given, not by the shorter turn.
};

/// Ways that differ, the likeliest first. @param most  At most so many.
[[nodiscard]] std::vector<Choice> choices(const DriveProblem& problem, int most);

/// A start: along the waypoints and around obstacles, with speeds that a heavy hand would drive.
/// @param intervals  Of each segment; where empty they are chosen and written.
[[nodiscard]] drive_transcription::Guess guess(const DriveProblem& problem, const Choice& choice,
                                               std::vector<int>& intervals);

}  // namespace flyball::drive_guess
