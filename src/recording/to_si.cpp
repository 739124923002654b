#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/recorded_voltage.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

using identification::Recording;
using identification::TestRun;
using mechanisms::MechanismKind;

namespace {

std::string named(MechanismKind kind) {
  return fmt::format("{} {}", has_gravity(kind) ? "an" : "a", to_string(kind));
}

}  // namespace

Expected<OutputScale> output_scale(const RecordedUnit& unit, double scale,
                                   std::optional<MechanismKind> kind) {
  if (unit.linear) {
    if (kind && !controls_velocity(*kind) && position_unit(*kind) == "rad") {
      return refusal(RecordingError::unit_mismatch, {}, "position unit")
          .got(fmt::format("\"{}\", a length", unit.text))
          .expected(fmt::format("an angle for {}", named(*kind)))
          .hint("check --mechanism, or say the unit with --unit");
    }
    return OutputScale{unit.factor * scale, "m"};
  }
  if (kind == MechanismKind::elevator) {
    if (scale == 1.0) {
      return refusal(RecordingError::unit_mismatch, {}, "position unit")
          .got(fmt::format("\"{}\", an angle", unit.text))
          .expected("a length for an elevator")
          .hint(fmt::format("say how many metres one of them is with --scale (for rotations the "
                            "drum's circumference, 2π r; for radians its radius), or the unit that "
                            "it is in truth with --unit"));
    }
    return OutputScale{scale, "m"};
  }
  if (kind == MechanismKind::swerve_drive && scale != 1.0) {
    return OutputScale{scale, "m"};  // of a wheel whose size was said
  }
  return OutputScale{unit.factor * scale, "rad"};
}

Expected<OutputScale> drive_scale(const RecordedUnit& unit, double scale) {
  return output_scale(unit, scale, MechanismKind::swerve_drive);
}

Expected<RecordedUnit> said_unit(const std::string& text, bool rate) {
  RecordedUnit unit = unit_of_text(text, rate, UnitSource::said);
  if (!text.empty() && !unit.known()) {
    const auto parsed = parse_unit(text);
    return refusal(RecordingError::unit_mismatch, {}, rate ? "velocity unit" : "position unit")
        .got(parsed ? fmt::format("\"{}\", a {}", text, to_string(parsed->dimension))
                    : fmt::format("\"{}\", which is not known", text))
        .expected(rate ? "RPM, rad/s, deg/s, m/s, in/s or ft/s"
                       : "rotations, radians, degrees, metres, inches or feet")
        .hint(rate ? "say it with --velocity-unit" : "say it with --unit");
  }
  return unit;
}

Expected<LoadedRecording> in_si(LoadedRecording loaded, const RecordedUnits& units,
                                const OutputScale& output, double voltage_scale) {
  const auto scale = [](std::vector<double>& values, double factor) {
    for (double& value : values) {
      value *= factor;
    }
  };
  for (TestRun& run : loaded.recording.runs) {
    scale(run.position, output.factor);
    scale(run.velocity, output.factor * units.velocity.factor / units.position.factor);
    scale(run.voltage, voltage_scale);
  }
  loaded.recording.unit = output.unit;
  if (auto checked = check_voltage(loaded.recording.runs, loaded.diagnostics); !checked) {
    return tl::unexpected(std::move(checked).error().in(loaded.path));
  }
  return loaded;
}

void leave_velocity_out(Recording& recording) {
  for (TestRun& run : recording.runs) {
    if (!run.position.empty()) {
      run.velocity.clear();
    }
  }
}

void tell_said_kind(std::vector<Diagnostic>& notes, std::string_view how, MechanismKind said,
                    std::optional<MechanismKind> selected) {
  // Whatever has no gravity is "simple" to SysId.
  const bool alike = selected && !has_gravity(*selected) && !has_gravity(said);
  if (selected && *selected != said && !alike) {
    warn(notes, "mechanism_overruled", "{} that it is {}: it is taken for {}, as was said", how,
         named(said), named(*selected));
  } else if (!selected) {
    note(notes, "assumed", "{} that it is {}", how, named(said));
  }
}

void tell_unwrapped(std::vector<Diagnostic>& notes, std::size_t leaps) {
  if (leaps > 0) {
    note(notes, "angle_unwrapped",
         "the positions keep within one turn and leap by a whole one {} times, as an absolute "
         "encoder's do: they were made to go on",
         leaps);
  }
}

void tell_assumed_unit(std::vector<Diagnostic>& notes, const RecordedUnit& unit) {
  std::vector<Diagnostic> first;
  warn(first, "unit_assumed",
       "the log does not tell the unit of its positions, and the data cannot: they are taken for "
       "{} (say it with --unit); all gains hang on it",
       unit.text);
  notes.insert(notes.begin(), first.front());
}

}  // namespace flyball::recording
