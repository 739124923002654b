#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/log.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/drivetrain.hpp"
#include "recording/recorded_motion.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

using identification::TestRun;
using mechanisms::MechanismKind;

namespace {

/// The tests of a mechanism, or of a drivetrain's left side.
std::vector<TestRun> runs_of(const SysIdJson& sysid) {
  std::vector<TestRun> runs;
  for (const SysIdJson::Run& run : sysid.runs) {
    if (const auto kind = identification::parse_test_kind(run.name)) {
      runs.push_back({*kind, run.time, run.voltage, run.position, run.velocity});
    }
  }
  return runs;
}

std::vector<TestRun> right_runs_of(const SysIdJson& sysid) {
  std::vector<TestRun> runs;
  for (const SysIdJson::Run& run : sysid.runs) {
    if (const auto kind = identification::parse_test_kind(run.name)) {
      runs.push_back({*kind, run.time, run.right_voltage, run.right_position, run.right_velocity});
    }
  }
  return runs;
}

GyroColumns gyro_of(const SysIdJson& sysid) {
  GyroColumns gyro;
  for (const SysIdJson::Run& run : sysid.runs) {
    if (identification::parse_test_kind(run.name)) {
      gyro.heading.push_back(run.angle);
      gyro.rate.push_back(run.angle_rate);
    }
  }
  return gyro;
}

/// Whether a log is to be read as a drivetrain's: what the person says has the last word.
Expected<bool> is_drive(const Log& log, const LogSelection& selection,
                        std::vector<Diagnostic>& notes) {
  const SysIdJson& sysid = *log.sysid;
  if (selection.drivetrain && !sysid.is_drive()) {
    return refusal(RecordingError::no_channel, log.source, "the right side")
        .got("missing: rows of 4 columns have one voltage, position and velocity")
        .expected("rows of a drivetrain, with both sides")
        .hint("record it with the drivetrain's project, or identify it as --mechanism flywheel");
  }
  if (sysid.is_drive() && selection.mechanism) {
    warn(notes, "mechanism_overruled",
         "the log is a drivetrain's; as said, its left side is taken for the {}'s",
         to_string(*selection.mechanism));
  }
  return sysid.is_drive() && !selection.mechanism;
}

/// What SysId multiplied its rows with. Angles have but one number of units a rotation; a file that
/// says another (1, mostly) holds rotations, or values that the robot had scaled already: the first
/// of the two with which the mechanism's speed is one that such a mechanism has.
double units_per_row(const SysIdJson& sysid, std::optional<double> ratio,
                     std::optional<MechanismKind> kind, const RecordedUnit& unit,
                     std::vector<Diagnostic>& notes) {
  const double said = sysid.units_per_rotation.value_or(1.0);
  const double of_rotations = full_turn / unit.factor;
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
  FLYBALL_TRY(const bool drive, is_drive(log, selection, loaded.diagnostics));
  if (drive) {
    loaded.recording.runs = both_sides(std::move(loaded.recording.runs), right_runs_of(sysid));
  }
  std::optional<MechanismKind> kind = selection.mechanism;
  const auto said = mechanisms::parse_mechanism_kind(sysid.test);
  if (said && !drive) {
    tell_said_kind(loaded.diagnostics, "the log says", *said, kind);
    kind = kind ? kind : std::optional(*said);
  }
  if (selection.no_velocity) {
    leave_velocity_out(loaded.recording);
  }
  if (!drive && !(kind && position_unit(*kind) == "m")) {
    std::size_t leaps = 0;
    for (TestRun& run : loaded.recording.runs) {
      leaps += unwrap_turns(run.position);
    }
    tell_unwrapped(loaded.diagnostics, leaps);
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
    units.position = drive ? likely_way_unit(loaded.recording.runs, ratio)
                           : likely_angle_unit(loaded.recording.runs, ratio, kind);
    units.velocity = unit_of_text(units.position.text, true, UnitSource::assumed);
    tell_assumed_unit(loaded.diagnostics, units.position);
  }
  // SysId's own scale turns rows into its unit; what angles of a drum or a wheel are in metres it
  // is not.
  const bool rolled =
      (kind == MechanismKind::elevator || kind == MechanismKind::swerve_drive || drive) &&
      !units.position.linear;
  const double metres = rolled ? selection.scale : scale;
  FLYBALL_TRY_IN(
      log.source, auto output,
      drive ? drive_scale(units.position, metres) : output_scale(units.position, metres, kind));
  if (rolled) {
    output.factor *= scale / selection.scale;
  }
  loaded.recording.mechanism = kind;
  FLYBALL_TRY(loaded, in_si(std::move(loaded), units, output, selection.voltage_scale));
  return drive ? as_drive(std::move(loaded), gyro_of(sysid)) : loaded;
}

}  // namespace flyball::recording
