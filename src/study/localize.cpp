#include <flyball/study/localize.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/progress.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/localize_doubts.hpp"
#include "study/localize_files.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view in_localize = "localize";
constexpr double gyro_bias_std = 0.05;  // rad/s, 3 °/s: what cheap ones have before they are warm.

/// Constants that no sensor in m, s and rad has: a unit, a sense or a clock is wrong.
void notice_calibration(const SensorCalibration& found, const LandmarkOptions& options,
                        std::vector<Diagnostic>& diagnostics) {
  constexpr double far = 4.0;  // standard deviations of what is expected
  const auto value = found.vector();
  const auto mean = options.calibration.vector();
  const auto std = options.calibration_std.vector();
  for (int i = 0; i < SensorCalibration::size; ++i) {
    const std::string_view unit = SensorCalibration::name(i).unit;
    if (std(i) > 0.0 && std::abs(value(i) - mean(i)) > far * std(i)) {
      warn(diagnostics, "implausible_calibration",
           "{} was found to be {:.3g}{}{}, where {:.3g} ± {:.2g} is expected: look for a unit (a "
           "foot is 0.305 m, a degree 0.0175 rad), a sense of turning or two clocks",
           SensorCalibration::name(i).name, value(i), unit.empty() ? "" : " ", unit, mean(i),
           std(i));
    }
  }
}

PathError error_of(const LocalizedPath& path, const LocalizedPath& truth) {
  PathError error;
  std::vector<double> distances;
  double square = 0.0;
  double heading = 0.0;
  double nees = 0.0;
  std::size_t k = 0;
  for (std::size_t i = 0; i < path.time.size(); ++i) {
    while (truth.time[k] < path.time[i]) {
      ++k;
    }
    const Eigen::Vector3d e = truth.pose[k].minus(path.pose[i]);
    const double distance = (truth.pose[k].translation() - path.pose[i].translation()).norm();
    distances.push_back(distance);
    square += distance * distance;
    heading += e(2) * e(2);
    const Eigen::Matrix2d P = path.covariance[i].topLeftCorner<2, 2>();
    const double determinant = P(0, 0) * P(1, 1) - P(0, 1) * P(1, 0);
    if (determinant > 0.0) {
      nees += (P(1, 1) * e(0) * e(0) - 2.0 * P(0, 1) * e(0) * e(1) + P(0, 0) * e(1) * e(1)) /
              determinant;
    }
  }
  if (distances.empty()) {
    return error;
  }
  const auto n = static_cast<double>(distances.size());
  error.points = distances.size();
  error.rms = std::sqrt(square / n);
  error.heading_rms = std::sqrt(heading / n);
  error.nees = nees / n / 2.0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  error.median = *middle;
  error.worst = *std::max_element(distances.begin(), distances.end());
  return error;
}

/// Where the path is wanted: at the truth's times, or ten times a second.
std::vector<double> wanted_times(const LocalizeResult& result) {
  if (!result.truth.time.empty()) {
    return result.truth.time;
  }
  const double first = result.log.odometry.front().time;
  const double last = result.log.odometry.back().time;
  constexpr double step = 0.1;
  constexpr double most = 200000.0;
  const double count = std::min(std::floor((last - first) / step), most);
  std::vector<double> times;
  for (double k = 0.0; k <= count; k += 1.0) {
    times.push_back(first + (last - first) * (count > 0.0 ? k / count : 0.0));
  }
  return times;
}

}  // namespace

std::string_view name_of(LandmarkFilterMethod method) noexcept {
  switch (method) {
    case LandmarkFilterMethod::extended:
      return "extended";
    case LandmarkFilterMethod::unscented:
      return "unscented";
    case LandmarkFilterMethod::invariant:
      return "invariant";
  }
  return "";
}

Expected<LocalizeResult> localize(const LocalizeJob& job) {
  LocalizeResult result{.method = job.filter};
  FLYBALL_TRY(const Drive drive, read_drive(job, result));
  LandmarkOptions options{.method = job.filter};
  options.range_std = job.range_std.value_or(options.range_std);
  options.bearing_std = job.bearing_std.value_or(options.bearing_std);
  if (drive.has_wheels) {
    // Wheels are measured, not commanded: they lead nothing. Only a gyro has a bias.
    options.calibration.delay = 0.0;
    options.calibration_std.gyro_bias = drive.wheels.gyro.empty() ? 0.0 : gyro_bias_std;
  }
  if (!job.calibrate) {
    options.calibration = {};
    options.calibration_std =
        SensorCalibration::from(Eigen::Matrix<double, SensorCalibration::size, 1>::Zero());
  }
  std::optional<Pose2d> start;
  if (job.start) {
    start = Pose2d((*job.start)[0], (*job.start)[1], (*job.start)[2]);
  }
  const std::vector<double> times = wanted_times(result);
  tell_progress("filters the drive");
  FLYBALL_TRY(result.filter, filter_landmarks(result.log, options, times, start));
  if (job.smooth) {
    tell_progress("smooths the drive");
    auto smoothed = smooth_landmarks(result.log, options, times, start);
    if (!smoothed) {
      warn(result.diagnostics, "no_smoother", "the smoother has no answer: {}",
           to_string(smoothed.error()));
    } else {
      result.smoother = *std::move(smoothed);
      if (!result.smoother->converged) {
        warn(result.diagnostics, "not_converged",
             "the smoother ended before it had settled (optimality {:.1e}); its path may improve",
             result.smoother->optimality);
      }
      if (drive.has_wheels) {
        result.track_width =
            track_width(drive.wheels, job.track_width.value_or(0.0), *result.smoother);
      }
    }
  }
  notice_calibration(result.smoother ? result.smoother->calibration : result.filter.calibration,
                     options, result.diagnostics);
  const LocalizedPath& best = result.smoother ? result.smoother->path : result.filter.path;
  if (best.time.empty()) {
    return refusal(LocalizationError::too_few_sightings, in_localize, "the path")
        .got("no time of the odometry at which the pose is known")
        .expected("sightings that begin before the odometry ends");
  }
  FLYBALL_TRY(result.odometry,
              dead_reckon_landmarks(result.log, options, best.time, best.pose.front()));
  const auto left_out = static_cast<std::size_t>(
      std::count_if(result.filter.weight.begin(), result.filter.weight.end(),
                    [](double weight) { return weight == 0.0; }));
  constexpr double many = 0.1;
  if (static_cast<double>(left_out) > many * static_cast<double>(result.filter.weight.size())) {
    warn(result.diagnostics, "many_outliers",
         "the filter left out {} of {} sightings: landmarks that are taken for another, or moved",
         left_out, result.filter.weight.size());
  }
  if (result.filter.relocalizations > (start ? 0 : 1)) {
    warn(result.diagnostics, "carried_away",
         "the pose was found anew {} times: the robot was carried away, or its odometry failed",
         result.filter.relocalizations - (start ? 0 : 1));
  }
  if (!result.truth.time.empty()) {
    result.odometry_error = error_of(result.odometry, result.truth);
    result.filter_error = error_of(result.filter.path, result.truth);
    if (result.smoother) {
      result.smoother_error = error_of(result.smoother->path, result.truth);
    }
  }
  notice_doubts(options, start, result);
  return result;
}

}  // namespace flyball::study