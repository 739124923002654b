#include <flyball/study/identify_streamed.hpp>

#include <utility>

#include <fmt/format.h>

#include <flyball/recording/stream_recording.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/identify_with.hpp"

namespace flyball::study {

namespace {

/// That a stretch begins with a cut is no trimming by hand.
void forget_cuts(IdentifyResult& result) {
  for (identification::TestRun& run : result.source.recording.runs) {
    run.from = 0.0;
  }
  for (identification::PreparedRun& run : result.report.prepared.runs) {
    run.run.from = 0.0;
  }
}

/// "4 of 12 tests, 2 of them in stretches".
std::string kept_words(const recording::BoundedLog& bounded) {
  std::string words = bounded.kept < bounded.tests
                          ? fmt::format("{} of {} tests", bounded.kept, bounded.tests)
                          : text::count(bounded.tests, "test");
  if (bounded.in_stretches == bounded.kept && bounded.kept > 0) {
    words += ", in stretches of 2 s";
  } else if (bounded.in_stretches > 0) {
    words += fmt::format(", {} of them in stretches of 2 s", bounded.in_stretches);
  }
  return words;
}

}  // namespace

ExpectedAll<std::optional<IdentifyResult>> identify_streamed(const IdentifyJob& job) {
  FLYBALL_TRY(const auto bounded, recording::read_bounded_log(job.log, job.selection));
  if (!bounded) {
    return std::optional<IdentifyResult>();
  }
  const auto load = [&](const recording::LogSelection& selection) {
    return recording::recording_from_bounded_log(*bounded, selection);
  };
  FLYBALL_TRY(auto result, identify_with(job.selection, load));
  if (result.drive) {
    return std::optional<IdentifyResult>();
  }
  forget_cuts(result);
  std::string regression = "there is no regression over all rows";
  if (result.report.fit) {
    auto found =
        recording::regress_whole_log(job.log, *bounded, job.selection, result.report.prepared);
    if (!found) {
      regression += ": " + to_string(found.error());
    } else if (*found) {
      result.report.fit->one_step = (*found)->fit;
      regression =
          fmt::format("the one-step regression is over all {} rows in motion", (*found)->rows);
    }
  }
  note(result.report.diagnostics, "read_in_passes",
       "the log has {} {}, more than are held at once: fitted are {}; {}", bounded->samples,
       bounded->log.format == "WPILOG" ? "records" : "rows", kept_words(*bounded), regression);
  return std::optional(std::move(result));
}

}  // namespace flyball::study
