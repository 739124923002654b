#include <flyball/estimation/pose_estimator.hpp>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball::detail {

Expected<OutlierGuard> pose_guard(const PoseEstimatorOptions& options, double start) {
  const OdometryNoise& odometry = options.odometry;
  Checks checks("PoseEstimator");
  checks.finite(start, "start")
      .within(options.recover_after, 0.0, 1e9, "recover_after")
      .not_negative(options.recover_time.si(), "recover_time", "s")
      .within(options.least_ratio, 1.0, 1e12, "least_ratio");
  for (Eigen::Index i = 0; i < 3; ++i) {
    checks.not_negative(odometry.per_metre(i), "odometry.per_metre")
        .not_negative(odometry.per_radian(i), "odometry.per_radian")
        .not_negative(odometry.per_second(i), "odometry.per_second");
  }
  FLYBALL_CHECK(checks);
  return OutlierGuard::create({.treatment = options.treatment,
                               .probability = options.probability,
                               .freedom = options.freedom});
}

}  // namespace flyball::detail
