#include <flyball/study/design_drive.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/drive_follower.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/drive_law.hpp"

namespace flyball::study {

namespace {

constexpr int steps = 16;  ///< From rest to the wheels' own speed.

double velocity_at(const DriveJob& job, int i) {
  return job.robot.free_speed(job.max_voltage) * i / steps;
}

Expected<void> add_ramsete(FollowerDesign& design, const DriveVelocityTracker& tracker) {
  const DriveJob& job = design.job;
  FLYBALL_TRY(const auto follower, RamseteFollower::create(ramsete_settings(job)));
  for (int i = 0; i <= steps; ++i) {
    const double v = velocity_at(job, i);
    const double k = 2.0 * job.zeta * std::sqrt(job.b) * v;
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(2, 3);
    K << k, 0.0, 0.0, 0.0, job.b * v, k;
    design.schedule.push_back({v, std::move(K)});
  }
  design.header = exports::drive_follower_header(follower, tracker, job.robot.trackwidth, job.path);
  return {};
}

Expected<void> add_unicycle(FollowerDesign& design, const DriveVelocityTracker& tracker) {
  const DriveJob& job = design.job;
  FLYBALL_TRY(const auto follower, LtvUnicycleFollower::create(ltv_unicycle_settings(job)));
  for (int i = 0; i <= steps; ++i) {
    const double v = velocity_at(job, i);
    design.schedule.push_back({v, Eigen::MatrixXd(follower.K(v))});
  }
  design.header = exports::drive_follower_header(follower, tracker, job.robot.trackwidth, job.path);
  return {};
}

Expected<void> add_ltv_drive(FollowerDesign& design) {
  const DriveJob& job = design.job;
  LtvDriveSettings settings = ltv_drive_settings(job);
  settings.source = GainSource::schedule;
  FLYBALL_TRY(const auto follower,
              LtvDriveFollower::create(design.model, Length(job.robot.trackwidth), settings));
  const auto velocities = follower.schedule_velocities();
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    design.schedule.push_back({velocities[i], Eigen::MatrixXd(follower.schedule()[i])});
  }
  design.schedule_error = follower.schedule_error();
  design.header = exports::drive_follower_header(follower, job.path);
  return {};
}

}  // namespace

Expected<FollowerDesign> design_follower(const DriveJob& job) {
  if (job.follower == DriveFollower::pure_pursuit) {
    return tl::unexpected(
        Error(ProjectError::wrong_value)
            .in(job.path)
            .about("drive.follower")
            .got("\"pure pursuit\"")
            .expected("a follower with gains: ramsete, ltv unicycle, ltv drive")
            .hint("pure pursuit has a lookahead and no gains; `flyball drive` simulates it"));
  }
  if (job.robot.kind != DriveKind::differential) {
    return tl::unexpected(Error(ProjectError::wrong_value)
                              .in(job.path)
                              .about("drive.type")
                              .got(fmt::format("\"{}\"", to_string(job.robot.kind)))
                              .expected("\"differential\"")
                              .hint("what moves in any direction has design_holonomic"));
  }
  FollowerDesign design{.job = job, .diagnostics = job.diagnostics};
  FLYBALL_TRY(design.model, differential_model(job.robot));
  FLYBALL_TRY(design.gains, mechanisms::drive_gains(design.model));
  FLYBALL_TRY(const auto tracker,
              DriveVelocityTracker::create(design.model, drive_tracker_settings(job)));
  design.A = tracker.inversion().A();
  design.B = tracker.inversion().B();
  design.K = tracker.K();
  // Half the sides' sum and half their difference are the modes of like sides.
  const auto mode = [](const Eigen::Matrix2d& M, double sign) { return M(0, 0) + sign * M(0, 1); };
  design.kP = std::min(mode(design.K, 1.0), mode(design.K, -1.0));
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    design.poles(i) = mode(design.A, sign) - mode(design.B, sign) * mode(design.K, sign);
  }
  switch (job.follower) {
    case DriveFollower::ramsete:
      FLYBALL_CHECK(add_ramsete(design, tracker));
      break;
    case DriveFollower::ltv_drive:
      FLYBALL_CHECK(add_ltv_drive(design));
      break;
    case DriveFollower::ltv_unicycle:
    case DriveFollower::holonomic:
    case DriveFollower::pure_pursuit:
      FLYBALL_CHECK(add_unicycle(design, tracker));
      break;
  }
  return design;
}

}  // namespace flyball::study
