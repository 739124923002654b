#pragma once

#include <string>

#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/simulation/characterization.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/motors.hpp>

/// Results as the studies give them, from a simulated mechanism each.
namespace flyball::report {

using mechanisms::MechanismKind;

inline study::DesignJob design_job(MechanismKind kind, bool kA_determined = true) {
  study::DesignJob job;
  job.plant.kind = kind;
  job.plant.unit = std::string(mechanisms::position_unit(kind));
  job.plant.kA_determined = kA_determined;
  switch (kind) {
    case MechanismKind::flywheel:
    case MechanismKind::roller:
    case MechanismKind::swerve_drive:
      job.plant.gains = {.kS = 0.2, .kV = 0.02, .kA = 0.004};
      break;
    case MechanismKind::elevator:
      job.plant.gains = {.kS = 0.15, .kV = 4.0, .kA = 0.3, .kG = 0.6};
      job.plant.drum_radius = 0.0254;
      job.plant.gearing = 10.0;
      break;
    case MechanismKind::arm:
      job.plant.gains = {.kS = 0.1, .kV = 1.2, .kA = 0.15, .kG = 0.65, .angle_offset = 0.2};
      break;
    case MechanismKind::turret:
    case MechanismKind::swerve_steer:
      job.plant.gains = {.kS = 0.1, .kV = 1.2, .kA = 0.15};
      break;
  }
  if (!kA_determined) {
    job.plant.kA_upper_bound = 2.0 * job.plant.gains.kA;
    job.plant.gains.kA = 0.0;
  }
  job.controller.delay = 0.015;
  return job;
}

inline study::DesignResult design_result(MechanismKind kind, bool kA_determined = true) {
  return study::design(design_job(kind, kA_determined)).value();
}

inline CharacterizationOptions session(MechanismKind kind) {
  CharacterizationOptions options;
  const mechanisms::FeedforwardGains gains = design_job(kind).plant.gains;
  options.mechanism = kind;
  options.kS = gains.kS;
  options.kV = gains.kV;
  options.kA = gains.kA;
  options.kG = gains.kG;
  options.angle_offset = gains.angle_offset;
  if (kind == MechanismKind::elevator) {
    options.resolution = 1e-4;
    options.travel_low = 0.0;
    options.travel_high = 2.0;
  } else {
    options.resolution = 6.283185307179586 / 4096.0;
  }
  return options;
}

/// An identification of a recording that was simulated, named as if it came from `path`.
inline study::IdentifyResult identify_result(const identification::Recording& recording,
                                             const std::string& path = "logs/lift.wpilog",
                                             const std::string& subject = "lift") {
  recording::LoadedRecording source;
  source.path = path;
  source.format = "WPILOG";
  source.subject = subject;
  source.recording = recording;
  source.diagnostics = {{"assumed", Severity::info, "angles are taken as radians"},
                        {"repeated_rows", Severity::warning, "3 of 4 rows repeat the last value"}};
  study::IdentifyResult result{std::move(source), identification::identify_feedforward(recording),
                               recording.mechanism.value(), recording.unit};
  return result;
}

inline study::IdentifyResult identify_result(MechanismKind kind) {
  return identify_result(record_characterization(session(kind)).value());
}

/// A recording of a mechanism that did not move, so that the fit is refused.
inline study::IdentifyResult refused_result() {
  identification::Recording recording =
      record_characterization(session(MechanismKind::elevator)).value();
  for (identification::TestRun& run : recording.runs) {
    run.position.assign(run.time.size(), 0.5);
    run.velocity.assign(run.time.size(), 0.0);
  }
  return identify_result(recording);
}

/// The same result with a kA that the log leaves open.
inline study::IdentifyResult without_kA(study::IdentifyResult result) {
  identification::GainEstimate& kA = result.report.fit->kA;
  kA.determined = false;
  kA.upper_bound = 0.0371;
  kA.reason = "the speed-up is over within two rows";
  return result;
}

inline study::TuneResult tune_result(MechanismKind kind, bool kA_determined = true) {
  study::IdentifyResult identification = identify_result(kind);
  if (!kA_determined) {
    identification = without_kA(std::move(identification));
  }
  study::DesignJob job = design_job(kind, kA_determined);
  if (!kA_determined) {
    job.plant.kA_reason = identification.report.fit->kA.reason;
  }
  return {std::move(identification), study::design(job)};
}

}  // namespace flyball::report
