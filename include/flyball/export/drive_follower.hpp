#pragma once

#include <string>
#include <string_view>

#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/ramsete.hpp>

namespace flyball::exports {

/// A C++17 header, without Flyball, of the namespace `follower`: each period `calculate` takes the
/// pose and the sides' velocities, measured, and where the robot is to be, and answers the sides'
/// voltages,
///
///     Command calculate(pose, measured, reference, r, r_next) noexcept
///
/// with (v, ω) of the reference now and a period later. It is the law of the library's objects with
/// their limits and statuses, and gives their numbers to rounding; `follow` and `track` are the two
/// laws of a cascade. Neither allocates, throws nor keeps anything between periods.
/// @param origin  What it was made from, for a comment. @param trackwidth  m, > 0.
[[nodiscard]] std::string drive_follower_header(const RamseteFollower& follower,
                                                const DriveVelocityTracker& tracker,
                                                double trackwidth, std::string_view origin);
/// The same of the time-varying unicycle regulator, its gain in closed form.
[[nodiscard]] std::string drive_follower_header(const LtvUnicycleFollower& follower,
                                                const DriveVelocityTracker& tracker,
                                                double trackwidth, std::string_view origin);
/// The same of the time-varying drive regulator, its gain interpolated in the schedule whatever its
/// settings' source.
[[nodiscard]] std::string drive_follower_header(const LtvDriveFollower& follower,
                                                std::string_view origin);

}  // namespace flyball::exports
