#include <flyball/study/tune.hpp>

#include <algorithm>
#include <utility>

#include <flyball/core/progress.hpp>

#include "core/try.hpp"

namespace flyball::study {

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
  plant.gains.kG = fit.kG ? known(*fit.kG) : 0.0;
  if (fit.gravity_with_friction) {
    plant.gains.kS = fit.kS.value;
    plant.gains.kG = fit.kG->value;
  }
  plant.gains.angle_offset = fit.angle_offset ? known(*fit.angle_offset) : 0.0;
  return plant;
}

ExpectedAll<TuneResult> tune(const TuneJob& job) {
  tell_progress("reads and identifies the log");
  FLYBALL_TRY(auto identified, identify(job.identification));
  TuneResult result{.identification = std::move(identified), .design = std::nullopt};
  if (!result.identification.report.fit) {
    return result;
  }
  const identification::FeedforwardFit& fit = *result.identification.report.fit;
  std::vector<Diagnostic> more = contradictions(fit, job.design.plant);
  std::vector<Diagnostic>& told = result.identification.report.diagnostics;
  told.insert(told.end(), more.begin(), more.end());

  DesignJob design_job = job.design;
  PlantDescription plant = plant_from_fit(fit);
  plant.motor = job.design.plant.motor;
  plant.gearing = job.design.plant.gearing;
  plant.drum_radius = job.design.plant.drum_radius;
  design_job.plant = std::move(plant);

  const bool velocity_loop = fit.mechanism == mechanisms::MechanismKind::flywheel;
  const double seen_delay = velocity_loop ? fit.velocity_delay : fit.position_delay;
  if (!design_job.controller.delay) {
    // A sensor cannot show the future; a negative delay is skew between the logger's channels.
    design_job.controller.delay = std::max(0.0, seen_delay);
  }
  const double seen_noise = velocity_loop ? fit.velocity_noise : fit.position_noise;
  if (!design_job.estimator.measurement_std && seen_noise > 0.0) {
    design_job.estimator.measurement_std = seen_noise;
  }
  if (!velocity_loop && design_job.sensor.resolution == 0.0) {
    design_job.sensor.resolution = result.identification.report.prepared.position_quantum;
  }
  tell_progress("designs and simulates the loop");
  result.design = design(design_job);
  return result;
}

}  // namespace flyball::study
