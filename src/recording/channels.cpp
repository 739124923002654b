#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/channels.hpp"

namespace flyball::recording {

namespace {

using identification::TestRun;

constexpr std::array<std::string_view, 2> voltage_words{"volt", "appliedv"};
constexpr std::array<std::string_view, 4> position_words{"position", "angle", "distance", "pos"};
constexpr std::array<std::string_view, 4> velocity_words{"velocity", "speed", "rate", "vel"};
// Channels of these names are not what was applied to the mechanism, or where it was.
constexpr std::array<std::string_view, 9> other_words{
    "battery", "bus", "inputvolt", "target", "setpoint", "goal", "reference", "desired", "error"};

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

/// "/Elevator/Leader" of "/Elevator/Leader/Voltage".
std::string_view folder_of(std::string_view name) {
  const std::size_t slash = name.find_last_of('/');
  return slash == std::string_view::npos ? std::string_view() : name.substr(0, slash);
}

bool is_tested(const FoundTests& tests, double time) {
  return tests.windows.empty() ||
         std::any_of(tests.windows.begin(), tests.windows.end(),
                     [&](const auto& window) { return time >= window.begin && time < window.end; });
}

/// How far another channel is from the first one's values in the tests, as a share of those: leader
/// and followers show the same, perhaps with the other sign, positions perhaps from another zero,
/// and each in its own row: what lies between the neighbouring rows is no difference.
double disagreement(const Signal& first, const Signal& other, const FoundTests& tests,
                    Channel quantity) {
  double sum_a = 0.0;
  double sum_b = 0.0;
  double squares = 0.0;
  double products = 0.0;
  double rows = 0.0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < first.time.size(); ++i) {
    if (is_tested(tests, first.time[i])) {
      const double a = first.value[i];
      const double b = interpolate(other, first.time[i], at);
      rows += 1.0;
      sum_a += a;
      sum_b += b;
      squares += a * a;
      products += a * b;
    }
  }
  const double share = quantity == Channel::position ? 1.0 / std::max(1.0, rows) : 0.0;
  const double own = squares - share * sum_a * sum_a;
  const double sign = products - share * sum_a * sum_b < 0.0 ? -1.0 : 1.0;
  const double zero = share * (sum_a - sign * sum_b);
  double missed = 0.0;
  at = 0;
  for (std::size_t i = 0; i < first.time.size(); ++i) {
    if (is_tested(tests, first.time[i])) {
      const double b = interpolate(other, first.time[i], at);
      const std::size_t next = std::min(at + 1, other.value.size() - 1);
      const auto [low, high] = std::minmax({b, other.value[at], other.value[next]});
      const double wanted = sign * (first.value[i] - zero);
      const double off = wanted - std::clamp(wanted, low, high);
      missed += off * off;
    }
  }
  return own > 0.0 ? std::sqrt(missed / own) : 1.0;
}

Expected<const Signal*> choose(const Log& log, const FoundTests& tests, Channel quantity,
                               const std::string& said, const Signal* voltage,
                               std::vector<Diagnostic>& notes) {
  if (!said.empty()) {
    return named_channel(log, said, quantity);
  }
  std::vector<const Signal*> candidates = candidates_for(log, tests, quantity);
  if (candidates.size() > 1 && voltage != nullptr) {
    // The voltage's namesake: "position-wrist-Coral" beside "voltage-wrist-Coral".
    std::string wanted = lower(voltage->name);
    const std::size_t at = wanted.find("voltage");
    if (at != std::string::npos) {
      wanted.replace(at, std::string_view("voltage").size(), channel_name(quantity));
      for (const Signal* signal : candidates) {
        if (lower(signal->name) == wanted) {
          return signal;
        }
      }
    }
    const Side side = side_of(voltage->name);
    if (side != Side::none) {
      std::erase_if(candidates, [&](const Signal* s) { return side_of(s->name) != side; });
    }
  }
  if (candidates.size() > 1 && voltage != nullptr && !folder_of(voltage->name).empty()) {
    std::vector<const Signal*> beside;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(beside),
                 [&](const Signal* s) { return folder_of(s->name) == folder_of(voltage->name); });
    candidates = beside.empty() ? candidates : beside;
  }
  if (candidates.size() == 1) {
    return candidates.front();
  }
  if (candidates.empty()) {
    return nullptr;
  }
  // Several motors of one mechanism: a leader and its followers.
  const Signal& first = *candidates.front();
  double farthest = 0.0;
  for (const Signal* signal : candidates) {
    farthest = std::max(farthest, disagreement(first, *signal, tests, quantity));
  }
  constexpr double alike = 0.05;
  if (farthest < alike) {
    note(
        notes, "several_motors",
        "{} {} channels show the same within {:.2g} % (signs and zeros aside), as of motors on one "
        "mechanism: \"{}\" is used",
        candidates.size(), channel_name(quantity), 100.0 * farthest, first.name);
    return &first;
  }
  std::vector<std::string> names;
  for (const Signal* signal : candidates) {
    if (names.size() < 12) {
      names.push_back("\"" + signal->name + "\"");
    }
  }
  return refusal(RecordingError::ambiguous_channel, {}, channel_name(quantity) + " channel")
      .got(
          fmt::format("one of {}: {}{}; they differ by up to {:.2g} % of the first, so not all are "
                      "of one mechanism's motors",
                      candidates.size(), fmt::join(names, ", "),
                      candidates.size() > names.size() ? ", …" : "", 100.0 * farthest))
      .hint(fmt::format("choose one with --{}", channel_name(quantity)));
}

