#pragma once

#include <flyball/estimation/localization/wheel_log.hpp>
#include <flyball/study/localize.hpp>

/// A drive's files, told by words in their names.
namespace flyball::study {

/// What is in them.
struct Drive {
  WheelLog wheels{};  ///< Empty where the odometry is a file of its own.
  bool has_wheels = false;
};

/// Reads the files of a job into the result: its log, truth, files and diagnostics.
/// @errors As `localize`.
[[nodiscard]] Expected<Drive> read_drive(const LocalizeJob& job, LocalizeResult& result);

}  // namespace flyball::study
