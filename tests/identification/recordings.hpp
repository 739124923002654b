#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/identification/recording.hpp>

#include "scenarios.hpp"

namespace recordings {

using flyball::Diagnostic;
using flyball::identification::Recording;

/// A clean recording of one of the benchmark's mechanisms.
inline Recording record(std::size_t mechanism, std::uint64_t seed = 1) {
  return flyball::record_characterization(
             scenarios::session(scenarios::mechanisms.at(mechanism), seed))
      .value();
}

inline constexpr std::size_t flywheel = 1;
inline constexpr std::size_t elevator = 2;
inline constexpr std::size_t arm = 4;

inline const Diagnostic* find(const std::vector<Diagnostic>& diagnostics, std::string_view code) {
  const auto found =
      std::find_if(diagnostics.begin(), diagnostics.end(),
                   [code](const Diagnostic& diagnostic) { return diagnostic.code == code; });
  return found != diagnostics.end() ? &*found : nullptr;
}

inline void negate(std::vector<double>& values) {
  for (double& value : values) {
    value = -value;
  }
}

}  // namespace recordings