double hold(const Signal& signal, double t, std::size_t& cursor) {
  // Loggers stamp the channels of one loop a few microseconds apart, in any order.
  constexpr double same_loop = 1e-3;
  while (cursor + 1 < signal.time.size() && signal.time[cursor + 1] <= t + same_loop) {
    ++cursor;
  }
  return signal.value[cursor];
}

double median_step(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i) {
    steps.push_back(time[i] - time[i - 1]);
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return steps.empty() ? 0.0 : *middle;
}

constexpr std::array every_channel{Channel::voltage, Channel::position, Channel::velocity};

}  // namespace

bool fits(const Signal& signal, Channel quantity) {
  const std::string name = lower(signal.name);
  if (contains_any(name, other_words)) {
    return false;
  }
  const auto unit = signal.unit.empty() ? Expected<Unit>(Unit{}) : parse_unit(signal.unit);
  const bool known = !signal.unit.empty() && unit.has_value();
  const Dimension dimension = known ? unit->dimension : Dimension::dimensionless;
  switch (quantity) {
    case Channel::voltage:
      return contains_any(name, voltage_words) && (!known || dimension == Dimension::voltage);
    case Channel::position:
      return contains_any(name, position_words) && !contains_any(name, velocity_words) &&
             (!known || dimension == Dimension::length || dimension == Dimension::angle);
    case Channel::velocity:
      return contains_any(name, velocity_words) && (!known || dimension == Dimension::velocity ||
                                                    dimension == Dimension::angular_velocity);
  }
  return false;
}

std::vector<const Signal*> candidates_for(const Log& log, const FoundTests& tests,
                                          Channel quantity) {
  std::vector<const Signal*> all;
  std::vector<const Signal*> of_subject;
  for (const Signal& signal : log.signals) {
    if (!fits(signal, quantity) || samples_in(signal, tests.windows) < 2) {
      continue;
    }
    all.push_back(&signal);
    if (!tests.subject.empty() && signal.name.ends_with("-" + tests.subject)) {
      of_subject.push_back(&signal);
    }
  }
  return of_subject.empty() ? all : of_subject;
}

std::string channel_name(Channel quantity) {
  switch (quantity) {
    case Channel::voltage:
      return "voltage";
    case Channel::position:
      return "position";
    case Channel::velocity:
      return "velocity";
  }
  return "";
}

Expected<const Signal*> named_channel(const Log& log, const std::string& name, Channel quantity) {
  if (const Signal* signal = log.find_signal(name)) {
    return signal;
  }
  std::vector<std::string_view> names;
  names.reserve(log.signals.size());
  for (const Signal& signal : log.signals) {
    names.push_back(signal.name);
  }
  const std::string nearest = nearest_name(name, names);
  return refusal(RecordingError::no_channel, {}, channel_name(quantity) + " channel")
      .got(fmt::format("\"{}\", which the log does not have", name))
      .hint(nearest.empty() ? std::string("flyball lists the channels when it cannot choose")
                            : fmt::format("did you mean \"{}\"?", nearest));
}

std::string fullest_channels(const Log& log, const FoundTests& tests) {
  constexpr std::size_t shown = 12;
  // What may be a motor's comes before pictures of a camera.
  constexpr std::array<std::string_view, 11> motors{"volt",    "output", "applied", "duty",
                                                    "percent", "posi",   "veloc",   "angle",
                                                    "speed",   "encod",  "rpm"};
  std::vector<std::pair<std::size_t, const Signal*>> all;
  for (const Signal& signal : log.signals) {
    if (const std::size_t samples = samples_in(signal, tests.windows); samples >= 2) {
      all.emplace_back(samples, &signal);
    }
  }
  std::stable_sort(all.begin(), all.end(), [&](const auto& a, const auto& b) {
    const bool first = contains_any(lower(a.second->name), motors);
    const bool second = contains_any(lower(b.second->name), motors);
    return first != second ? first : a.first > b.first;
  });
  std::vector<std::string> names;
  bool more = false;
  for (const auto& [samples, signal] : all) {
    std::string name = "\"" + signal->name + "\"";
    // A log can start an entry anew under the same name.
    if (std::ranges::find(names, name) != names.end()) {
      continue;
    }
    if (names.size() == shown) {
      more = true;
      break;
    }
    names.push_back(std::move(name));
  }
  if (names.empty()) {
    return ", none of which has two samples in the tests";
  }
  return fmt::format(", such as {}{}", fmt::join(names, ", "), more ? ", …" : "");
}

