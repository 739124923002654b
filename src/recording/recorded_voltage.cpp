#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/recording/load_recording.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/recorded_voltage.hpp"

namespace flyball::recording {

using identification::TestRun;

double volts_a_unit(std::string_view unit, std::string_view name) {
  if (const auto parsed = parse_unit(unit);
      !unit.empty() && parsed && parsed->dimension == Dimension::voltage) {
    return parsed->factor;
  }
  const std::string text = lower(name);
  const bool ends = text.size() > 2 && text.ends_with("mv") &&
                    (name.ends_with("mV") || std::string_view("_ -./").find(
                                                 text[text.size() - 3]) != std::string_view::npos);
  constexpr std::array<std::string_view, 4> words{"millivolt", "(mv)", "[mv]", "in mv"};
  return ends || contains_any(text, words) ? 1e-3 : 1.0;
}

Expected<void> check_voltage(const std::vector<TestRun>& runs, std::vector<Diagnostic>& notes) {
  constexpr double highest = 60.0;     // V, of any battery that a robot has
  constexpr double usual = 16.0;       // V, of a 12 V battery being charged
  constexpr double duty = 1.05;        // a duty cycle, with its noise
  constexpr double battery_low = 6.0;  // V
  double largest = 0.0;
  double least = highest;
  double most = -highest;
  std::size_t rows = 0;
  bool forward = false;
  bool backward = false;
  for (const TestRun& run : runs) {
    for (const double volts : run.voltage) {
      largest = std::max(largest, std::abs(volts));
      least = std::min(least, volts);
      most = std::max(most, volts);
      ++rows;
    }
    (is_forward(run.kind) ? forward : backward) = true;
  }
  if (rows == 0) {
    return {};
  }
  if (largest > highest) {
    return refusal(RecordingError::unit_mismatch, {}, "the voltage channel")
        .got(fmt::format("up to {:.4g}", largest))
        .expected("volts, as applied to the motors")
        .hint(fmt::format("if it is a percentage or counts, say how many volts one is with "
                          "--voltage-scale ({:.3g} if the largest is 12 V); else name the channel "
                          "of the applied volts with --voltage",
                          12.0 / largest));
  }
  if (least > battery_low && most - least < 0.4 * most && forward && backward) {
    return refusal(RecordingError::unit_mismatch, {}, "the voltage channel")
        .got(fmt::format("from {:.3g} to {:.3g} V in tests in both directions", least, most))
        .expected("what was applied to the motors, which changes with the tests")
        .hint("it looks like the battery's; name the channel of the applied volts with --voltage");
  }
  if (largest > usual) {
    warn(notes, "high_voltage",
         "the voltage reaches {:.3g} V, which a 12 V battery does not give; if these are no volts, "
         "say how many one is with --voltage-scale",
         largest);
  } else if (largest <= duty && largest > 0.2) {
    warn(notes, "duty_cycle",
         "the voltage never exceeds {:.3g} V: if it is a duty cycle from -1 to 1, all gains are "
         "twelve times too small; say so with --voltage-scale 12 (the battery's voltage)",
         largest);
  }
  return {};
}

}  // namespace flyball::recording
