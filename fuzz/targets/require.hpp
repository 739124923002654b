#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

namespace flyball::fuzz {

/// Ends the run, which is how libFuzzer learns of an input that breaks a promise.
inline void require(bool holds, const char* promise) {
  if (!holds) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
  }
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

inline void require_finite(const std::vector<double>& values) {
  require(std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }),
          "numbers are finite");
}

inline void require_time(const std::vector<double>& time) {
  require_finite(time);
  require(std::is_sorted(time.begin(), time.end()), "times ascend");
}

}  // namespace flyball::fuzz
