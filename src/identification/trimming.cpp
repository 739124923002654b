#include <algorithm>
#include <cmath>
#include <string>

#include "core/diagnose.hpp"
#include "identification/statistics.hpp"
#include "identification/trimming.hpp"

namespace flyball::identification {
namespace {

constexpr double sustained = 0.1;     // s, a ramp has started when motion lasts so long
constexpr double stalled = 0.06;      // s, a stop is hit when rest under voltage lasts so long
constexpr double minimum_ramp = 0.3;  // s, below this a ramp says nothing
constexpr double minimum_step = 0.1;  // s
constexpr double short_step = 0.35;   // s, below this a step is used with a warning
constexpr double rest_window = 0.1;   // s before the step in which the mechanism must be at rest
constexpr double rest_share = 0.03;   // of top speed

double top_of(const std::vector<double>& values, double q) {
  std::vector<double> magnitudes(values.size());
  std::transform(values.begin(), values.end(), magnitudes.begin(),
                 [](double value) { return std::abs(value); });
  return quantile(std::move(magnitudes), q);
}

/// Whether `holds(j)` for all rows from i for `duration` seconds (at least to the last row).
template <class Predicate>
bool lasts(const std::vector<double>& time, std::size_t i, std::size_t end, double duration,
           Predicate holds) {
  const double until = time[i] + duration;
  for (std::size_t j = i; j < end && time[j] <= until; ++j) {
    if (!holds(j)) {
      return false;
    }
  }
  return true;
}

bool rests_before(const PreparedRun& prepared, const PreparedRecording& recording,
                  std::size_t row) {
  const TestRun& run = prepared.run;
  const std::size_t begin = lower_index(run.time, run.time[row] - rest_window);
  const double limit = rest_share * recording.top_speed;
  if (recording.has_position && run.time[row] - run.time[begin] > 0.03) {
    const double moved = std::abs(run.position[row] - run.position[begin]);
    return moved <=
           std::max(2.5 * recording.position_quantum, limit * (run.time[row] - run.time[begin]));
  }
  if (recording.has_velocity) {
    const std::vector<double> before(run.velocity.begin() + static_cast<std::ptrdiff_t>(begin),
                                     run.velocity.begin() + static_cast<std::ptrdiff_t>(row) + 1);
    return std::abs(median(before)) <= limit;
  }
  // Nothing was recorded before the step: the routine starts it from rest, a person's cut may not.
  return !prepared.begins_cut || std::abs(prepared.smoothed_velocity[row]) <= limit;
}

/// The longest stretch of [first, last) without a gap in time.
void keep_longest_stretch(PreparedRun& prepared, double longest_gap,
                          std::vector<Diagnostic>& diagnostics) {
  const std::vector<double>& time = prepared.run.time;
  std::size_t best_first = prepared.first;
  std::size_t best_last = prepared.first;
  std::size_t start = prepared.first;
  std::size_t gaps = 0;
  double widest = 0.0;
  for (std::size_t i = prepared.first + 1; i <= prepared.last; ++i) {
    const bool gap = i < prepared.last && time[i] - time[i - 1] > longest_gap;
    if (gap) {
      ++gaps;
      widest = std::max(widest, time[i] - time[i - 1]);
    }
    if (gap || i == prepared.last) {
      if (i - start > best_last - best_first) {
        best_first = start;
        best_last = i;
      }
      start = i;
    }
  }
  if (gaps > 0) {
    warn(diagnostics, "gaps",
         "{}: {} gap{} in time (the widest {:.0f} ms); only the longest stretch without one is "
         "used ({} of {} rows)",
         to_string(prepared.run.kind), gaps, gaps == 1 ? "" : "s", 1e3 * widest,
         best_last - best_first, prepared.last - prepared.first);
    prepared.starts_at_rest = prepared.starts_at_rest && best_first == prepared.first;
    prepared.first = best_first;
    prepared.last = best_last;
  }
}

struct Limits {
  double speed;        // below this is rest
  double top_voltage;  // of the run
};

/// First row of sustained motion, or `end`.
std::size_t motion_start(const PreparedRun& prepared, std::size_t begin, std::size_t end,
                         const Limits& limits) {
  for (std::size_t i = begin; i < end; ++i) {
    const auto moves = [&](std::size_t j) {
      return prepared.direction * prepared.smoothed_velocity[j] > limits.speed;
    };
    if (moves(i) && lasts(prepared.run.time, i, end, sustained, moves)) {
      return i;
    }
  }
  return end;
}

void mark_window(PreparedRun& prepared, PreparedRecording& recording,
                 const PreparationOptions& options) {
  const TestRun& run = prepared.run;
  const double top_voltage = top_of(run.voltage, 0.98);
  const double run_speed = top_of(prepared.smoothed_velocity, 0.98);
  const Limits limits{std::min(options.motion_threshold * recording.top_speed, 0.15 * run_speed),
                      top_voltage};
  const std::string name(to_string(run.kind));

  std::size_t end = run.time.size();
  while (end > 0 && std::abs(run.voltage[end - 1]) < options.voltage_threshold * top_voltage) {
    --end;
  }

  std::size_t begin = 0;
  std::size_t moving = 0;
  if (is_quasistatic(run.kind)) {
    begin = motion_start(prepared, 0, end, limits);
    moving = begin;
  } else {
    while (begin < end && std::abs(run.voltage[begin]) < 0.5 * top_voltage) {
      ++begin;
    }
    while (begin > 0 &&
           std::abs(run.voltage[begin - 1]) >= options.voltage_threshold * top_voltage) {
      --begin;
    }
    prepared.starts_at_rest = begin < end && rests_before(prepared, recording, begin);
    moving = motion_start(prepared, begin, end, limits);
  }

  for (std::size_t i = moving; i < end; ++i) {
    const auto stalls = [&](std::size_t j) {
      return prepared.direction * prepared.smoothed_velocity[j] < limits.speed &&
             std::abs(run.voltage[j]) >= 0.5 * top_voltage;
    };
    if (stalls(i) && run.time[end - 1] - run.time[i] > stalled &&
        lasts(run.time, i, end, stalled, stalls)) {
      warn(recording.diagnostics, "hit_stop",
           "{}: the mechanism stalls under {:.2f} V after {:.2f} s (a stop or a blockage); what "
           "follows and the {:.0f} ms before are not used",
           name, std::abs(run.voltage[i]), run.time[i] - run.time.front(),
           1e3 * options.stall_margin);
      end = std::max(begin, lower_index(run.time, run.time[i] - options.stall_margin));
      break;
    }
  }

  prepared.first = std::min(begin, end);
  prepared.last = end;
  if (prepared.first < prepared.last) {
    keep_longest_stretch(prepared, std::max(0.15, 8.0 * recording.row_period),
                         recording.diagnostics);
  }
  const double duration = prepared.last > prepared.first + 1
                              ? run.time[prepared.last - 1] - run.time[prepared.first]
                              : 0.0;
  const bool ramp = is_quasistatic(run.kind);
  if (duration < (ramp ? minimum_ramp : minimum_step)) {
    prepared.moved = false;
    prepared.last = prepared.first;
    warn(recording.diagnostics, ramp ? "short_quasistatic_test" : "short_dynamic_test",
         "{}: only {:.2f} s of motion, too short to use", name, duration);
  } else if (!ramp && duration < short_step) {
    warn(recording.diagnostics, "short_dynamic_test",
         "{}: only {:.2f} s of acceleration; kA may not be determined. Give the mechanism more "
         "travel or a lower voltage",
         name, duration);
  }
}

/// Standard deviation of a column's white noise from the second differences of its fresh values:
/// √6 σ where nothing moves, and next to nothing of a motion that lasts many values.
double white_noise(const std::vector<double>& values, const std::vector<std::size_t>& fresh) {
  std::vector<double> bends;
  for (std::size_t i = 2; i < fresh.size(); ++i) {
    bends.push_back(values[fresh[i]] - 2.0 * values[fresh[i - 1]] + values[fresh[i - 2]]);
  }
  return bends.size() < 8 ? 0.0 : mad_scale(bends) / std::sqrt(6.0);
}

// A hundred thousand values of normal noise span nine standard deviations.
constexpr double noise_span = 12.0;
// Noise averaged over the smoothing window, of three values at least, stays below.
constexpr double noise_speed = 2.0;

}  // namespace

void detect_motion(PreparedRecording& prepared) {
  prepared.top_speed = 0.0;
  for (PreparedRun& run : prepared.runs) {
    double signed_square = 0.0;
    double square = 0.0;
    for (const double velocity : run.smoothed_velocity) {
      signed_square += velocity * std::abs(velocity);
      square += velocity * velocity;
    }
    run.direction = signed_square >= 0.0 ? 1.0 : -1.0;
    const double speed = top_of(run.smoothed_velocity, 0.98);
    if (prepared.has_position) {
      const auto [low, high] =
          std::minmax_element(run.run.position.begin(), run.run.position.end());
      const double noise = white_noise(run.run.position, run.fresh_position);
      run.moved = *high - *low > std::max(10.0 * prepared.position_quantum, noise_span * noise) &&
                  speed > 0.0;
    } else {
      // Without a position to show it, motion is a velocity that keeps its sign; noise does not.
      const double noise =
          prepared.has_velocity ? white_noise(run.run.velocity, run.fresh_velocity) : 0.0;
      run.moved = prepared.has_velocity &&
                  speed > std::max(15.0 * prepared.velocity_quantum, noise_speed * noise) &&
                  std::abs(signed_square) > 0.3 * square;
    }
    run.moved = run.moved && !run.run.left_out;
    if (run.moved) {
      prepared.top_speed = std::max(prepared.top_speed, speed);
    }
  }
  // A test that creeps at a hundredth of the others' speed did not move as the voltage asked.
  for (PreparedRun& run : prepared.runs) {
    run.moved = run.moved && top_of(run.smoothed_velocity, 0.98) > 0.01 * prepared.top_speed;
  }
}

void trim_runs(PreparedRecording& prepared, const PreparationOptions& options) {
  for (PreparedRun& run : prepared.runs) {
    if (run.moved) {
      mark_window(run, prepared, options);
      continue;
    }
    if (run.run.left_out) {
      continue;
    }
    double range = 0.0;
    const std::vector<double>& shown = prepared.has_position ? run.run.position : run.run.velocity;
    if (!shown.empty()) {
      const auto [low, high] = std::minmax_element(shown.begin(), shown.end());
      range = *high - *low;
    }
    warn(prepared.diagnostics, "no_motion",
         "{}: no motion under up to {:.2f} V ({} spans {:.3g} {}); the test is not used",
         to_string(run.run.kind), top_of(run.run.voltage, 1.0),
         prepared.has_position ? "position" : "velocity", range,
         prepared.has_position ? prepared.unit : prepared.unit + "/s");
  }
}

}  // namespace flyball::identification
