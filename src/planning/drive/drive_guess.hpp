#pragma once

#include <vector>

#include <flyball/planning/drive/drive_problem.hpp>

#include "planning/drive/drive_transcription.hpp"
#include "planning/drive/drive_way.hpp"

/// Starts for the search of a drive trajectory.
namespace flyball::drive_guess {

using drive_way::Choice;

/// Ways that differ, the likeliest first: those whose start takes the least time and leaves areas
/// the least. @param most  At most so many.
[[nodiscard]] std::vector<Choice> choices(const DriveProblem& problem, int most);

/// A start: along the waypoints and around obstacles, with the speeds and forces that a heavy hand
/// would drive with.
/// @param intervals  Of each segment; where empty they are chosen and written, `parts` times an
///                   even number where the waypoint says none.
[[nodiscard]] drive_transcription::Guess guess(const DriveProblem& problem, const Choice& choice,
                                               std::vector<int>& intervals, int parts = 1);

/// A trajectory that was found, its intervals cut into `parts` each: a start that nearly keeps
/// its dynamics. @param intervals  Of the new one, written.
[[nodiscard]] drive_transcription::Guess finer(const DriveProblem& problem,
                                               const drive_transcription::Layout& layout,
                                               const optimization::OptimalControlSolution& found,
                                               int parts, std::vector<int>& intervals);

}  // namespace flyball::drive_guess
