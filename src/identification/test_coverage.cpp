#include <algorithm>
#include <cmath>
#include <vector>

#include <flyball/identification/identification_error.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/statistics.hpp"
#include "identification/test_coverage.hpp"

namespace flyball::identification {
namespace {

constexpr std::string_view in_test_coverage = "identify";
constexpr double apart = 1.2;  // the ratio of two steps' voltages that tell friction from speed

Error no_motion(const PreparedRecording& prepared) {
  double voltage = 0.0;
  double travel = 0.0;
  for (const PreparedRun& run : prepared.runs) {
    for (const double value : run.run.voltage) {
      voltage = std::max(voltage, std::abs(value));
    }
    if (!run.run.position.empty()) {
      const auto [low, high] =
          std::minmax_element(run.run.position.begin(), run.run.position.end());
      travel = std::max(travel, *high - *low);
    }
  }
  return refusal(IdentificationError::no_motion, in_test_coverage)
      .hint(voltage < 0.1 ? "no voltage was applied either: the log was started but no test ran"
                          : "check that the encoder counts and that the mechanism is free")
      .with("largest voltage (V)", voltage)
      .with("largest travel (" + prepared.unit + ")", travel);
}

double median_of_window(const PreparedRun& run, const std::vector<double>& values,
                        std::size_t first) {
  std::vector<double> magnitudes;
  for (std::size_t i = first; i < run.last; ++i) {
    magnitudes.push_back(std::abs(values[i]));
  }
  return median(std::move(magnitudes));
}

}  // namespace

Expected<TestCoverage> cover_tests(const PreparedRecording& prepared) {
  if (prepared.runs.empty()) {
    return refusal(IdentificationError::no_data, in_test_coverage)
        .hint("record the four tests again");
  }
  TestCoverage coverage;
  double lowest = 0.0;
  double highest = 0.0;
  double end_speed = 0.0;
  for (const PreparedRun& run : prepared.runs) {
    if (!run.moved) {
      continue;
    }
    const bool ramp = is_quasistatic(run.run.kind);
    coverage.ramps = coverage.ramps || ramp;
    coverage.steps = coverage.steps || !ramp;
    coverage.forward = coverage.forward || run.direction > 0.0;
    coverage.backward = coverage.backward || run.direction < 0.0;
    const double voltage = median_of_window(run, run.run.voltage, run.first);
    if (!ramp && (lowest == 0.0 || voltage < lowest)) {
      lowest = voltage;
    }
    if (!ramp && voltage > highest) {
      highest = voltage;
      end_speed = median_of_window(run, run.smoothed_velocity,
                                   run.last - std::max<std::size_t>(1, (run.last - run.first) / 5));
    }
  }
  if (!coverage.ramps && !coverage.steps) {
    return tl::unexpected(no_motion(prepared));
  }
  if (!coverage.ramps && highest < apart * lowest) {
    return refusal(IdentificationError::missing_tests, in_test_coverage,
                   "quasistatic tests (ramps)")
        .got("missing or without usable motion")
        .hint(detail::format(
            "steps of one voltage alone tell that {:.3g} V end in {:.3g} {}/s, friction and speed "
            "in one; record quasistatic-forward and quasistatic-reverse, or steps of another "
            "voltage",
            highest, end_speed, prepared.unit))
        .with("voltage of the steps (V)", highest)
        .with("speed at their end (" + prepared.unit + "/s)", end_speed);
  }
  return coverage;
}

}  // namespace flyball::identification
