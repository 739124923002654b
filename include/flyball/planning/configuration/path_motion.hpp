#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/planning/configuration/path_planner.hpp>
#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

/// How waypoints are gone through.
enum class Traversal {
  /// All axes along the straight lines of the path, each from rest to rest.
  synchronized,
  /// Each waypoint is aimed at from wherever the mechanism is, as soon as the straight line there
  /// and the motion itself are proven free; it does not stop where it need not.
  sequential,
};

/// What is asked of a motion along a path.
struct PathMotionOptions {
  std::vector<MotionLimits> limits{};  ///< One an axis.
  Traversal traversal = Traversal::synchronized;
  double period = 0.02;  ///< s, between two rows of the table; > 0.
  std::vector<double>
      error{};  ///< By how much an axis may be off its reference; empty: not at all.
};

/// A motion along a path.
struct PathMotion {
  TimeSeries
      table{};  ///< Each period, then the end: of each axis position, velocity, acceleration.
  double duration = 0.0;           ///< s
  std::vector<double> arrivals{};  ///< s, when each waypoint is aimed away from.
  /// The least clearance of the reference over all rows, in shares of the axes' scale, without the
  /// buffer.
  double clearance = 0.0;
  double clearance_time = 0.0;  ///< s, when it is that near.
};

/// Times a path: profiles of all axes, synchronized, that keep their limits and, with the error
/// that tracking may have, every constraint along the whole motion.
///
/// Along the lines of a path the moves themselves are judged; off them, where the sequential
/// traversal cuts a corner, the motion is followed by conservative advancement: over a time h an
/// axis goes at most |v| h + a h²/2.
/// @param space  Without a buffer: `error` is taken from it.
/// @param path   Its waypoints; two or more.
/// @errors ArgumentError: sizes, limits that are not positive, more than a million rows;
///         ConfigurationError::in_collision, blocked_move with the constraint, if the path does not
///         keep the buffer.
/// Source: book, section 16.3.
[[nodiscard]] Expected<PathMotion> move_along(const ConfigurationSpace& space,
                                              std::span<const std::vector<double>> path,
                                              const PathMotionOptions& options);

}  // namespace flyball
