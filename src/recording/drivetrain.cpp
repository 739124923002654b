#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/quantity.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/drivetrain.hpp"
#include "recording/recorded_motion.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

using identification::DriveRun;
using identification::TestRun;

namespace {

/// "LEFT,RIGHT" as two names; a lone one is the left's.
std::pair<std::string, std::string> two_names(const std::string& text) {
  const std::size_t comma = text.find(',');
  return comma == std::string::npos ? std::pair(text, std::string())
                                    : std::pair(text.substr(0, comma), text.substr(comma + 1));
}

/// One quantity of both sides.
struct Pair {
  const Signal* left = nullptr;
  const Signal* right = nullptr;
};

Expected<Pair> pair_of(const Log& log, const FoundTests& tests, Channel quantity,
                       const std::string& said) {
  Pair pair;
  if (!said.empty()) {
    const auto [left, right] = two_names(said);
    if (right.empty()) {
      return refusal(RecordingError::no_channel, {}, channel_name(quantity) + " channels")
          .got(fmt::format("\"{}\" alone", said))
          .expected("a left and a right one")
          .hint(fmt::format("say both, as --{} LEFT,RIGHT", channel_name(quantity)));
    }
    FLYBALL_TRY(pair.left, named_channel(log, left, quantity));
    FLYBALL_TRY(pair.right, named_channel(log, right, quantity));
    return pair;
  }
  // Of several motors of a side the first; they are geared together.
  for (const Signal* signal : candidates_for(log, tests, quantity)) {
    const Side side = side_of(signal->name);
    pair.left = side == Side::left && pair.left == nullptr ? signal : pair.left;
    pair.right = side == Side::right && pair.right == nullptr ? signal : pair.right;
  }
  return pair.left != nullptr && pair.right != nullptr ? pair : Pair{};
}

/// A gyro's heading by its name: yaw, heading, or the rotation or angle of the whole robot.
const Signal* find_heading(const Log& log, const FoundTests& tests) {
  constexpr std::array<std::string_view, 2> sure{"heading", "yaw"};
  constexpr std::array<std::string_view, 3> likely{"gyro", "robot rotation", "robot angle"};
  constexpr std::array<std::string_view, 9> other{"pitch",   "roll",  "rate",   "velocity", "speed",
                                                  "calibra", "accel", "target", "setpoint"};
  const auto by = [&](std::span<const std::string_view> words) -> const Signal* {
    for (const Signal& signal : log.signals) {
      const std::string name = lower(signal.name);
      if (contains_any(name, words) && !contains_any(name, other) &&
          side_of(signal.name) == Side::none && samples_in(signal, tests.windows) >= 2) {
        return &signal;
      }
    }
    return nullptr;
  };
  const Signal* found = by(sure);
  return found != nullptr ? found : by(likely);
}

/// Radians by the unit that the log or the name says.
double heading_factor(const Signal& heading) {
  RecordedUnit unit = unit_of_text(heading.unit, false, UnitSource::metadata);
  unit = unit.known() ? unit : unit_in_name(heading.name, false);
  return unit.known() && !unit.linear ? unit.factor : 1.0;
}

std::string quoted(const Signal* left, const Signal* right) {
  return left == nullptr ? "nowhere" : fmt::format("\"{}\" and \"{}\"", left->name, right->name);
}

}  // namespace

bool means_drivetrain(std::string_view mechanism) {
  std::string letters;
  for (const std::string& word : words_of(mechanism)) {
    letters += word;
  }
  constexpr std::array<std::string_view, 6> words{"drivetrain",   "drive",     "differentialdrive",
                                                  "differential", "tankdrive", "drivebase"};
  return std::find(words.begin(), words.end(), letters) != words.end();
}

std::vector<TestRun> both_sides(std::vector<TestRun> left, std::vector<TestRun> right) {
  left.insert(left.end(), std::make_move_iterator(right.begin()),
              std::make_move_iterator(right.end()));
  return left;
}

LoadedRecording as_drive(LoadedRecording loaded, GyroColumns gyro) {
  std::vector<TestRun>& runs = loaded.recording.runs;
  identification::DriveRecording drive{.unit = loaded.recording.unit};
  const std::size_t tests = runs.size() / 2;
  for (std::size_t i = 0; i < tests; ++i) {
    TestRun& left = runs[i];
    TestRun& right = runs[tests + i];
    DriveRun run{.kind = left.kind, .time = std::move(left.time)};
    run.left = {std::move(left.voltage), std::move(left.position), std::move(left.velocity)};
    run.right = {std::move(right.voltage), std::move(right.position), std::move(right.velocity)};
    if (i < gyro.heading.size()) {
      run.heading = std::move(gyro.heading[i]);
    }
    if (i < gyro.rate.size()) {
      run.heading_rate = std::move(gyro.rate[i]);
    }
    drive.runs.push_back(std::move(run));
  }
  runs.clear();
  loaded.drive = std::move(drive);
  return loaded;
}

