#pragma once

#include <vector>

#include <flyball/planning/drive/drive_problem.hpp>

#include "planning/drive/check_drive.hpp"
#include "planning/drive/drive_transcription.hpp"

/// What limits are drawn tighter by where they are exceeded between two points of the mesh.
namespace flyball::drive_margins {

/// Adds to the margins of both ends of each interval what is exceeded in it, and a tenth.
///
/// At a waypoint that fixes where the robot stands, an area gives no more than the room there is;
/// no limit gives more than half of itself.
/// @param keep_to  Shares of limits that may be exceeded.
/// @return whether anything was exceeded.
bool tighten(const DriveProblem& problem, const drive_transcription::Layout& layout,
             const std::vector<DriveSample>& samples, const drive_check::Excesses& excesses,
             double keep_to, drive_transcription::Margins& margins);

}  // namespace flyball::drive_margins
