#pragma once

#include <optional>
#include <vector>

#include <flyball/estimation/localization/localize.hpp>

/// What the wheels and the gyro of a robot with two driven sides recorded, as odometry.
namespace flyball {

/// How far the wheels of both sides have come.
struct WheelSample {
  double time = 0.0;   ///< s
  double left = 0.0;   ///< m
  double right = 0.0;  ///< m
};

/// A gyro's reading.
struct TurnRateSample {
  double time = 0.0;       ///< s
  double turn_rate = 0.0;  ///< rad/s, counter-clockwise.
};

/// Both.
struct WheelLog {
  std::vector<WheelSample> wheels{};   ///< Times do not fall.
  std::vector<TurnRateSample> gyro{};  ///< The same; may be empty.
};

/// Speed (Δl + Δr)/2Δt and turn rate (Δr - Δl)/(track width · Δt) between each two readings of the
/// wheels (11.6.1); where there is a gyro its mean over that time in place of the wheels' turn
/// rate, held from one of its readings to the next.
/// @param track_width  m, what the turn rate of wheels alone is told with: what is known of it
///                     beforehand, since a fit finds `turn_scale`.
/// @errors ArgumentError: unordered times and what is not finite, with the row; too few rows; a
///         track width that is not positive where there is no gyro.
/// Cost: linear; allocates.
[[nodiscard]] Expected<std::vector<OdometrySample>> wheel_odometry(const WheelLog& log,
                                                                   double track_width);

/// A track width that was found.
struct TrackWidth {
  double value = 0.0;  ///< m
  double std = 0.0;    ///< m
};

/// The track width that a fit has found. Without a gyro it is velocity_scale/turn_scale times the
/// one of `wheel_odometry`; with one, the straight line of the wheels' difference over the path's
/// angle, second by second, times velocity_scale.
/// @return  None for a robot that never turned.
[[nodiscard]] std::optional<TrackWidth> track_width(const WheelLog& log, double assumed,
                                                    const SmoothedLandmarks& fit);

}  // namespace flyball