Expected<LoadedRecording> with_other(LoadedRecording loaded, LoadedRecording other) {
  for (const LoadedRecording* log : {&loaded, &other}) {
    if (!log->drive) {
      return refusal(RecordingError::drivetrain, log->path, "--also")
          .got("with a log that is no drivetrain's")
          .expected("two logs of one drivetrain: straight tests and rotations");
    }
  }
  if (loaded.drive->unit != other.drive->unit) {
    return refusal(RecordingError::unit_mismatch, other.path, "position unit")
        .got(other.drive->unit)
        .expected(loaded.drive->unit + ", as in the log beside it");
  }
  for (DriveRun& run : other.drive->runs) {
    loaded.drive->runs.push_back(std::move(run));
  }
  for (Diagnostic& found : other.diagnostics) {
    found.message = other.path + ": " + found.message;
    loaded.diagnostics.push_back(std::move(found));
  }
  loaded.path += " and " + other.path;
  return loaded;
}

Expected<DriveChannels> find_drive_channels(const Log& log, const FoundTests& tests,
                                            const LogSelection& selection) {
  FLYBALL_TRY(const Pair voltage, pair_of(log, tests, Channel::voltage, selection.voltage_channel));
  FLYBALL_TRY(const Pair position,
              pair_of(log, tests, Channel::position, selection.position_channel));
  FLYBALL_TRY(const Pair velocity,
              pair_of(log, tests, Channel::velocity, selection.velocity_channel));
  DriveChannels channels{.left = {voltage.left, position.left, velocity.left},
                         .right = {voltage.right, position.right, velocity.right}};
  if (selection.heading_channel.empty()) {
    channels.heading = find_heading(log, tests);
  } else {
    FLYBALL_TRY(channels.heading, named_channel(log, selection.heading_channel, Channel::position));
  }
  std::vector<std::string> missing;
  std::vector<std::string> options;
  if (voltage.left == nullptr) {
    missing.emplace_back("voltage");
    options.emplace_back("--voltage LEFT,RIGHT (with --voltage-scale 12 for a duty cycle)");
  }
  if (position.left == nullptr && velocity.left == nullptr) {
    missing.emplace_back("position or velocity");
    options.emplace_back("--position LEFT,RIGHT or --velocity LEFT,RIGHT");
  }
  if (!missing.empty()) {
    const std::string heading =
        channels.heading == nullptr
            ? "; and the gyro's heading with --heading"
            : fmt::format("; the heading is \"{}\"", channels.heading->name);
    return refusal(RecordingError::no_channel, {},
                   fmt::format("a left and a right {}", fmt::join(missing, ", and a ")))
        .got(fmt::format("not found by name among {} numeric channels{}", log.signals.size(),
                         fullest_channels(log, tests)))
        .hint(fmt::format("name them with {}{}", fmt::join(options, " and "), heading));
  }
  return channels;
}

Expected<LoadedRecording> drive_from_channels(const Log& log, const LogSelection& selection,
                                              FoundTests tests, LoadedRecording loaded) {
  FLYBALL_TRY_IN(log.source, const auto channels, find_drive_channels(log, tests, selection));
  const auto& [left, right, heading] = channels;
  if (tests.windows.empty()) {
    tests.windows = split_by_voltage(*left.voltage);
    if (tests.windows.empty()) {
      return refusal(RecordingError::no_tests, log.source, left.voltage->name)
          .got("never driven, and no channel names the running test")
          .hint("record the voltage that was applied, or name the channel with --state");
    }
    note(loaded.diagnostics, "assumed",
         "no channel names the running test: {} tests were told apart by the left voltage",
         tests.windows.size());
  }
  note(loaded.diagnostics, "assumed",
       "left and right: voltage from {}, position from {}, velocity from {}; heading from {}",
       quoted(left.voltage, right.voltage), quoted(left.position, right.position),
       quoted(left.velocity, right.velocity),
       heading == nullptr ? "nowhere" : fmt::format("\"{}\"", heading->name));
  const Signal* clock = fullest_of(
      {left.voltage, left.position, left.velocity, right.voltage, right.position, right.velocity},
      tests.windows);
  const std::vector<TestRun> left_runs = join_channels(left, tests.windows, clock);
  GyroColumns gyro;
  for (const TestRun& run : left_runs) {
    if (heading != nullptr) {
      gyro.heading.push_back(sampled(*heading, run.time));
      for (double& angle : gyro.heading.back()) {
        angle *= heading_factor(*heading);
      }
    }
  }
  loaded.recording.runs = both_sides(left_runs, join_channels(right, tests.windows, clock));
  if (loaded.recording.runs.empty()) {
    return refusal(RecordingError::no_tests, log.source, tests.state_name)
        .got("without a test in which the drivetrain was recorded");
  }
  if (selection.no_velocity) {
    leave_velocity_out(loaded.recording);
  }
  const std::optional<double> ratio = velocity_ratio(loaded.recording.runs);
  RecordedUnits units;
  FLYBALL_TRY_IN(log.source, units, channel_units(selection, left));
  FLYBALL_TRY_IN(log.source, units, settle_units(units, ratio, loaded.diagnostics));
  if (!units.position.known()) {
    units.position = likely_way_unit(loaded.recording.runs, ratio);
    tell_assumed_unit(loaded.diagnostics, units.position);
  }
  if (!units.velocity.known()) {
    units.velocity = unit_of_text(units.position.text, true, units.position.source);
  }
  FLYBALL_TRY_IN(log.source, const auto output, drive_scale(units.position, selection.scale));
  FLYBALL_TRY(loaded, in_si(std::move(loaded), units, output, selection.voltage_scale));
  return as_drive(std::move(loaded), std::move(gyro));
}

}  // namespace flyball::recording
