#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>

#include "core/try.hpp"
#include "recording/run_selection.hpp"

namespace flyball::recording {

namespace {

using identification::Recording;
using identification::TestRun;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  const std::size_t end = text.find_last_not_of(' ') + 1;
  return text.substr(begin, std::max(begin, end) - begin);
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value)
                                                                  : std::nullopt;
}

Expected<TestRun*> run_of(Recording& recording, std::string_view text, std::string_view name) {
  const auto number = number_in<std::size_t>(text);
  if (!number) {
    return refusal(ArgumentError::malformed, {}, name)
        .got(fmt::format("\"{}\"", text))
        .expected("the number of a run, as the table of runs has it");
  }
  if (*number < 1 || *number > recording.runs.size()) {
    std::string all;
    for (std::size_t i = 0; i < recording.runs.size(); ++i) {
      all += fmt::format("{}{} ({})", i == 0 ? "" : ", ", i + 1, to_string(recording.runs[i].kind));
    }
    return refusal(RecordingError::no_run, {}, name)
        .got(fmt::format("run {}, which the log does not have", *number))
        .expected("one of " + all);
  }
  return &recording.runs[*number - 1];
}

/// A plain number is in seconds.
Expected<double> seconds_in(std::string_view text, double without) {
  if (text.empty()) {
    return without;
  }
  const auto plain = number_in<double>(text);
  if (plain && std::isfinite(*plain)) {
    return *plain;
  }
  return parse_quantity(text, Dimension::time, "runs");
}

double start_of(const TestRun& run) {
  return *std::min_element(run.time.begin(), run.time.end());
}

Expected<void> trim(Recording& recording, std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::size_t dots = text.find("..");
  if (colon == std::string_view::npos || dots == std::string_view::npos || dots < colon) {
    return refusal(ArgumentError::malformed, {}, "runs")
        .got(fmt::format("\"{}\"", text))
        .expected(
            "a run's number and the seconds of it to use, such as 2:0.5..3, 2:0.5.. or 2:..3");
  }
  FLYBALL_TRY(TestRun * run, run_of(recording, trimmed(text.substr(0, colon)), "runs"));
  FLYBALL_TRY(run->from, seconds_in(trimmed(text.substr(colon + 1, dots - colon - 1)), 0.0));
  FLYBALL_TRY(run->to, seconds_in(trimmed(text.substr(dots + 2)), run->to));
  const double start = start_of(*run);
  const auto left = std::count_if(run->time.begin(), run->time.end(), [&](double time) {
    return time - start >= run->from && time - start <= run->to;
  });
  if (left < 2) {
    const double duration = *std::max_element(run->time.begin(), run->time.end()) - start;
    return refusal(ArgumentError::empty, {}, "runs")
        .got(fmt::format("\"{}\", in which {} of run {}'s rows {}", text,
                         left == 0 ? "none" : "one", run - recording.runs.data() + 1,
                         left == 0 ? "lie" : "lies"))
        .expected(
            fmt::format("seconds within 0 and {:.3g}, the first less than the second", duration));
  }
  return {};
}

}  // namespace

Expected<void> select_runs(const LogSelection& selection, Recording& recording) {
  for (const std::string& text : selection.runs) {
    FLYBALL_CHECK(trim(recording, trimmed(text)));
  }
  for (const std::string& text : selection.without_runs) {
    FLYBALL_TRY(TestRun * run, run_of(recording, trimmed(text), "without_runs"));
    run->left_out = true;
  }
  if (!selection.without_runs.empty() &&
      std::all_of(recording.runs.begin(), recording.runs.end(),
                  [](const TestRun& run) { return run.left_out; })) {
    return refusal(ArgumentError::empty, {}, "without_runs")
        .got("every run of the log")
        .expected("to leave one at least");
  }
  return {};
}

}  // namespace flyball::recording
