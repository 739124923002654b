#pragma once

#include <cstddef>
#include <vector>

#include <flyball/recording/trajectory_file.hpp>

namespace flyball::recording {

/// Differences, half from each side, of what samples say at their times.
template <class Get, class Difference>
auto slopes(const std::vector<MotionSample>& samples, const Get& get,
            const Difference& difference) {
  using Value = decltype(get(samples.front()));
  std::vector<Value> result;
  const std::size_t n = samples.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i == 0 ? 0 : i - 1;
    const std::size_t b = i + 1 < n ? i + 1 : i;
    const double dt = samples[b].time - samples[a].time;
    result.push_back(Value(difference(get(samples[b]), get(samples[a])) / dt));
  }
  return result;
}

}  // namespace flyball::recording
