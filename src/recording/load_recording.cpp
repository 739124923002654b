#include <flyball/recording/load_recording.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/log.hpp>

#include "core/diagnose.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/channels.hpp"
#include "recording/characterization_windows.hpp"
#include "recording/drivetrain.hpp"

namespace flyball::recording {

namespace {

using identification::Recording;
using identification::TestKind;
using identification::TestRun;
using mechanisms::MechanismKind;

constexpr std::string_view where = "recording";

struct OutputScale {
  double factor = 1.0;  // SI a recorded unit
  std::string unit;     // "m" or "rad"
};

// The SI size of a recorded position unit for a mechanism.
Expected<OutputScale> output_scale(std::string_view unit_text, double scale,
                                   std::optional<MechanismKind> kind) {
  auto unit = parse_unit(unit_text);
  if (!unit) {
    return refusal(RecordingError::unit_mismatch, {}, "position unit")
        .got(fmt::format("\"{}\", which is not known", unit_text))
        .expected("rotations, radians, degrees, metres, inches or feet")
        .hint("say it with --unit");
  }
  if (unit->dimension == Dimension::length) {
    if (kind == MechanismKind::arm) {
      return refusal(RecordingError::unit_mismatch, {}, "position unit")
          .got(fmt::format("\"{}\", a length", unit_text))
          .expected("an angle for an arm")
          .hint("check --mechanism, or say the unit with --unit");
    }
    return OutputScale{unit->factor * scale, "m"};
  }
  if (unit->dimension != Dimension::angle) {
    return refusal(RecordingError::unit_mismatch, {}, "position unit")
        .got(fmt::format("\"{}\", a {}", unit_text, to_string(unit->dimension)))
        .expected("a length or an angle");
  }
  if (kind == MechanismKind::elevator) {
    if (scale == 1.0) {
      return refusal(RecordingError::unit_mismatch, {}, "position unit")
          .got(fmt::format("\"{}\", an angle", unit_text))
          .expected("a length for an elevator")
          .hint(fmt::format("say how many metres one of them is with --scale (for rotations the "
                            "drum's circumference, 2π r)"));
    }
    return OutputScale{scale, "m"};
  }
  return OutputScale{unit->factor * scale, "rad"};
}

void scale_runs(Recording& recording, double factor) {
  for (TestRun& run : recording.runs) {
    for (double& x : run.position) {
      x *= factor;
    }
    for (double& v : run.velocity) {
      v *= factor;
    }
  }
}

Expected<LoadedRecording> from_sysid_json(const Log& log, const LogSelection& selection,
                                          LoadedRecording loaded) {
  const SysIdJson& sysid = *log.sysid;
  loaded.subject = sysid.test;
  for (const SysIdJson::Run& run : sysid.runs) {
    auto kind = identification::parse_test_kind(run.name);
    if (!kind) {
      continue;
    }
    loaded.recording.runs.push_back({*kind, run.time, run.voltage, run.position, run.velocity});
  }
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
  std::string unit = selection.unit;
  double scale = selection.scale;
  if (unit.empty()) {
    if (sysid.units.empty()) {
      unit = "Rotations";
      note(loaded.diagnostics, "assumed",
           "the log does not name its unit: positions are taken as rotations");
    } else {
      unit = sysid.units;
      scale *= sysid.units_per_rotation.value_or(1.0);
    }
  }
  FLYBALL_TRY_IN(log.source, auto output, output_scale(unit, scale, kind));
  scale_runs(loaded.recording, output.factor);
  loaded.recording.unit = output.unit;
  loaded.recording.mechanism = kind;
  return loaded;
}

Expected<LoadedRecording> from_channels(const Log& log, const LogSelection& selection,
                                        LoadedRecording loaded) {
  FLYBALL_TRY_IN(log.source, auto tests, find_tests(log, selection.state_channel));
  loaded.subject = tests.subject;
  if (const std::string reason = drivetrain_reason(log, tests, selection); !reason.empty()) {
    loaded.refusal = refusal(RecordingError::drivetrain, log.source, "mechanism")
                         .got("a drivetrain: " + reason)
                         .expected("a flywheel, an elevator or an arm")
                         .hint(
                             "drivetrains are not supported yet; if it is another mechanism, say "
                             "which with --mechanism");
    if (const auto channels = one_side(log, tests)) {
      loaded.recording.runs = join_channels(
          *channels, tests.windows.empty() ? split_by_voltage(*channels->voltage) : tests.windows);
    }
    return loaded;
  }

  FLYBALL_TRY_IN(log.source, auto channels, find_channels(log, tests, selection));
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
  note(loaded.diagnostics, "assumed", "voltage from \"{}\", position from {}, velocity from {}",
       channels.voltage->name,
       channels.position ? "\"" + channels.position->name + "\"" : "nowhere",
       channels.velocity ? "\"" + channels.velocity->name + "\"" : "nowhere");
  loaded.recording.runs = join_channels(channels, tests.windows);
  if (loaded.recording.runs.empty()) {
    return refusal(RecordingError::no_tests, log.source, tests.state_name)
        .got("without a test in which the mechanism was recorded");
  }
  // Unit: said by the person, else by the position's or the velocity's channel, else rotations.
  std::string unit = selection.unit;
  if (unit.empty() && channels.position && parse_unit(channels.position->unit) &&
      !channels.position->unit.empty()) {
    unit = channels.position->unit;
  }
  if (unit.empty() && channels.velocity) {
    unit = position_unit_of_velocity(channels.velocity->unit);
  }
  if (unit.empty()) {
    unit = "Rotation";
    note(loaded.diagnostics, "assumed",
         "the log does not name the position's unit: rotations are assumed (say it with --unit)");
  }
  std::optional<MechanismKind> kind = selection.mechanism;
  const auto parsed_unit = parse_unit(unit);
  if (!kind) {
    kind = kind_from_name(tests.subject + " " +
                          (channels.voltage ? channels.voltage->name : std::string()));
    if (kind) {
      note(loaded.diagnostics, "assumed", "the names in the log say that it is {} {}",
           *kind == MechanismKind::flywheel ? "a" : "an", to_string(*kind));
    } else if (parsed_unit && parsed_unit->dimension == Dimension::length) {
      kind = MechanismKind::elevator;
      note(loaded.diagnostics, "assumed", "positions are lengths: an elevator is assumed");
    }
  }
  if (!kind) {
    return refusal(RecordingError::mechanism_unknown, log.source, "mechanism")
        .got(fmt::format("not told by the log (positions in \"{}\" fit an arm and a flywheel)",
                         unit))
        .hint("say it with --mechanism arm or --mechanism flywheel");
  }
  FLYBALL_TRY_IN(log.source, auto output, output_scale(unit, selection.scale, kind));
  // A velocity may be in another unit than its position ("RPM" beside "Rotation").
  double velocity_factor = output.factor;
  if (channels.velocity && !channels.velocity->unit.empty() && selection.unit.empty()) {
    const auto rate = parse_unit(channels.velocity->unit);
    const bool same_kind =
        rate && parsed_unit &&
        ((rate->dimension == Dimension::angular_velocity &&
          parsed_unit->dimension == Dimension::angle) ||
         (rate->dimension == Dimension::velocity && parsed_unit->dimension == Dimension::length));
    if (same_kind) {
      velocity_factor *= rate->factor / parsed_unit->factor;
    }
  }
  for (TestRun& run : loaded.recording.runs) {
    for (double& v : run.velocity) {
      v *= velocity_factor / output.factor;
    }
  }
  scale_runs(loaded.recording, output.factor);
  loaded.recording.unit = output.unit;
  loaded.recording.mechanism = kind;
  return loaded;
}

}  // namespace

ErrorInfo error_info(RecordingError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"drivetrain", "this is a drivetrain's log", ErrorKind::no_answer},
      {"mechanism_unknown", "the kind of mechanism is not known", ErrorKind::misuse},
      {"no_test_state", "no channel names the running test", ErrorKind::misuse},
      {"no_channel", "a channel is missing", ErrorKind::misuse},
      {"ambiguous_channel", "several channels fit", ErrorKind::misuse},
      {"unit_mismatch", "the unit does not fit the mechanism", ErrorKind::misuse},
      {"no_tests", "the log holds no test", ErrorKind::no_answer},
  };
  return detail::info_of(code, "recording", rows);
}

