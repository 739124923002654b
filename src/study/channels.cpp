#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>

#include "study/channels.hpp"

namespace flyball::study {

namespace {

using identification::TestKind;
using identification::TestRun;
using mechanisms::MechanismKind;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

bool contains_any(std::string_view text, std::span<const std::string_view> words) {
  return std::any_of(words.begin(), words.end(), [&](std::string_view word) {
    return text.find(word) != std::string_view::npos;
  });
}

std::vector<TestWindow> windows_of(const TextSignal& state) {
  std::vector<TestWindow> windows;
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

constexpr std::array<std::string_view, 2> voltage_words{"volt", "appliedv"};
constexpr std::array<std::string_view, 4> position_words{"position", "angle", "distance", "pos"};
constexpr std::array<std::string_view, 4> velocity_words{"velocity", "speed", "rate", "vel"};
// Channels of these names are not what was applied to the mechanism, or where it was.
constexpr std::array<std::string_view, 8> other_words{"battery", "bus",       "target",  "setpoint",
                                                      "goal",    "reference", "desired", "error"};

enum class Quantity { voltage, position, velocity };

bool fits(const Signal& signal, Quantity quantity) {
  const std::string name = lower(signal.name);
  if (contains_any(name, other_words)) {
    return false;
  }
  const auto unit = signal.unit.empty() ? Expected<Unit>(Unit{}) : parse_unit(signal.unit);
  const bool known = !signal.unit.empty() && unit.has_value();
  const Dimension dimension = known ? unit->dimension : Dimension::dimensionless;
  switch (quantity) {
    case Quantity::voltage:
      return contains_any(name, voltage_words) && (!known || dimension == Dimension::voltage);
    case Quantity::position:
      return contains_any(name, position_words) && !contains_any(name, velocity_words) &&
             (!known || dimension == Dimension::length || dimension == Dimension::angle);
    case Quantity::velocity:
      return contains_any(name, velocity_words) && (!known || dimension == Dimension::velocity ||
                                                    dimension == Dimension::angular_velocity);
  }
  return false;
}

std::size_t samples_in(const Signal& signal, const std::vector<TestWindow>& windows) {
  if (windows.empty()) {
    return signal.time.size();
  }
  return static_cast<std::size_t>(
      std::count_if(signal.time.begin(), signal.time.end(), [&](double t) {
        return std::any_of(windows.begin(), windows.end(), [&](const TestWindow& window) {
          return t >= window.begin && t < window.end;
        });
      }));
}

// "left" or "right" as a word of its own or at a capital: "voltage-drive-left", "LeftVolts".
bool names_side(std::string_view name, std::string_view side) {
  return lower(name).find(side) != std::string::npos;
}

struct Candidates {
  std::vector<const Signal*> signals;
};

Candidates candidates_for(const Log& log, const FoundTests& tests, Quantity quantity) {
  Candidates all;
  Candidates of_subject;
  for (const Signal& signal : log.signals) {
    if (!fits(signal, quantity) || samples_in(signal, tests.windows) < 2) {
      continue;
    }
    all.signals.push_back(&signal);
    if (!tests.subject.empty() && signal.name.ends_with("-" + tests.subject)) {
      of_subject.signals.push_back(&signal);
    }
  }
  return of_subject.signals.empty() ? all : of_subject;
}

std::string quantity_name(Quantity quantity) {
  switch (quantity) {
    case Quantity::voltage:
      return "voltage";
    case Quantity::position:
      return "position";
    case Quantity::velocity:
      return "velocity";
  }
  return "";
}

Expected<const Signal*> named_channel(const Log& log, const std::string& name, Quantity quantity) {
  if (const Signal* signal = log.find_signal(name)) {
    return signal;
  }
  std::vector<std::string_view> names;
  for (const Signal& signal : log.signals) {
    names.push_back(signal.name);
  }
  const std::string nearest = nearest_name(name, names);
  return tl::unexpected(Error(RecordingError::no_channel)
                            .about(quantity_name(quantity) + " channel")
                            .got(fmt::format("\"{}\", which the log does not have", name))
                            .hint(nearest.empty() ? std::string("flyball lists the channels when "
                                                                "it cannot choose")
                                                  : fmt::format("did you mean \"{}\"?", nearest)));
}

Expected<const Signal*> choose(const Log& log, const FoundTests& tests, Quantity quantity,
                               const std::string& said, const Signal* voltage, bool& drivetrain) {
  if (!said.empty()) {
    return named_channel(log, said, quantity);
  }
  Candidates candidates = candidates_for(log, tests, quantity);
  if (candidates.signals.size() > 1) {
    const bool left = std::any_of(candidates.signals.begin(), candidates.signals.end(),
                                  [](const Signal* s) { return names_side(s->name, "left"); });
    const bool right = std::any_of(candidates.signals.begin(), candidates.signals.end(),
                                   [](const Signal* s) { return names_side(s->name, "right"); });
    drivetrain = drivetrain || (left && right);
  }
  if (candidates.signals.size() > 1 && voltage != nullptr) {
    // The voltage's namesake: "position-wrist-Coral" beside "voltage-wrist-Coral".
    std::string wanted = lower(voltage->name);
    const std::size_t at = wanted.find("voltage");
    if (at != std::string::npos) {
      wanted.replace(at, std::string_view("voltage").size(), quantity_name(quantity));
      for (const Signal* signal : candidates.signals) {
        if (lower(signal->name) == wanted) {
          return signal;
        }
      }
    }
  }
  if (candidates.signals.size() == 1 || (drivetrain && !candidates.signals.empty())) {
    return candidates.signals.front();
  }
  if (candidates.signals.empty()) {
    return nullptr;
  }
  std::vector<std::string> names;
  for (const Signal* signal : candidates.signals) {
    if (names.size() < 12) {
      names.push_back("\"" + signal->name + "\"");
    }
  }
  return tl::unexpected(
      Error(RecordingError::ambiguous_channel)
          .about(quantity_name(quantity) + " channel")
          .got(fmt::format("one of {}: {}{}", candidates.signals.size(), fmt::join(names, ", "),
                           candidates.signals.size() > names.size() ? ", …" : ""))
          .hint(fmt::format("choose one with --{}", quantity_name(quantity))));
}

// Linear interpolation in a sorted signal; `cursor` only moves forward.
double interpolate(const Signal& signal, double t, std::size_t& cursor) {
  while (cursor + 1 < signal.time.size() && signal.time[cursor + 1] <= t) {
    ++cursor;
  }
  if (cursor + 1 >= signal.time.size() || t <= signal.time[cursor]) {
    return signal.value[cursor];
  }
  const double span = signal.time[cursor + 1] - signal.time[cursor];
  const double share = span > 0.0 ? (t - signal.time[cursor]) / span : 0.0;
  return signal.value[cursor] + share * (signal.value[cursor + 1] - signal.value[cursor]);
}

double hold(const Signal& signal, double t, std::size_t& cursor) {
  // Loggers stamp the channels of one loop a few microseconds apart, in any order.
  constexpr double same_loop = 1e-3;
  while (cursor + 1 < signal.time.size() && signal.time[cursor + 1] <= t + same_loop) {
    ++cursor;
  }
  return signal.value[cursor];
}

}  // namespace

Expected<FoundTests> find_tests(const Log& log, const std::string& state_channel) {
  FoundTests found;
  if (!state_channel.empty()) {
    const TextSignal* state = log.find_text(state_channel);
    if (state == nullptr) {
      std::vector<std::string_view> names;
      for (const TextSignal& text : log.texts) {
        names.push_back(text.name);
      }
      const std::string nearest = nearest_name(state_channel, names);
      return tl::unexpected(
          Error(RecordingError::no_test_state)
              .about("state channel")
              .got(fmt::format("\"{}\", which the log does not have as a text", state_channel))
              .hint(nearest.empty() ? "" : fmt::format("did you mean \"{}\"?", nearest)));
    }
    found = {state->name, subject_of(state->name), windows_of(*state)};
    if (found.windows.empty()) {
      return tl::unexpected(Error(RecordingError::no_tests)
                                .about(state_channel)
                                .got("without the name of a test")
                                .expected("quasistatic-forward, quasistatic-reverse, "
                                          "dynamic-forward or dynamic-reverse at times"));
    }
    return found;
  }
  std::vector<FoundTests> all;
  std::string silent;
  for (const TextSignal& text : log.texts) {
    std::vector<TestWindow> windows = windows_of(text);
    if (!windows.empty()) {
      all.push_back({text.name, subject_of(text.name), std::move(windows)});
    } else if (!subject_of(text.name).empty()) {
      silent = text.name;
    }
  }
  if (all.size() > 1) {
    std::vector<std::string> names;
    for (const FoundTests& tests : all) {
      names.push_back("\"" + tests.state_name + "\"");
    }
    return tl::unexpected(Error(RecordingError::ambiguous_channel)
                              .about("mechanism")
                              .got(fmt::format("one of {}: {}", all.size(), fmt::join(names, ", ")))
                              .hint("choose one with --state"));
  }
  if (all.size() == 1) {
    return all.front();
  }
  if (!silent.empty()) {
    return tl::unexpected(Error(RecordingError::no_tests)
                              .about(silent)
                              .got("\"none\" throughout")
                              .hint("no characterisation test ran while this was recorded"));
  }
  return found;
}

Expected<FoundChannels> find_channels(const Log& log, const FoundTests& tests,
                                      const LogSelection& selection) {
  FoundChannels channels;
  auto voltage = choose(log, tests, Quantity::voltage, selection.voltage_channel, nullptr,
                        channels.drivetrain);
  if (!voltage) {
    return tl::unexpected(std::move(voltage).error());
  }
  channels.voltage = *voltage;
  auto position = choose(log, tests, Quantity::position, selection.position_channel,
                         channels.voltage, channels.drivetrain);
  auto velocity = choose(log, tests, Quantity::velocity, selection.velocity_channel,
                         channels.voltage, channels.drivetrain);
  if (!position) {
    return tl::unexpected(std::move(position).error());
  }
  if (!velocity) {
    return tl::unexpected(std::move(velocity).error());
  }
  channels.position = *position;
  channels.velocity = *velocity;
  if (channels.voltage == nullptr ||
      (channels.position == nullptr && channels.velocity == nullptr)) {
    return tl::unexpected(
        Error(RecordingError::no_channel)
            .about(channels.voltage == nullptr ? "voltage channel" : "position or velocity channel")
            .got(fmt::format("not found among {} numeric channels", log.signals.size()))
            .hint(channels.voltage == nullptr
                      ? "name the channel of the applied volts with --voltage"
                      : "name them with --position and --velocity"));
  }
  return channels;
}

std::vector<TestWindow> split_by_voltage(const Signal& voltage) {
  constexpr double idle = 0.05;      // V: below this nothing is driven
  constexpr double shortest = 0.3;   // s
  constexpr double step_rise = 0.1;  // s: a step is at most of its level by then
  std::vector<TestWindow> windows;
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

std::vector<TestRun> join_channels(const FoundChannels& channels,
                                   const std::vector<TestWindow>& windows) {
  const Signal* clock = channels.voltage;
  for (const Signal* signal : {channels.position, channels.velocity}) {
    if (signal != nullptr && samples_in(*signal, windows) > samples_in(*clock, windows)) {
      clock = signal;
    }
  }
  std::vector<TestRun> runs;
  for (const TestWindow& window : windows) {
    TestRun run;
    run.kind = window.kind;
    std::size_t voltage_at = 0;
    std::size_t position_at = 0;
    std::size_t velocity_at = 0;
    for (const double t : clock->time) {
      if (t < window.begin || t >= window.end) {
        continue;
      }
      run.time.push_back(t);
      run.voltage.push_back(hold(*channels.voltage, t, voltage_at));
      if (channels.position != nullptr) {
        run.position.push_back(interpolate(*channels.position, t, position_at));
      }
      if (channels.velocity != nullptr) {
        run.velocity.push_back(interpolate(*channels.velocity, t, velocity_at));
      }
    }
    if (run.time.size() >= 2) {
      runs.push_back(std::move(run));
    }
  }
  return runs;
}

std::string position_unit_of_velocity(std::string_view unit) {
  const auto parsed = unit.empty() ? Expected<Unit>(Unit{}) : parse_unit(unit);
  if (!parsed) {
    return {};
  }
  if (parsed->dimension == Dimension::velocity) {
    return "m";
  }
  return parsed->dimension == Dimension::angular_velocity ? "rad" : std::string();
}

std::optional<MechanismKind> kind_from_name(std::string_view name) {
  const std::string text = lower(name);
  constexpr std::array<std::string_view, 2> elevator{"elevator", "lift"};
  constexpr std::array<std::string_view, 2> flywheel{"flywheel", "shooter"};
  if (contains_any(text, elevator)) {
    return MechanismKind::elevator;
  }
  if (contains_any(text, flywheel)) {
    return MechanismKind::flywheel;
  }
  return std::nullopt;
}

std::vector<Diagnostic> diagnose_drive(const SysIdJson& log) {
  std::vector<Diagnostic> found;
  const auto side = [&](std::string_view name, auto voltage_of, auto velocity_of) {
    double product = 0.0;
    double voltage_power = 0.0;
    double velocity_power = 0.0;
    std::size_t rows = 0;
    double top_voltage = 0.0;
    double travel_speed = 0.0;
    for (const SysIdJson::Run& run : log.runs) {
      const std::vector<double>& voltage = voltage_of(run);
      const std::vector<double>& velocity = velocity_of(run);
      for (std::size_t i = 0; i < std::min(voltage.size(), velocity.size()); ++i) {
        product += voltage[i] * velocity[i];
        voltage_power += voltage[i] * voltage[i];
        velocity_power += velocity[i] * velocity[i];
        top_voltage = std::max(top_voltage, std::abs(voltage[i]));
        travel_speed = std::max(travel_speed, std::abs(velocity[i]));
        ++rows;
      }
    }
    constexpr double standstill = 0.02;  // rotations a second
    if (rows > 0 && travel_speed < standstill) {
      found.push_back({"no_motion", Severity::error,
                       fmt::format("the {} side never moved: at most {:.3g} rotations/s at up to "
                                   "{:.3g} V",
                                   name, travel_speed, top_voltage)});
      return;
    }
    const double correlation = voltage_power > 0.0 && velocity_power > 0.0
                                   ? product / std::sqrt(voltage_power * velocity_power)
                                   : 0.0;
    if (correlation < -0.3) {
      found.push_back({"inverted_encoder", Severity::error,
                       fmt::format("the {} side's encoder counts against its voltage (correlation "
                                   "{:.2f}): it is inverted",
                                   name, correlation)});
    }
  };
  using Run = SysIdJson::Run;
  side(
      "left", [](const Run& r) -> const std::vector<double>& { return r.voltage; },
      [](const Run& r) -> const std::vector<double>& { return r.velocity; });
  side(
      "right", [](const Run& r) -> const std::vector<double>& { return r.right_voltage; },
      [](const Run& r) -> const std::vector<double>& { return r.right_velocity; });
  return found;
}

}  // namespace flyball::study
