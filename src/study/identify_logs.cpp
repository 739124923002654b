#include <flyball/study/identify_logs.hpp>

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "study/identify_with.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::GainComparison;
using identification::IdentificationError;
using identification::Recording;

/// What the logs with gains recorded: of mechanisms or of drivetrains.
struct Recordings {
  std::vector<Recording> mechanisms{};
  std::vector<identification::DriveRecording> drives{};
};

/// One log by itself; its recording is kept where it has gains.
LogOutcome outcome_of(const std::string& path, const recording::LogSelection& selection,
                      Recordings& recordings) {
  auto found = identify({.log = path, .selection = selection});
  if (!found) {
    return {.path = path, .diagnostics = {}, .fit = tl::unexpected(std::move(found).error())};
  }
  LogOutcome outcome{.path = path,
                     .diagnostics = found->diagnostics(),
                     .fit = tl::unexpected(Errors(refusal(ArgumentError::empty)))};
  for (const identification::TestRun& run : found->source.recording.runs) {
    outcome.rows += run.time.size();
  }
  if (found->drive) {
    for (const identification::DriveRun& run : found->drive->recording.runs) {
      outcome.rows += run.time.size();
    }
    if (found->drive->fit) {
      outcome.drive = *std::move(found->drive->fit);
      recordings.drives.push_back(*std::move(found->source.drive));
      return outcome;
    }
    outcome.fit = tl::unexpected(Errors(std::move(found->drive->fit).error()));
    return outcome;
  }
  if (!found->report.fit) {
    outcome.fit = tl::unexpected(Errors(std::move(found->report.fit).error()));
    return outcome;
  }
  found->report.fit->runs.clear();
  outcome.fit = *std::move(found->report.fit);
  recordings.mechanisms.push_back(std::move(found->source.recording));
  return outcome;
}

Error few_logs(std::size_t logs) {
  return refusal(ArgumentError::wrong_shape, "identify", "logs")
      .got(logs == 0 ? "none" : "one")
      .expected("two or more, to compare what they say");
}

/// Every reason why logs have no gains, in their order.
Errors reasons(const std::vector<LogOutcome>& logs) {
  std::vector<QuotedError> all;
  for (const LogOutcome& log : logs) {
    if (!log.has_gains()) {
      for (QuotedError error : log.fit.error().all()) {
        if (error.where().find(log.path) == std::string::npos) {
          static_cast<Error&>(error) = Error(error).in(log.path + ": " + error.where());
        }
        all.push_back(std::move(error));
      }
    }
  }
  return Errors(std::move(all));
}

Expected<void> check_one_mechanism(const std::vector<LogOutcome>& logs,
                                   const std::vector<std::size_t>& used) {
  const auto words = [](const LogOutcome& log) {
    return log.drive ? "of a drivetrain in " + log.drive->unit : "of a mechanism";
  };
  for (const std::size_t log : used) {
    const bool drives = logs[used[0]].drive && logs[log].drive;
    if (logs[log].drive.has_value() != logs[used[0]].drive.has_value() ||
        (drives && logs[log].drive->unit != logs[used[0]].drive->unit)) {
      return refusal(ArgumentError::wrong_unit, logs[log].path, "the log")
          .got(words(logs[log]))
          .expected(fmt::format("logs of one drivetrain or mechanism: {} is {}", logs[used[0]].path,
                                words(logs[used[0]])))
          .hint("identify the logs of each on their own, or say --mechanism and --unit");
    }
  }
  if (logs[used[0]].drive) {
    return {};
  }
  const FeedforwardFit& first = *logs[used[0]].fit;
  for (const std::size_t log : used) {
    const FeedforwardFit& fit = *logs[log].fit;
    if (fit.mechanism != first.mechanism || fit.unit != first.unit) {
      return refusal(ArgumentError::wrong_unit, logs[log].path, "the log")
          .got(fmt::format(
              "of {} {} in {}",
              fit.mechanism == first.mechanism ? "the same kind of mechanism, an" : "an",
              to_string(fit.mechanism), fit.unit))
          .expected(fmt::format("logs of one mechanism: {} has one in {}", logs[used[0]].path,
                                first.unit))
          .hint("identify the logs of each mechanism on their own, or say --mechanism and --unit");
    }
  }
  return {};
}

/// Of a kV that differs by more than a tenth a joint fit is of no mechanism.
Expected<void> check_one_speed(const IdentifyLogsResult& result) {
  constexpr double most = 0.1;
  for (const GainComparison& gain : result.gains) {
    if (!gain.name.starts_with("kV") || gain.agrees() ||
        gain.between < most * std::abs(gain.mean)) {
      continue;
    }
    const auto path = [&](std::size_t used) { return result.logs[result.used[used]].path; };
    const auto value = [&](std::size_t used) {
      const LogOutcome& log = result.logs[result.used[used]];
      return format_number(log.drive ? drive_gain(*log.drive, gain.name)->value : log.fit->kV.value,
                           4);
    };
    const auto [a, b] = gain.pair;
    return refusal(IdentificationError::logs_differ, "identify", gain.name)
        .got(fmt::format("{} {} in {} and {} in {}", value(a), gain.unit, path(a), value(b),
                         path(b)))
        .expected("the same in each, within a tenth")
        .hint(gain.outlier ? fmt::format("leave {} out: the others agree", path(*gain.outlier))
                           : "another unit, gearing or mechanism? Identify them one by one");
  }
  return {};
}

