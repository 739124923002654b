#pragma once

#include <chrono>

namespace bench {

/// Time of one of `calls` calls in microseconds. Take the smallest of several: another process may
/// hold the machine in any of them.
template <class Work>
double microseconds(int calls, Work&& work) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  for (int k = 0; k < calls; ++k) {
    work();
  }
  const std::chrono::duration<double, std::micro> elapsed = Clock::now() - start;
  return elapsed.count() / calls;
}

}  // namespace bench
