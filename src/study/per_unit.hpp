#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include <flyball/study/identify.hpp>

namespace flyball::study {

/// Whether the recorded voltage may have been a duty cycle: gains then are per unit of what was
/// recorded, and the battery's voltage times that in volts.
[[nodiscard]] inline bool is_per_unit(const IdentifyResult& result) {
  const std::vector<Diagnostic>& all = result.source.diagnostics;
  return std::any_of(all.begin(), all.end(),
                     [](const Diagnostic& found) { return found.code == "duty_cycle"; });
}

/// What a gain's unit says instead of volts.
[[nodiscard]] inline std::string_view volts_of(const IdentifyResult& result) {
  return is_per_unit(result) ? "p.u." : "V";
}

/// For who opens a file of gains alone.
inline constexpr std::string_view per_unit_comment =
    "Mind: p.u. is one of what was recorded as the voltage, which never exceeds 1. If that was a\n"
    "duty cycle, take the gains times the battery's voltage, or identify with --voltage-scale 12.";

}  // namespace flyball::study
