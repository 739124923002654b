#include <flyball/study/tune.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <flyball/core/progress.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

/// The fit's covariance with the standard errors that are told, which a comparison of logs may have
/// widened; of those alone, one that is right for any correlation of the two.
PlantSpread spread_of(const identification::FeedforwardFit& fit) {
  const auto& joint = fit.joint_covariance;
  // The delay is that of the column that the loop is closed over.
  const std::array<std::size_t, 3> rows{0, 1, controls_velocity(fit.mechanism) ? 3u : 2u};
  const std::array<double, 2> told{fit.kV.standard_error / fit.kV.value,
                                   fit.kA.standard_error / fit.kA.value};
  PlantSpread spread;
  if (!(joint[0][0] > 0.0) || !(joint[1][1] > 0.0)) {
    spread.covariance.diagonal() << 2.0 * told[0] * told[0], 2.0 * told[1] * told[1], 0.0;
    return spread;
  }
  Eigen::Vector3d wider = Eigen::Vector3d::Ones();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto row = rows[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < 3; ++j) {
      spread.covariance(i, j) = joint[row][rows[static_cast<std::size_t>(j)]];
    }
    if (i < 2) {
      wider(i) = std::max(1.0, told[static_cast<std::size_t>(i)] / std::sqrt(joint[row][row]));
    }
  }
  spread.covariance = wider.asDiagonal() * spread.covariance * wider.asDiagonal();
  return spread;
}

}  // namespace

PlantDescription plant_from_fit(const identification::FeedforwardFit& fit) {
  PlantDescription plant;
  plant.kind = fit.mechanism;
  plant.unit = fit.unit;
  // A gain that cannot be told from zero is designed with as zero.
  const auto known = [](const identification::GainEstimate& gain) {
    return gain.determined ? gain.value : 0.0;
  };
  plant.gains.kS = known(fit.kS);
  plant.gains.kV = fit.kV.value;
  plant.gains.kA = known(fit.kA);
  plant.kA_determined = fit.kA.determined;
  plant.kA_upper_bound = fit.kA.determined ? 0.0 : fit.kA.upper_bound;
  plant.kA_reason = fit.kA.determined ? "" : fit.kA.reason;
  if (fit.kA.determined) {
    plant.spread = spread_of(fit);
  }
  plant.gains.kG = fit.kG ? known(*fit.kG) : 0.0;
  if (fit.gravity_with_friction) {
    plant.gains.kS = fit.kS.value;
    plant.gains.kG = fit.kG->value;
  }
  plant.gains.angle_offset = fit.angle_offset ? known(*fit.angle_offset) : 0.0;
  return plant;
}

namespace {

/// A job for the loop that a fit's sensors and gains call for.
DesignJob loop_job(const DesignJob& said, const identification::FeedforwardFit& fit) {
  DesignJob job = said;
  job.plant = plant_from_fit(fit);
  job.plant.motor = said.plant.motor;
  job.plant.gearing = said.plant.gearing;
  job.plant.drum_radius = said.plant.drum_radius;
  const bool velocity_loop = controls_velocity(fit.mechanism);
  if (!job.controller.delay) {
    // A sensor cannot show the future; a negative delay is skew between the logger's channels.
    job.controller.delay = std::max(0.0, velocity_loop ? fit.velocity_delay : fit.position_delay);
  } else if (job.plant.spread) {
    job.plant.spread->covariance.row(2).setZero();  // It is said, not seen.
    job.plant.spread->covariance.col(2).setZero();
  }
  const double seen_noise = velocity_loop ? fit.velocity_noise : fit.position_noise;
  if (!job.estimator.measurement_std && seen_noise > 0.0) {
    job.estimator.measurement_std = seen_noise;
  }
  return job;
}

DriveDesign design_drive(const DesignJob& said, const identification::DriveFit& fit) {
  DriveDesign drive;
  const auto mode = [&](const std::optional<identification::FeedforwardFit>& of, const char* name) {
    std::optional<ExpectedAll<DesignResult>> made;
    if (of) {
      DesignJob job = loop_job(said, *of);
      job.plant.name = name;
      made = design(job);
    }
    return made;
  };
  drive.linear = mode(fit.linear, "drivetrain, straight on");
  drive.angular = mode(fit.angular, "drivetrain, turning");
  const auto gain = [](const std::optional<ExpectedAll<DesignResult>>& of) {
    return of && *of ? std::optional((*of)->paste.front().kP) : std::nullopt;
  };
  const auto linear = gain(drive.linear);
  const auto angular = gain(drive.angular);
  drive.kP =
      linear && angular ? std::min(*linear, *angular) : linear.value_or(angular.value_or(0.0));
  if (linear && angular) {
    const double own = 0.5 * (*linear + *angular);
    const double other = 0.5 * (*linear - *angular);
    drive.K = Eigen::Matrix2d{{own, other}, {other, own}};
  }
  return drive;
}

}  // namespace

ExpectedAll<TuneResult> tune(const TuneJob& job) {
  tell_progress("reads and identifies the log");
  IdentifyJob identification = job.identification;
  identification.said = job.design.plant;
  FLYBALL_TRY(auto identified, identify(identification));
  TuneResult result{.identification = std::move(identified)};
  if (result.identification.drive && result.identification.drive->fit) {
    tell_progress("designs and simulates the loops of both motions");
    result.drive = design_drive(job.design, *result.identification.drive->fit);
    return result;
  }
  if (!result.identification.report.fit) {
    return result;
  }
  const identification::FeedforwardFit& fit = *result.identification.report.fit;

  DesignJob design_job = loop_job(job.design, fit);
  if (!controls_velocity(fit.mechanism) && design_job.sensor.resolution == 0.0) {
    design_job.sensor.resolution = result.identification.report.prepared.position_quantum;
  }
  tell_progress("designs and simulates the loop");
  result.design = design(design_job);
  return result;
}

}  // namespace flyball::study
