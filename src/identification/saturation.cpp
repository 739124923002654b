#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/diagnose.hpp"
#include "identification/statistics.hpp"
#include "identification/trimming.hpp"

namespace flyball::identification {
namespace {

constexpr double flat = 0.03;            // of the speed, that a plateau may differ by
constexpr double shortest_share = 0.12;  // of the largest voltage, that a plateau must span
constexpr double shortest = 0.3;         // s
constexpr double missed = 0.06;          // of the speed, by which a plateau stays behind the ramp
constexpr double alike = 0.06;           // of the voltage, by which the knees of two ramps differ

struct Knee {
  double voltage;  ///< V, where the ramp's line reaches the plateau.
  double speed;
  double largest;  ///< V, that was recorded.
  double rate;     ///< V/s, of the ramp.
};

/// s, by which the speed lags a voltage: until it has risen by 1 − 1/e after a step; 0 without one.
double lag_of(const PreparedRecording& recording) {
  constexpr double risen = 0.632;
  std::vector<double> lags;
  for (const PreparedRun& run : recording.runs) {
    if (!run.moved || is_quasistatic(run.run.kind)) {
      continue;
    }
    const std::vector<double>& time = run.run.time;
    std::vector<double> speeds;
    double largest = 0.0;
    for (std::size_t i = 0; i < time.size(); ++i) {
      speeds.push_back(std::abs(run.smoothed_velocity[i]));
      largest = std::max(largest, std::abs(run.run.voltage[i]));
    }
    const double top = quantile(speeds, 0.9);
    std::size_t edge = 0;
    while (edge < time.size() && std::abs(run.run.voltage[edge]) < 0.5 * largest) {
      ++edge;
    }
    std::size_t there = edge;
    while (there < time.size() && speeds[there] < risen * top) {
      ++there;
    }
    if (there < time.size()) {
      lags.push_back(time[there] - time[edge]);
    }
  }
  return lags.empty() ? 0.0 : median(std::move(lags));
}

/// Where the speed of a ramp no longer follows the voltage.
std::optional<Knee> knee_of(const PreparedRun& prepared) {
  const TestRun& run = prepared.run;
  const std::vector<double>& velocity = prepared.smoothed_velocity;
  std::size_t last = 0;
  for (std::size_t i = 0; i < run.voltage.size(); ++i) {
    last = std::abs(run.voltage[i]) > std::abs(run.voltage[last]) ? i : last;
  }
  const double largest = std::abs(run.voltage[last]);
  std::size_t rows = 0;
  std::vector<double> end;
  for (std::size_t i = 0; i <= last && i < velocity.size(); ++i) {
    if (std::abs(run.voltage[i]) > (1.0 - 0.5 * shortest_share) * largest) {
      end.push_back(std::abs(velocity[i]));
    }
    ++rows;
  }
  if (rows < 30 || end.size() < 3) {
    return std::nullopt;
  }
  const double plateau = median(std::move(end));
  std::size_t knee = last;
  while (knee > 0 && std::abs(std::abs(velocity[knee - 1]) - plateau) < flat * plateau) {
    --knee;
  }
  const double at_knee = std::abs(run.voltage[knee]);
  if (run.time[last] - run.time[knee] < shortest || largest - at_knee < shortest_share * largest) {
    return std::nullopt;
  }
  // V = a + b v of what leads up to it.
  double n = 0.0;
  double sv = 0.0;
  double sV = 0.0;
  double svv = 0.0;
  double svV = 0.0;
  for (std::size_t i = 0; i < knee; ++i) {
    const double v = std::abs(velocity[i]);
    if (v > 0.2 * plateau && v < (1.0 - 2.0 * flat) * plateau) {
      n += 1.0;
      sv += v;
      sV += std::abs(run.voltage[i]);
      svv += v * v;
      svV += v * std::abs(run.voltage[i]);
    }
  }
  const double spread = svv - sv * sv / std::max(1.0, n);
  if (n < 10.0 || !(spread > 0.0)) {
    return std::nullopt;
  }
  const double slope = (svV - sv * sV / n) / spread;
  const double voltage = (sV - slope * sv) / n + slope * plateau;
  if (!(slope > 0.0) || (largest - voltage) / slope < missed * plateau || voltage <= 0.0) {
    return std::nullopt;
  }
  const double rate = (largest - at_knee) / (run.time[last] - run.time[knee]);
  return Knee{voltage, plateau, largest, rate};
}

}  // namespace

void mend_saturation(PreparedRecording& recording) {
  std::vector<Knee> knees;
  double reached = 0.0;  // V, by a ramp without a knee
  for (const PreparedRun& run : recording.runs) {
    if (!run.moved || !is_quasistatic(run.run.kind)) {
      continue;
    }
    if (const auto knee = knee_of(run)) {
      knees.push_back(*knee);
    } else {
      for (const double volts : run.run.voltage) {
        reached = std::max(reached, std::abs(volts));
      }
    }
  }
  const double lag = knees.empty() ? 0.0 : lag_of(recording);
  for (Knee& knee : knees) {
    knee.voltage = std::max(0.5 * knee.voltage, knee.voltage - lag * knee.rate);
  }
  // Gravity may hold one ramp of an arm at one speed, not both.
  const bool turns_on = recording.mechanism && controls_velocity(*recording.mechanism);
  if (knees.size() < (turns_on ? 1U : 2U)) {
    return;
  }
  const auto [least, most] =
      std::minmax_element(knees.begin(), knees.end(),
                          [](const Knee& a, const Knee& b) { return a.voltage < b.voltage; });
  if (most->voltage - least->voltage > alike * most->voltage ||
      reached > (1.0 + alike) * most->voltage) {
    return;
  }
  const double limit = 0.5 * (least->voltage + most->voltage);
  for (PreparedRun& run : recording.runs) {
    for (double& volts : run.run.voltage) {
      volts = std::clamp(volts, -limit, limit);
    }
  }
  warn(recording.diagnostics, "saturated",
       "the speed stays at {:.3g} {}/s from {:.3g} V on while the recorded voltage rises to {:.3g} "
       "V: the motors get no more (the battery, a limit of the voltage or of the speed), and the "
       "log holds what was commanded. Voltages above were taken for {:.3g} V",
       most->speed, recording.unit, limit, most->largest, limit);
}

}  // namespace flyball::identification
