#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/log.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/drivetrain.hpp"
#include "recording/recorded_motion.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

using identification::TestRun;
using mechanisms::MechanismKind;

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

std::vector<TestRun> runs_of(const SysIdJson& sysid) {
  std::vector<TestRun> runs;
  for (const SysIdJson::Run& run : sysid.runs) {
    if (const auto kind = identification::parse_test_kind(run.name)) {
      runs.push_back({*kind, run.time, run.voltage, run.position, run.velocity});
    }
  }
  return runs;
}

/// What SysId multiplied its rows with. Angles have but one number of units a rotation; a file that
/// says another (1, mostly) holds rotations, or values that the robot had scaled already: the first
/// of the two with which the mechanism's speed is one that such a mechanism has.
double units_per_row(const SysIdJson& sysid, std::optional<double> ratio,
                     std::optional<MechanismKind> kind, const RecordedUnit& unit,
                     std::vector<Diagnostic>& notes) {
  const double said = sysid.units_per_rotation.value_or(1.0);
  const double of_rotations = two_pi / unit.factor;
  if (unit.linear || std::abs(said / of_rotations - 1.0) < 0.01) {
    return said;
  }
  const double speed = speed_at_full_voltage(runs_of(sysid), ratio) * unit.factor;
  const bool as_said = has_usual_speed(kind, speed * said);
  const bool as_rotations = has_usual_speed(kind, speed * of_rotations);
  const bool rotations = !as_said && as_rotations;
  if (as_said && !as_rotations) {
    note(notes, "units_per_rotation",
         "the file says that a rotation is {:.4g} {}: its values are taken for {} already", said,
         unit.text, unit.text);
  } else {
    warn(notes, rotations ? "units_per_rotation" : "unit_assumed",
         "the file says that a rotation is {:.4g} {}, which is {:.4g}: its values are taken for {} "
         "(say what they are with --unit)",
         said, unit.text, of_rotations, rotations ? "rotations" : unit.text);
  }
  return rotations ? of_rotations : said;
}

}  // namespace

Expected<LoadedRecording> from_sysid_json(const Log& log, const LogSelection& selection,
                                          LoadedRecording loaded) {
  const SysIdJson& sysid = *log.sysid;
  loaded.subject = sysid.test;
  loaded.recording.runs = runs_of(sysid);
  if (sysid.is_drive()) {
    std::vector<Diagnostic> found = diagnose_drive(sysid);
    loaded.diagnostics.insert(loaded.diagnostics.end(), found.begin(), found.end());
    std::string defects;
    for (const Diagnostic& diagnostic : found) {
      if (diagnostic.severity != Severity::info) {
        defects += "; " + diagnostic.message;
      }
    }
    loaded.refusal = refusal(RecordingError::drivetrain, log.source)
                         .hint(
                             "its two sides cannot be identified as one mechanism, and drivetrains "
                             "are not supported yet" +
                             defects);
    return loaded;
  }
  std::optional<MechanismKind> kind = selection.mechanism;
  if (!kind && !sysid.test.empty()) {
    if (auto parsed = mechanisms::parse_mechanism_kind(sysid.test)) {
      kind = *parsed;
    }
  }
  if (selection.no_velocity) {
    leave_velocity_out(loaded.recording);
  }
  const std::optional<double> ratio = velocity_ratio(loaded.recording.runs);
  RecordedUnits units;
  FLYBALL_TRY_IN(log.source, units.position, said_unit(selection.unit, false));
  FLYBALL_TRY_IN(log.source, units.velocity, said_unit(selection.velocity_unit, true));
  double scale = selection.scale;
  if (!units.position.known() && !sysid.units.empty()) {
    FLYBALL_TRY_IN(log.source, units.position, said_unit(sysid.units, false));
    units.position.source = UnitSource::metadata;
    scale *= units_per_row(sysid, ratio, kind, units.position, loaded.diagnostics);
  }
  if (!units.velocity.known() && units.position.known() && selection.unit.empty()) {
    units.velocity = unit_of_text(units.position.text, true, UnitSource::name);
  }
  FLYBALL_TRY_IN(log.source, units, settle_units(units, ratio, loaded.diagnostics));
  if (!units.position.known()) {
    units.position = likely_angle_unit(loaded.recording.runs, ratio, kind);
    units.velocity = unit_of_text(units.position.text, true, UnitSource::assumed);
    tell_assumed_unit(loaded.diagnostics, units.position);
  }
  // SysId's own scale turns rows into its unit; what an elevator's angles are in metres it is not.
  const bool elevator_angles = kind == MechanismKind::elevator && !units.position.linear;
  FLYBALL_TRY_IN(log.source, auto output,
                 output_scale(units.position, elevator_angles ? selection.scale : scale, kind));
  if (elevator_angles) {
    output.factor *= scale / selection.scale;
  }
  loaded.recording.mechanism = kind;
  return in_si(std::move(loaded), units, output, selection.voltage_scale);
}

}  // namespace flyball::recording
