#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/estimation/localization/wheel_log.hpp>

namespace flyball::study {

/// A robot's drive among landmarks.
struct LocalizeJob {
  /// Files, or a folder of them: which is which is told by their names (see `localize`).
  std::vector<std::string> paths;
  std::string robot{};  ///< A part of the names of one robot's files, where there are several.
  std::optional<std::array<double, 3>> start{};  ///< x, y (m) and heading (rad) where it begins.
  LandmarkFilterMethod filter = LandmarkFilterMethod::extended;
  std::optional<double> range_std{};    ///< m
  std::optional<double> bearing_std{};  ///< rad
  /// m, about how far apart the left and the right wheels are: of wheels without a gyro.
  std::optional<double> track_width{};
  bool calibrate = true;  ///< Whether scales, offsets and the delay are found, too.
  bool smooth = true;     ///< Whether the smoother runs beside the filter.
};

/// How far a path is from the truth.
struct PathError {
  std::size_t points = 0;
  double rms = 0.0, median = 0.0, worst = 0.0;  ///< m
  double heading_rms = 0.0;                     ///< rad
  /// Mean of eᵀ P⁻¹ e of the position, over its two entries: 1 where the covariance is true.
  double nees = 0.0;
};

/// What a drive's log says.
struct LocalizeResult {
  LandmarkFilterMethod method = LandmarkFilterMethod::extended;
  std::vector<std::string> files{};  ///< That were read.
  LandmarkLog log{};
  std::size_t other_sightings = 0;  ///< Of marks whose place is not known, such as other robots.
  LocalizedPath odometry{};         ///< From the first pose of the filter (or smoother).
  FilteredLandmarks filter{};
  std::optional<SmoothedLandmarks> smoother{};
  std::optional<TrackWidth> track_width{};  ///< By the smoother, of a log of wheels.
  LocalizedPath truth{};                    ///< Empty where there is none.
  std::optional<PathError> odometry_error{}, filter_error{}, smoother_error{};
  std::vector<Diagnostic> diagnostics{};
};

/// Where a robot was: from odometry, sightings of landmarks by range and bearing, and a map.
///
/// Files are tables of numbers (blanks, tabs or commas; lines of '#'), told by words in their
/// names, as in the UTIAS data sets: "odometry" (time, speed, turn rate) or in its place "wheel"
/// (time, left, right, how far they have come) and where there is one "gyro" (time, turn rate),
/// "measurement" or "sighting" (time, landmark or its barcode, range, bearing), "landmark" (number,
/// x, y), and where there are any "barcode" (number, barcode) and "truth" (time, x, y, heading),
/// with which the paths are compared.
/// @errors FileError, LogError with file and line; ArgumentError for files that are missing or
///         ambiguous and for the log's contents; LocalizationError, FactorGraphError.
/// Source: Leung et al., "The UTIAS multi-robot cooperative localization and mapping dataset", IJRR
/// 30 (2011).
[[nodiscard]] Expected<LocalizeResult> localize(const LocalizeJob& job);

/// "extended", "unscented" or "invariant".
[[nodiscard]] std::string_view name_of(LandmarkFilterMethod method) noexcept;

/// Path, calibration, map, residuals, and data to plot. Schema "flyball.localize/1".
[[nodiscard]] Answer answer_of(const LocalizeResult& result);

}  // namespace flyball::study
