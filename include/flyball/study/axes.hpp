#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <flyball/planning/profiles/synchronized_motion.hpp>
#include <flyball/study/profile.hpp>

namespace flyball::study {

/// How many axes may move together.
inline constexpr std::size_t most_axes = 16;

/// Several axes that are to move together, each by an S-curve.
struct AxesJob {
  std::string path{};                ///< The file that it stands in, for what is said of it.
  std::vector<ProfileJob> axes{};    ///< With their names.
  std::string synchronize = "time";  ///< "time": they arrive at once; "phase": along a line.
  Time least{0.0};                   ///< They take at least so long.
  Time period{0.02};
};

/// What an axis does.
struct AxisResult {
  std::string name{};
  std::string unit{};  ///< "m" or "rad"
  MotionLimits limits{};
  MotionState from{};
  MotionState to{};
  double alone = 0.0;  ///< s, of its own fastest motion.
  double peak_velocity = 0.0;
  double peak_acceleration = 0.0;
  /// Where its jerk changes, s, from 0 on.
  std::vector<double> changes{};
};

/// What became of it.
struct AxesResult {
  AxesJob job{};
  std::vector<AxisResult> axes{};
  double duration = 0.0;  ///< s, of all.
  int slowest = -1;       ///< The axis that all wait for; -1: none alone decides it.
  bool in_phase = false;  ///< They move along a straight line.
  TimeSeries table{};     ///< Each period, then the end: of each axis its three columns.
  TimeSeries curve{};     ///< The same for a picture, finer.
};

/// A job of a TOML file of tables [[axis]] with a profile's keys, and [profile] with
/// `synchronize`, `least` and `period`.
/// @param given  Options of the command line, which go before the file's values.
/// @errors ProjectError and ArgumentError, all of the file with their places; FileError.
[[nodiscard]] ExpectedAll<AxesJob> axes_job(const std::string& path,
                                            std::span<const Override> given);

/// The same of a text. @param path  What the text is called in errors.
[[nodiscard]] ExpectedAll<AxesJob> axes_job_of(std::string_view text, const std::string& path,
                                               std::span<const Override> given);

/// Plans and tabulates it.
/// @errors ArgumentError: an axis without limits, numbers that no profile takes, more than a
///         million rows, more than sixteen axes.
/// Source: book, section 15.1.
[[nodiscard]] Expected<AxesResult> plan_axes(const AxesJob& job);

/// Table, pictures, CSV and a C++ header of the table. Schema "flyball.axes/1".
[[nodiscard]] Answer answer_of(const AxesResult& result);

}  // namespace flyball::study
