#include <flyball/recording/load_recording.hpp>

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/log.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "recording/drivetrain.hpp"
#include "recording/run_selection.hpp"
#include "recording/to_si.hpp"

namespace flyball::recording {

namespace {

constexpr std::string_view in_recording = "recording";

}  // namespace

ErrorInfo error_info(RecordingError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"drivetrain", "this is no log of one motor's mechanism", ErrorKind::no_answer},
      {"no_test_state", "no channel names the running test", ErrorKind::misuse},
      {"no_channel", "a channel is missing", ErrorKind::misuse},
      {"ambiguous_channel", "several channels fit", ErrorKind::misuse},
      {"unit_unknown", "the unit is not known", ErrorKind::misuse},
      {"unit_mismatch", "the unit does not fit", ErrorKind::misuse},
      {"no_run", "there is no such run", ErrorKind::misuse},
      {"no_tests", "the log holds no test", ErrorKind::no_answer},
  };
  return detail::info_of(code, "recording", rows);
}

ExpectedAll<LoadedRecording> recording_from_log(const Log& log, const LogSelection& selection) {
  for (const auto& [scale, name] :
       {std::pair{selection.scale, "scale"}, {selection.voltage_scale, "voltage_scale"}}) {
    if (!std::isfinite(scale) || scale == 0.0) {
      return refusal(ArgumentError::out_of_range, in_recording, name)
          .got(fmt::format("{}", scale))
          .expected("a finite number other than zero");
    }
  }
  LoadedRecording loaded;
  loaded.path = log.source;
  loaded.format = log.format;
  loaded.diagnostics = log.diagnostics;
  auto result = log.sysid ? from_sysid_json(log, selection, std::move(loaded))
                          : from_channels(log, selection, std::move(loaded));
  if (result) {
    if (auto selected = select_runs(selection, result->recording); !selected) {
      result = tl::unexpected(std::move(selected).error().in(log.source));
    }
  }
  if (!result) {
    return tl::unexpected(Errors(std::move(result).error()).after(log.diagnostics));
  }
  return *std::move(result);
}

ExpectedAll<LoadedRecording> load_recording(const std::string& path,
                                            const LogSelection& selection) {
  FLYBALL_TRY(const Log log, read_log(path));
  if (selection.also.empty()) {
    return recording_from_log(log, selection);
  }
  FLYBALL_TRY(auto loaded, recording_from_log(log, selection));
  FLYBALL_TRY(const Log beside, read_log(selection.also));
  FLYBALL_TRY(auto other, recording_from_log(beside, selection));
  FLYBALL_TRY(loaded, with_other(std::move(loaded), std::move(other)));
  return loaded;
}

}  // namespace flyball::recording
