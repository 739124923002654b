#pragma once

#include <flyball/study/localize.hpp>

namespace flyball::study {

/// What speaks against a path that was found, as diagnostics of severity error: another sense or
/// unit that the log fits clearly better, constants and relocalizations that contradict the
/// odometry, a truth far beyond the path's own covariance.
void notice_doubts(const LandmarkOptions& options, const std::optional<Pose2d>& start,
                   LocalizeResult& result);

}  // namespace flyball::study
