#include <utility>

#include <fmt/format.h>

#include <flyball/io/log.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/channels.hpp"
#include "recording/characterization_windows.hpp"
#include "recording/drivetrain.hpp"
#include "recording/recorded_motion.hpp"
#include "recording/recorded_voltage.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

using mechanisms::MechanismKind;

Expected<RecordedUnits> channel_units(const LogSelection& selection,
                                      const FoundChannels& channels) {
  RecordedUnits units;
  FLYBALL_TRY(units.position, said_unit(selection.unit, false));
  FLYBALL_TRY(units.velocity, said_unit(selection.velocity_unit, true));
  const auto by_channel = [](RecordedUnit& unit, const Signal* signal, bool rate) {
    if (!unit.known() && signal != nullptr) {
      unit = unit_of_text(signal->unit, rate, UnitSource::metadata);
      unit = unit.known() ? unit : unit_in_name(signal->name, rate);
    }
  };
  by_channel(units.position, channels.position, false);
  by_channel(units.velocity, selection.no_velocity ? nullptr : channels.velocity, true);
  return units;
}

Expected<LoadedRecording> from_channels(const Log& log, const LogSelection& selection,
                                        LoadedRecording loaded) {
  FLYBALL_TRY_IN(log.source, auto tests, find_tests(log, selection.state_channel));
  loaded.subject = tests.subject;
  if (const std::string reason = drivetrain_reason(log, tests, selection); !reason.empty()) {
    if (!selection.drivetrain && lower(reason).find("swerve") != std::string::npos) {
      return refusal(RecordingError::drivetrain, log.source, "mechanism")
          .got("a swerve drive: " + reason)
          .expected("one of its motions, or a drivetrain of a left and a right side")
          .hint(
              "say which the tests drive, --mechanism \"swerve drive\" or --mechanism \"swerve "
              "steer\", and a module's channels by --voltage, --position and --velocity if it "
              "asks for them; if it is a left and a right side, say --mechanism drivetrain");
    }
    return drive_from_channels(log, selection, std::move(tests), std::move(loaded))
        .map_error([&](Error error) {
          return selection.drivetrain ? error
                                      : std::move(error).with(
                                            "taken for a drivetrain (else say --mechanism "
                                            "flywheel, elevator, arm, …)",
                                            reason);
        });
  }

  FLYBALL_TRY_IN(log.source, auto channels,
                 find_channels(log, tests, selection, loaded.diagnostics));
  Signal volts = *channels.voltage;
  const double one = selection.voltage_scale != 1.0 ? selection.voltage_scale
                                                    : volts_a_unit(volts.unit, volts.name);
  for (double& value : volts.value) {
    value *= one;
  }
  channels.voltage = &volts;
  if (tests.windows.empty()) {
    tests.windows = split_by_voltage(*channels.voltage);
    if (tests.windows.empty()) {
      return refusal(RecordingError::no_tests, log.source, channels.voltage->name)
          .got("never driven, and no channel names the running test")
          .hint("record the voltage that was applied, or name the channel with --state");
    }
    note(loaded.diagnostics, "assumed",
         "no channel names the running test: {} tests were told apart by the voltage",
         tests.windows.size());
  }
  const std::size_t all_tests = tests.windows.size();
  FoundTests driven = tests;
  const std::size_t others = leave_other_routines(*channels.voltage, driven);
  if (others > 0 && others < all_tests) {
    note(loaded.diagnostics, "other_routine",
         "\"{}\" is not driven in {} of {} tests: they are another mechanism's and left out",
         channels.voltage->name, others, all_tests);
    tests = std::move(driven);
  }
  if (one != selection.voltage_scale) {
    note(loaded.diagnostics, "assumed", "voltages are in units of {:.3g} V, by the channel's {}",
         one, volts.unit.empty() ? "name" : "unit");
  }
  note(loaded.diagnostics, "assumed", "voltage from \"{}\", position from {}, velocity from {}",
       channels.voltage->name,
       channels.position ? "\"" + channels.position->name + "\"" : "nowhere",
       channels.velocity ? "\"" + channels.velocity->name + "\"" : "nowhere");
  const auto said = kind_from_name(tests.state_name + " " + channels.voltage->name);
  const auto kind = selection.mechanism ? selection.mechanism : said;
  Signal unwrapped;  // before rows of another clock fall into a leap
  if (channels.position != nullptr && !(kind && position_unit(*kind) == "m")) {
    unwrapped = *channels.position;
    const std::size_t leaps = unwrap_turns(unwrapped.value);
    tell_unwrapped(loaded.diagnostics, leaps);
    channels.position = &unwrapped;
  }
  loaded.recording.runs = join_channels(
      channels, tests.windows,
      fullest_of({channels.voltage, channels.position, channels.velocity}, tests.windows));
  if (loaded.recording.runs.empty()) {
    return refusal(RecordingError::no_tests, log.source, tests.state_name)
        .got("without a test in which the mechanism was recorded");
  }
  if (selection.no_velocity) {
    leave_velocity_out(loaded.recording);
  }
  const std::optional<double> ratio = velocity_ratio(loaded.recording.runs);
  RecordedUnits units;
  FLYBALL_TRY_IN(log.source, units, channel_units(selection, channels));
  if (!units.position.known() && channels.position != nullptr &&
      counts_ticks(channels.position->name, channels.position->unit)) {
    return refusal(RecordingError::unit_unknown, log.source, "position unit")
        .got(fmt::format("ticks of an encoder, by \"{}\"", channels.position->name))
        .expected("an angle or a length")
        .hint(
            "say --unit rotations and with --scale the rotations (of an elevator the metres) that "
            "one tick is, such as 0.000488 for 2048 a turn, and --no-velocity if velocities are "
            "ticks each 100 ms");
  }
  FLYBALL_TRY_IN(log.source, units, settle_units(units, ratio, loaded.diagnostics));
  if (said) {
    tell_said_kind(loaded.diagnostics, "the names in the log say", *said, selection.mechanism);
  }
  if (!units.position.known()) {
    if (kind == MechanismKind::elevator) {
      return refusal(RecordingError::unit_unknown, log.source, "position unit")
          .got("not told by the log, and a drum's is not known")
          .expected("a length for an elevator")
          .hint(
              "say it with --unit m (or cm, in, ft); for a motor's rotations, --unit rotations "
              "and with --scale the metres that one is");
    }
    units.position = likely_angle_unit(loaded.recording.runs, ratio, kind);
    if (!units.velocity.known()) {
      units.velocity = unit_of_text(units.position.text, true, UnitSource::assumed);
    }
    tell_assumed_unit(loaded.diagnostics, units.position);
  }
  if (!units.velocity.known()) {
    units.velocity = unit_of_text(units.position.text, true, units.position.source);
  }
  FLYBALL_TRY_IN(log.source, auto output, output_scale(units.position, selection.scale, kind));
  loaded.recording.mechanism = kind;
  return in_si(std::move(loaded), units, output, 1.0);
}

}  // namespace flyball::recording
