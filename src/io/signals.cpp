#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/diagnose.hpp"
#include "io/signals.hpp"
#include "io/text.hpp"

namespace flyball::io {
namespace {

/// Counts of what was done to the channels, with the first one's name as the example.
struct Tally {
  std::size_t samples = 0;
  std::size_t channels = 0;
  std::string example;

  void add(std::size_t count, const std::string& name) {
    if (count == 0) {
      return;
    }
    example = channels == 0 ? name : example;
    samples += count;
    ++channels;
  }
};

std::size_t drop_non_finite(Signal& signal) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < signal.time.size(); ++i) {
    if (std::isfinite(signal.time[i]) && std::isfinite(signal.value[i])) {
      signal.time[kept] = signal.time[i];
      signal.value[kept] = signal.value[i];
      ++kept;
    }
  }
  const std::size_t dropped = signal.time.size() - kept;
  signal.time.resize(kept);
  signal.value.resize(kept);
  return dropped;
}

/// Sorts a channel by time, equal times in their order; returns how many steps went backwards.
template <class Channel>
std::size_t sort_by_time(Channel& channel) {
  std::size_t backward = 0;
  for (std::size_t i = 1; i < channel.time.size(); ++i) {
    backward += channel.time[i] < channel.time[i - 1] ? 1 : 0;
  }
  if (backward == 0) {
    return 0;
  }
  std::vector<std::size_t> order(channel.time.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return channel.time[a] < channel.time[b]; });
  Channel sorted = channel;
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted.time[i] = channel.time[order[i]];
    sorted.value[i] = std::move(channel.value[order[i]]);
  }
  channel = std::move(sorted);
  return backward;
}

}  // namespace

void tidy(Log& log) {
  Tally non_finite;
  Tally unsorted;
  for (Signal& signal : log.signals) {
    non_finite.add(drop_non_finite(signal), signal.name);
    unsorted.add(sort_by_time(signal), signal.name);
  }
  for (TextSignal& text : log.texts) {
    unsorted.add(sort_by_time(text), text.name);
  }
  std::erase_if(log.signals, [](const Signal& s) { return s.time.empty(); });
  std::erase_if(log.texts, [](const TextSignal& t) { return t.time.empty(); });
  if (non_finite.samples > 0) {
    warn(log.diagnostics, "non_finite_rows",
         "{} of {} (such as {}) held NaN or infinity and were dropped",
         counted(non_finite.samples, "sample"), counted(non_finite.channels, "channel"),
         printable(non_finite.example));
  }
  if (unsorted.samples > 0) {
    warn(log.diagnostics, "unsorted_time",
         "time runs backwards {} in {} (such as {}); each was sorted by time",
         counted(unsorted.samples, "time"), counted(unsorted.channels, "channel"),
         printable(unsorted.example));
  }
}

Error with_diagnostics(Error error, const std::vector<Diagnostic>& diagnostics) {
  for (const Diagnostic& diagnostic : diagnostics) {
    std::move(error).with(diagnostic.code, diagnostic.message);
  }
  return error;
}

}  // namespace flyball::io