/// What differs between the logs, beside the joint fit's own diagnostics.
void tell_differences(IdentifyLogsResult& result) {
  std::vector<Diagnostic>& told = result.joint.report.diagnostics;
  const auto path = [&](std::size_t used) { return result.logs[result.used[used]].path; };
  for (const GainComparison& gain : result.gains) {
    if (gain.agrees()) {
      continue;
    }
    if (gain.outlier) {
      warn(told, "log_differs",
           "{} of {} differs from that of the other logs, which agree: something was changed, or "
           "went wrong in that log",
           gain.name, path(*gain.outlier));
    } else {
      warn(told, "logs_differ",
           "{} differs between the logs by more than their intervals explain: {:.1f} standard "
           "errors between {} and {}; its interval holds the difference",
           gain.name, gain.largest_z, path(gain.pair[0]), path(gain.pair[1]));
    }
  }
  for (const LogOutcome& log : result.logs) {
    for (const Diagnostic& found : log.diagnostics) {
      if (log.has_gains() && found.code == "mechanism_assumed") {
        told.insert(told.begin(), found);
        told.front().message = log.path + ": " + found.message;
      }
    }
    if (!log.has_gains()) {
      warn(told, "log_left_out", "{} was left out: {}", log.path, to_string(log.fit.error()));
    }
  }
}

/// Several logs of one drivetrain.
ExpectedAll<IdentifyLogsResult> identify_drive_logs(
    std::vector<LogOutcome> logs, std::vector<std::size_t> used,
    const std::vector<identification::DriveRecording>& recordings) {
  std::vector<identification::DriveFit> fits;
  for (const std::size_t log : used) {
    fits.push_back(*logs[log].drive);
  }
  FLYBALL_TRY(auto gains, identification::compare_fits(fits));
  recording::LoadedRecording source;
  source.path = fmt::format("{} logs", used.size());
  FLYBALL_TRY(source.drive, identification::joined(recordings));
  IdentifyLogsResult result{.logs = std::move(logs),
                            .used = std::move(used),
                            .gains = std::move(gains),
                            .joint = identify_drivetrain(std::move(source))};
  auto& fit = result.joint.drive->fit;
  if (fit) {
    identification::widen_by_scatter(*fit, result.gains);
  }
  if (auto same = check_one_speed(result); !same) {
    fit = tl::unexpected(std::move(same).error());
  }
  tell_differences(result);
  return result;
}

}  // namespace

bool IdentifyLogsResult::repeats() const {
  return std::all_of(gains.begin(), gains.end(),
                     [](const GainComparison& gain) { return gain.agrees(); });
}

ExpectedAll<IdentifyLogsResult> identify_logs(const IdentifyLogsJob& job) {
  if (job.logs.size() < 2) {
    return tl::unexpected(Errors(few_logs(job.logs.size())));
  }
  std::vector<LogOutcome> logs;
  std::vector<std::size_t> used;
  Recordings recordings;
  for (const std::string& path : job.logs) {
    logs.push_back(outcome_of(path, job.selection, recordings));
    if (logs.back().has_gains()) {
      used.push_back(logs.size() - 1);
    }
  }
  if (used.size() < 2) {
    return tl::unexpected(reasons(logs));
  }
  FLYBALL_CHECK(check_one_mechanism(logs, used));
  if (logs[used[0]].drive) {
    return identify_drive_logs(std::move(logs), std::move(used), recordings.drives);
  }
  for (Recording& recording : recordings.mechanisms) {
    recording.mechanism = logs[used[0]].fit->mechanism;
  }
  FLYBALL_TRY(auto together, identification::joined(recordings.mechanisms));
  std::vector<FeedforwardFit> fits;
  for (const std::size_t log : used) {
    fits.push_back(*logs[log].fit);
  }
  FLYBALL_TRY(auto gains, identification::compare_fits(fits));
  auto report = identification::identify_feedforward(together);
  if (report.fit) {
    identification::widen_by_scatter(*report.fit, gains);
  }
  IdentifyLogsResult result{
      .logs = std::move(logs),
      .used = std::move(used),
      .gains = std::move(gains),
      .joint = {.source = {}, .report = std::move(report), .mechanism = {}, .unit = {}}};
  result.joint.mechanism = fits[0].mechanism;
  result.joint.unit = fits[0].unit;
  result.joint.source.path = fmt::format("{} logs", result.used.size());
  result.joint.source.recording = std::move(together);
  if (auto same = check_one_speed(result); !same) {
    result.joint.report.fit = tl::unexpected(std::move(same).error());
  }
  tell_contradictions(result.joint.report, job.said);
  tell_differences(result);
  return result;
}

}  // namespace flyball::study