std::string drivetrain_reason(const Log& log, const FoundTests& tests,
                              const LogSelection& selection) {
  const bool said = selection.mechanism || !selection.voltage_channel.empty() ||
                    !selection.position_channel.empty() || !selection.velocity_channel.empty();
  const auto pair = [&](const std::string& text) {
    return text.find(',') != std::string::npos && log.find_signal(text) == nullptr;
  };
  if (selection.drivetrain || (!selection.mechanism && (pair(selection.voltage_channel) ||
                                                        pair(selection.position_channel) ||
                                                        pair(selection.velocity_channel)))) {
    return "as said";
  }
  // An elevator lifted by a left and a right motor is an elevator.
  if (said || kind_from_name(tests.state_name)) {
    return {};
  }
  if (names_drivetrain(tests.state_name)) {
    return fmt::format("\"{}\" names it one", tests.state_name);
  }
  for (const Channel quantity : every_channel) {
    const Signal* left = nullptr;
    const Signal* right = nullptr;
    for (const Signal* signal : candidates_for(log, tests, quantity)) {
      const Side side = side_of(signal->name);
      left = side == Side::left && left == nullptr ? signal : left;
      right = side == Side::right && right == nullptr ? signal : right;
    }
    if (left != nullptr && right != nullptr) {
      return fmt::format("\"{}\" and \"{}\" are a left and a right side", left->name, right->name);
    }
  }
  return {};
}

Expected<FoundChannels> find_channels(const Log& log, const FoundTests& tests,
                                      const LogSelection& selection,
                                      std::vector<Diagnostic>& notes) {
  FoundChannels channels;
  FLYBALL_TRY(channels.voltage,
              choose(log, tests, Channel::voltage, selection.voltage_channel, nullptr, notes));
  FLYBALL_TRY(channels.position, choose(log, tests, Channel::position, selection.position_channel,
                                        channels.voltage, notes));
  FLYBALL_TRY(channels.velocity, choose(log, tests, Channel::velocity, selection.velocity_channel,
                                        channels.voltage, notes));
  if (channels.voltage == nullptr ||
      (channels.position == nullptr && channels.velocity == nullptr)) {
    return refusal(RecordingError::no_channel, {},
                   channels.voltage == nullptr ? "voltage channel" : "position or velocity channel")
        .got(fmt::format("not found by name among {} numeric channels{}", log.signals.size(),
                         fullest_channels(log, tests)))
        .hint(channels.voltage == nullptr ? "name the channel of the applied volts with --voltage"
                                          : "name them with --position and --velocity");
  }
  return channels;
}

std::size_t leave_other_routines(const Signal& voltage, FoundTests& tests) {
  constexpr double idle = 0.05;  // V
  return std::erase_if(tests.windows, [&](const CharacterizationWindow& window) {
    bool any = false;
    for (std::size_t i = 0; i < voltage.time.size(); ++i) {
      if (voltage.time[i] >= window.begin && voltage.time[i] < window.end) {
        any = true;
        if (!(std::abs(voltage.value[i]) <= idle)) {
          return false;
        }
      }
    }
    return any;
  });
}

const Signal* fullest_of(std::initializer_list<const Signal*> signals,
                         const std::vector<CharacterizationWindow>& windows) {
  const Signal* fullest = nullptr;
  for (const Signal* signal : signals) {
    if (signal != nullptr &&
        (fullest == nullptr || samples_in(*signal, windows) > samples_in(*fullest, windows))) {
      fullest = signal;
    }
  }
  return fullest;
}

std::vector<double> sampled(const Signal& signal, const std::vector<double>& time) {
  std::vector<double> values;
  std::size_t cursor = 0;
  for (const double t : time) {
    values.push_back(interpolate(signal, t, cursor));
  }
  return values;
}

std::vector<TestRun> join_channels(const FoundChannels& channels,
                                   const std::vector<CharacterizationWindow>& windows,
                                   const Signal* clock) {
  const double longest_gap = std::max(0.9, 20.0 * median_step(clock->time));  // s
  std::vector<TestRun> runs;
  for (const CharacterizationWindow& window : windows) {
    TestRun run;
    run.kind = window.kind;
    const auto end_run = [&] {
      if (run.time.size() >= 2) {
        runs.push_back(run);
      }
      run = TestRun{.kind = window.kind};
    };
    std::size_t voltage_at = 0;
    std::size_t position_at = 0;
    std::size_t velocity_at = 0;
    for (const double t : clock->time) {
      if (t < window.begin || t >= window.end) {
        continue;
      }
      // Nothing was recorded for long: another test of the kind began (time began anew), or the
      // logger stood still.
      if (!run.time.empty() && t - run.time.back() > longest_gap) {
        end_run();
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
    end_run();
  }
  return runs;
}

}  // namespace flyball::recording
