#pragma once

#include <optional>
#include <vector>

#include <flyball/estimation/localization/landmark_log.hpp>
#include <flyball/geometry/se2.hpp>

namespace flyball {

/// Why a robot cannot be localised.
enum class LocalizationError {
  too_few_sightings,  ///< Not even one pose follows from the landmarks that were seen.
};
[[nodiscard]] ErrorInfo error_info(LocalizationError code);

/// A path with the uncertainty of each of its poses.
struct LocalizedPath {
  std::vector<double> time{};                 ///< s
  std::vector<Pose2d> pose{};                 ///< One a time.
  std::vector<Eigen::Matrix3d> covariance{};  ///< Of each pose's error, in its own frame.
};

/// What a filter made of a log.
struct FilteredLandmarks {
  /// At the wanted times from the first at which there is a pose; only the past counts.
  LocalizedPath path{};
  std::vector<double> weight{};  ///< What each sighting counted for, 0 … 1; 0: left out.
  std::vector<double> nis{};     ///< Its νᵀ S⁻¹ ν, of two degrees of freedom; 0 before the start.
  SensorCalibration calibration{};
  int relocalizations = 0;
};

/// What all of a log together says.
struct SmoothedLandmarks {
  LocalizedPath path{};      ///< At the wanted times; the past and the future count.
  std::vector<bool> used{};  ///< Whether a sighting is in it.
  std::vector<double>
      distance{};  ///< √(rᵀ R⁻¹ r) of each sighting, as multiple of what is assumed.
  SensorCalibration calibration{};
  SensorCalibration calibration_std{};
  Eigen::Matrix<double, SensorCalibration::size, SensorCalibration::size> calibration_covariance{};
  double optimality = 0.0;  ///< As FactorGraphResult's.
  bool converged = false;
  int iterations = 0;
  Eigen::Index unknowns = 0;
};

/// The path by odometry alone. @param start  The pose at the first of the times.
[[nodiscard]] Expected<LocalizedPath> dead_reckon_landmarks(const LandmarkLog& log,
                                                            const LandmarkOptions& options,
                                                            const std::vector<double>& times,
                                                            const Pose2d& start);

/// The path by LandmarkFilter. @param times  s, do not fall; those before the log are left out.
/// @param start  The pose at the begin of the log; none: it is found from the sightings.
/// @errors As `check_landmark_log`; LocalizationError::too_few_sightings. Cost: linear; allocates.
[[nodiscard]] Expected<FilteredLandmarks> filter_landmarks(const LandmarkLog& log,
                                                           const LandmarkOptions& options,
                                                           const std::vector<double>& times,
                                                           const std::optional<Pose2d>& start = {});

/// The path and the calibration that fit all sightings and all odometry best: one sparse
/// least-squares problem over poses, odometry errors and the sensors' constants, begun at what the
/// filter found.
///
/// Sightings have a robust loss, those that the filter left out are taken where they fit the
/// result.
/// @param times  s, as `filter_landmarks`. @errors As `filter_landmarks`; FactorGraphError.
/// Cost: linear in the log's length, about ten decompositions; allocates.
/// Source: Dellaert, Kaess, "Factor graphs for robot perception" (2017).
[[nodiscard]] Expected<SmoothedLandmarks> smooth_landmarks(const LandmarkLog& log,
                                                           const LandmarkOptions& options,
                                                           const std::vector<double>& times,
                                                           const std::optional<Pose2d>& start = {});

}  // namespace flyball
