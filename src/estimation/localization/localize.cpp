#include <flyball/estimation/localization/localize.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/estimation/localization/landmark_filter.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "estimation/localization/drive_log.hpp"

namespace flyball {

using localization::check_wanted;
using localization::Integrals;
using localization::span_of;

ErrorInfo error_info(LocalizationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"too_few_sightings", "no pose follows from the landmarks that were seen",
       ErrorKind::no_answer},
  };
  return detail::info_of(code, "localization", rows);
}

Expected<LocalizedPath> dead_reckon_landmarks(const LandmarkLog& log,
                                              const LandmarkOptions& options,
                                              const std::vector<double>& times,
                                              const Pose2d& start) {
  FLYBALL_CHECK(check_landmark_log(log, options));
  FLYBALL_CHECK(check_wanted(times, "dead_reckon_landmarks"));
  const Integrals integrals(log.odometry);
  LocalizedPath path;
  Pose2d pose = start;
  std::size_t next = 0;
  double before = times.empty() ? 0.0 : times.front();
  const auto go_on = [&](double to) {
    const auto a = integrals(before);
    const auto b = integrals(to);
    pose = pose * Pose2d::exp(Eigen::Vector3d(b.way - a.way, 0.0, b.turned - a.turned));
    before = to;
  };
  for (const double time : times) {
    while (next < log.odometry.size() && log.odometry[next].time <= time) {
      if (log.odometry[next].time > before) {
        go_on(log.odometry[next].time);
      }
      ++next;
    }
    go_on(time);
    path.time.push_back(time);
    path.pose.push_back(pose);
    path.covariance.push_back(Eigen::Matrix3d::Zero());
  }
  return path;
}

Expected<FilteredLandmarks> filter_landmarks(const LandmarkLog& log, const LandmarkOptions& options,
                                             const std::vector<double>& times,
                                             const std::optional<Pose2d>& start) {
  FLYBALL_CHECK(check_landmark_log(log, options));
  FLYBALL_CHECK(check_wanted(times, "filter_landmarks"));
  FLYBALL_TRY(LandmarkFilter filter, LandmarkFilter::create(options));
  FilteredLandmarks result;
  std::size_t odometry = 0;
  std::size_t sighting = 0;
  if (start && !filter.reset(*start)) {
    return refusal(ArgumentError::not_finite, "filter_landmarks", "the pose at the start")
        .got("an entry that is NaN, infinite or beyond 1e100")
        .expected("m and rad");
  }
  const auto take_until = [&](double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    for (;;) {
      const double moved = odometry < log.odometry.size() ? log.odometry[odometry].time : never;
      const double seen = sighting < log.sightings.size() ? log.sightings[sighting].time : never;
      if (!(std::min(moved, seen) <= time)) {
        return;
      }
      if (moved <= seen) {
        const OdometrySample& sample = log.odometry[odometry++];
        filter.odometry(sample.time, sample.velocity, sample.turn_rate);
        continue;
      }
      const Sighting& s = log.sightings[sighting++];
      const auto correction =
          filter.sighting(s.time, log.landmarks[s.landmark].position, s.range, s.bearing);
      result.weight.push_back(correction.accepted() ? correction.weight : 0.0);
      result.nis.push_back(correction.nis);
    }
  };
  const double first = span_of(log).first;
  for (const double time : times) {
    if (time < first) {
      continue;
    }
    take_until(time);
    if (filter.predict(time) && filter.located()) {
      result.path.time.push_back(time);
      result.path.pose.push_back(filter.pose());
      result.path.covariance.push_back(filter.pose_covariance());
    }
  }
  take_until(span_of(log).second);
  if (!filter.located()) {
    return refusal(LocalizationError::too_few_sightings, "filter_landmarks", "the sightings")
        .got(detail::format("{} sightings from which no pose follows", log.sightings.size()))
        .expected("at least four that agree, of two landmarks or more")
        .hint("give the pose at the start, or check that the sightings name the right landmarks");
  }
  result.calibration = filter.calibration();
  result.relocalizations = filter.relocalizations();
  return result;
}

}  // namespace flyball
