#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>

#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/characterization_windows.hpp"

namespace flyball::recording {

namespace {

using identification::TestKind;

std::vector<CharacterizationWindow> windows_of(const TextSignal& state) {
  std::vector<CharacterizationWindow> windows;
  std::optional<TestKind> running;
  for (std::size_t i = 0; i < state.time.size(); ++i) {
    const auto parsed = identification::parse_test_kind(state.value[i]);
    const std::optional<TestKind> kind = parsed ? std::optional<TestKind>(*parsed) : std::nullopt;
    if (running && (kind != running)) {
      windows.back().end = state.time[i];
    }
    if (kind && kind != running) {
      windows.push_back({*kind, state.time[i], state.time[i]});
    }
    running = kind;
  }
  // A state that is logged only when it changes leaves its last test open: it runs to the end.
  if (running) {
    windows.back().end = std::numeric_limits<double>::infinity();
  }
  return windows;
}

// "ElevatorSubsystem" of "sysid-test-state-ElevatorSubsystem", "" of other names.
std::string subject_of(std::string_view state_name) {
  constexpr std::string_view prefix = "sysid-test-state-";
  const std::size_t at = lower(state_name).find(prefix);
  return at == std::string::npos ? std::string()
                                 : std::string(state_name.substr(at + prefix.size()));
}

}  // namespace

Expected<FoundTests> find_tests(const Log& log, const std::string& state_channel) {
  FoundTests found;
  if (!state_channel.empty()) {
    const TextSignal* state = log.find_text(state_channel);
    if (state == nullptr) {
      std::vector<std::string_view> names;
      names.reserve(log.texts.size());
      for (const TextSignal& text : log.texts) {
        names.push_back(text.name);
      }
      const std::string nearest = nearest_name(state_channel, names);
      return refusal(RecordingError::no_test_state, {}, "state channel")
          .got(fmt::format("\"{}\", which the log does not have as a text", state_channel))
          .hint(nearest.empty() ? "" : fmt::format("did you mean \"{}\"?", nearest));
    }
    found = {state->name, subject_of(state->name), windows_of(*state)};
    if (found.windows.empty()) {
      return refusal(RecordingError::no_tests, {}, state_channel)
          .got("without the name of a test")
          .expected(
              "quasistatic-forward, quasistatic-reverse, dynamic-forward or dynamic-reverse at "
              "times");
    }
    return found;
  }
  std::vector<FoundTests> all;
  std::string silent;
  for (const TextSignal& text : log.texts) {
    std::vector<CharacterizationWindow> windows = windows_of(text);
    if (!windows.empty()) {
      all.push_back({text.name, subject_of(text.name), std::move(windows)});
    } else if (!subject_of(text.name).empty()) {
      silent = text.name;
    }
  }
  if (all.size() > 1) {
    std::vector<std::string> names;
    names.reserve(all.size());
    for (const FoundTests& tests : all) {
      names.push_back("\"" + tests.state_name + "\"");
    }
    return refusal(RecordingError::ambiguous_channel, {}, "mechanism")
        .got(fmt::format("one of {}: {}", all.size(), fmt::join(names, ", ")))
        .hint("choose one with --state");
  }
  if (all.size() == 1) {
    return all.front();
  }
  if (!silent.empty()) {
    return refusal(RecordingError::no_tests, {}, silent)
        .got("\"none\" throughout")
        .hint("no characterisation test ran while this was recorded");
  }
  return found;
}

std::vector<CharacterizationWindow> split_by_voltage(const Signal& voltage) {
  constexpr double idle = 0.05;      // V: below this nothing is driven
  constexpr double shortest = 0.3;   // s
  constexpr double step_rise = 0.1;  // s: a step is at most of its level by then
  std::vector<CharacterizationWindow> windows;
  const std::size_t n = voltage.time.size();
  std::size_t i = 0;
  while (i < n) {
    if (std::abs(voltage.value[i]) <= idle) {
      ++i;
      continue;
    }
    const bool forward = voltage.value[i] > 0.0;
    std::size_t end = i;
    double peak = 0.0;
    while (end < n && std::abs(voltage.value[end]) > idle &&
           (voltage.value[end] > 0.0) == forward) {
      peak = std::max(peak, std::abs(voltage.value[end]));
      ++end;
    }
    const double begin_time = voltage.time[i];
    const double end_time = end < n ? voltage.time[end] : voltage.time[n - 1];
    if (end_time - begin_time >= shortest) {
      double early = 0.0;
      for (std::size_t k = i; k < end && voltage.time[k] <= begin_time + step_rise; ++k) {
        early = std::max(early, std::abs(voltage.value[k]));
      }
      const bool dynamic = early >= 0.7 * peak;
      const TestKind kind =
          dynamic ? (forward ? TestKind::dynamic_forward : TestKind::dynamic_reverse)
                  : (forward ? TestKind::quasistatic_forward : TestKind::quasistatic_reverse);
      windows.push_back({kind, begin_time, end_time});
    }
    i = end;
  }
  return windows;
}

std::size_t samples_in(const Signal& signal, const std::vector<CharacterizationWindow>& windows) {
  if (windows.empty()) {
    return signal.time.size();
  }
  return static_cast<std::size_t>(
      std::count_if(signal.time.begin(), signal.time.end(), [&](double t) {
        return std::any_of(windows.begin(), windows.end(),
                           [&](const CharacterizationWindow& window) {
                             return t >= window.begin && t < window.end;
                           });
      }));
}

}  // namespace flyball::recording