ExpectedAll<LoadedRecording> recording_from_log(const Log& log, const LogSelection& selection) {
  if (!std::isfinite(selection.scale) || selection.scale == 0.0) {
    return refusal(ArgumentError::out_of_range, where, "scale")
        .got(fmt::format("{}", selection.scale))
        .expected("a finite number other than zero");
  }
  LoadedRecording loaded;
  loaded.path = log.source;
  loaded.format = log.format;
  loaded.diagnostics = log.diagnostics;
  auto result = log.sysid ? from_sysid_json(log, selection, std::move(loaded))
                          : from_channels(log, selection, std::move(loaded));
  if (result && !result->refusal && !result->recording.mechanism) {
    Error error = refusal(RecordingError::mechanism_unknown, log.source, "mechanism")
                      .got("not told by the log")
                      .hint("say it with --mechanism flywheel, elevator or arm");
    // A log that was cut short often lost the key that says it.
    for (const Diagnostic& diagnostic : log.diagnostics) {
      if (diagnostic.severity != Severity::info) {
        error = std::move(error).with(diagnostic.code, diagnostic.message);
      }
    }
    result = tl::unexpected(std::move(error));
  }
  if (!result) {
    return tl::unexpected(Errors(std::move(result).error()).after(log.diagnostics));
  }
  return *std::move(result);
}

ExpectedAll<LoadedRecording> load_recording(const std::string& path,
                                            const LogSelection& selection) {
  FLYBALL_TRY(const Log log, read_log(path));
  return recording_from_log(log, selection);
}

}  // namespace flyball::recording
