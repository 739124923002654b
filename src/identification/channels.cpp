#include <algorithm>
#include <cmath>
#include <string>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "identification/channels.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

std::vector<double> smooth_velocity(const PreparedRun& prepared, bool has_position) {
  const TestRun& run = prepared.run;
  std::vector<double> smoothed(run.time.size(), 0.0);
  if (!has_position) {
    for (std::size_t i = 0; i < run.time.size(); ++i) {
      const std::size_t low = lower_index(run.time, run.time[i] - smoothing_half_width);
      const std::size_t high = lower_index(run.time, run.time[i] + smoothing_half_width);
      double sum = 0.0;
      for (std::size_t j = low; j < high; ++j) {
        sum += run.velocity[j];
      }
      smoothed[i] = sum / static_cast<double>(std::max<std::size_t>(1, high - low));
    }
    return smoothed;
  }
  std::vector<double> time;
  std::vector<double> position;
  for (const std::size_t row : prepared.fresh_position) {
    time.push_back(run.time[row]);
    position.push_back(run.position[row]);
  }
  if (time.size() < 2) {
    return smoothed;
  }
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    const double low = std::max(run.time[i] - smoothing_half_width, time.front());
    const double high = std::min(run.time[i] + smoothing_half_width, time.back());
    if (high - low > 0.5 * smoothing_half_width) {
      smoothed[i] =
          (interpolate(time, position, high) - interpolate(time, position, low)) / (high - low);
    }
  }
  return smoothed;
}

struct SignCount {
  std::size_t agree = 0;
  std::size_t differ = 0;
  double lowest_voltage = 0.0;
  double highest_voltage = 0.0;
};

/// Only rows with much voltage and much motion count: gravity may drive against little voltage.
SignCount count_signs(const PreparedRun& prepared) {
  SignCount count;
  double top_voltage = 0.0;
  double top_speed = 0.0;
  for (std::size_t i = 0; i < prepared.run.time.size(); ++i) {
    top_voltage = std::max(top_voltage, std::abs(prepared.run.voltage[i]));
    top_speed = std::max(top_speed, std::abs(prepared.smoothed_velocity[i]));
    count.lowest_voltage = std::min(count.lowest_voltage, prepared.run.voltage[i]);
    count.highest_voltage = std::max(count.highest_voltage, prepared.run.voltage[i]);
  }
  for (std::size_t i = 0; i < prepared.run.time.size(); ++i) {
    const double voltage = prepared.run.voltage[i];
    const double velocity = prepared.smoothed_velocity[i];
    if (std::abs(voltage) > 0.5 * top_voltage && std::abs(velocity) > 0.3 * top_speed) {
      (voltage * velocity > 0.0 ? count.agree : count.differ) += 1;
    }
  }
  return count;
}

void negate(std::vector<double>& values) {
  for (double& value : values) {
    value = -value;
  }
}

/// Median of velocity column over smoothed derivative of position at fresh rows with much motion.
double velocity_ratio(const PreparedRecording& prepared, bool ramps_only) {
  std::vector<double> ratios;
  for (const PreparedRun& run : prepared.runs) {
    if (!run.moved || (ramps_only && !is_quasistatic(run.run.kind))) {
      continue;
    }
    for (const std::size_t row : run.fresh_velocity) {
      if (std::abs(run.smoothed_velocity[row]) > 0.2 * prepared.top_speed) {
        ratios.push_back(run.run.velocity[row] / run.smoothed_velocity[row]);
      }
    }
  }
  return ratios.size() < 20 ? 0.0 : median(std::move(ratios));
}

}  // namespace

double column_quantum(const std::vector<PreparedRun>& runs, std::vector<double> TestRun::* column) {
  std::vector<double> steps;
  for (const PreparedRun& run : runs) {
    const std::vector<double>& values = run.run.*column;
    for (std::size_t i = 1; i < values.size(); ++i) {
      if (values[i] != values[i - 1]) {
        steps.push_back(std::abs(values[i] - values[i - 1]));
      }
    }
  }
  return quantile(std::move(steps), 0.01);
}

double refresh_period(const std::vector<PreparedRun>& runs, std::vector<double> TestRun::* column) {
  std::vector<std::pair<double, double>> changes;  // size, time since the change before
  std::vector<double> sizes;
  for (const PreparedRun& run : runs) {
    const std::vector<double>& values = run.run.*column;
    std::size_t last = 0;
    for (std::size_t i = 1; i < values.size(); ++i) {
      if (values[i] != values[i - 1]) {
        if (last > 0) {
          changes.emplace_back(std::abs(values[i] - values[i - 1]),
                               run.run.time[i] - run.run.time[last]);
          sizes.push_back(changes.back().first);
        }
        last = i;
      }
    }
  }
  const double typical = median(std::move(sizes));
  std::vector<double> gaps;
  for (const auto& [size, gap] : changes) {
    if (size >= typical) {
      gaps.push_back(gap);
    }
  }
  return median(std::move(gaps));
}

std::vector<std::size_t> fresh_rows(std::span<const double> time, std::span<const double> values,
                                    double period) {
  std::vector<std::size_t> rows;
  if (values.size() > 1) {
    rows.push_back(1);
  }
  for (std::size_t i = 2; i < values.size(); ++i) {
    if (values[i] == values[i - 1]) {
      continue;
    }
    // Refreshes to the same value before: where they were due, counted back from this one.
    const std::size_t before = rows.size();
    std::size_t later = i;
    for (std::size_t k = i; k-- > rows[before - 1] + 1;) {
      const double due = time[later] - period;
      if (time[k] > due) {
        continue;
      }
      const std::size_t row = k + 1 < later && time[k + 1] - due < due - time[k] ? k + 1 : k;
      if (time[row] - time[rows[before - 1]] <= 0.5 * period) {
        break;
      }
      rows.push_back(row);
      later = row;
    }
    std::reverse(rows.begin() + static_cast<std::ptrdiff_t>(before), rows.end());
    rows.push_back(i);
  }
  // And after the last change.
  for (std::size_t i = rows.empty() ? 0 : rows.back() + 1; i < values.size(); ++i) {
    const double due = time[rows.back()] + period;
    if (time[i] >= due) {
      const bool nearer = i - 1 > rows.back() && due - time[i - 1] < time[i] - due;
      rows.push_back(nearer ? i - 1 : i);
      i = rows.back();
    }
  }
  return rows;
}

double repeated_share(const std::vector<PreparedRun>& runs) {
  std::size_t repeated = 0;
  std::size_t total = 0;
  for (const PreparedRun& prepared : runs) {
    const TestRun& run = prepared.run;
    // Rows at rest repeat by nature: only the usable window counts.
    for (std::size_t i = std::max<std::size_t>(1, prepared.first); i < prepared.last; ++i) {
      const bool same_position = run.position.empty() || run.position[i] == run.position[i - 1];
      const bool same_velocity = run.velocity.empty() || run.velocity[i] == run.velocity[i - 1];
      repeated += same_position && same_velocity ? 1U : 0U;
      ++total;
    }
  }
  return total == 0 ? 0.0 : static_cast<double>(repeated) / static_cast<double>(total);
}

namespace {

/// Whether the velocity is refreshed with the position although each row differs by noise: what it
/// changes by while speeding up, it changes by at the position's new values.
bool is_held_with_position(const PreparedRecording& prepared) {
  if (!prepared.has_position || !prepared.has_velocity ||
      prepared.position_refresh_period < 1.5 * prepared.row_period ||
      prepared.velocity_refresh_period > 0.75 * prepared.position_refresh_period) {
    return false;
  }
  double at_refresh = 0.0;
  double between = 0.0;
  double total = 0.0;
  std::size_t refreshes = 0;
  for (const PreparedRun& prepared_run : prepared.runs) {
    const std::vector<double>& v = prepared_run.run.velocity;
    const std::vector<std::size_t>& fresh = prepared_run.fresh_position;
    for (std::size_t k = 1; k < fresh.size(); ++k) {
      const std::size_t a = fresh[k - 1];
      const std::size_t b = fresh[k];
      const double change = prepared_run.smoothed_velocity[b] - prepared_run.smoothed_velocity[a];
      if (b - a < 2 || std::abs(change) < 0.02 * prepared.top_speed) {
        continue;
      }
      at_refresh += (v[b] - v[b - 1]) * change;
      between += (v[b - 1] - v[a]) * change;
      total += change * change;
      ++refreshes;
    }
  }
  constexpr std::size_t enough = 6;
  return refreshes >= enough && at_refresh > 0.6 * total && between < 0.2 * total;
}

}  // namespace

void refresh_derived_columns(PreparedRecording& prepared) {
  for (PreparedRun& run : prepared.runs) {
    run.fresh_position.clear();
    run.fresh_velocity.clear();
    if (prepared.has_position) {
      run.fresh_position =
          fresh_rows(run.run.time, run.run.position, prepared.position_refresh_period);
    }
    if (prepared.has_velocity) {
      run.fresh_velocity =
          fresh_rows(run.run.time, run.run.velocity, prepared.velocity_refresh_period);
    }
    run.smoothed_velocity = smooth_velocity(run, prepared.has_position);
  }
  if (is_held_with_position(prepared)) {
    for (PreparedRun& run : prepared.runs) {
      run.fresh_velocity = run.fresh_position;
    }
    prepared.velocity_refresh_period = prepared.position_refresh_period;
  }
}

void mend_signs(PreparedRecording& prepared) {
  if (prepared.has_position && prepared.has_velocity) {
    if (const double ratio = velocity_ratio(prepared, false); ratio < -0.3) {
      // The smoothed velocity stems from the position: if it agrees with the voltage, position is
      // right.
      std::size_t agree = 0;
      std::size_t differ = 0;
      for (const PreparedRun& run : prepared.runs) {
        const SignCount count = run.moved ? count_signs(run) : SignCount{};
        agree += count.agree;
        differ += count.differ;
      }
      const bool position_right = agree >= differ;
      for (PreparedRun& run : prepared.runs) {
        negate(position_right ? run.run.velocity : run.run.position);
      }
      warn(prepared.diagnostics, "sign_mismatch",
           "position and velocity have opposite signs (velocity is {:.2f} times the derivative of "
           "position); the {} disagrees with the voltage and was negated",
           ratio, position_right ? "velocity" : "position");
      refresh_derived_columns(prepared);
    }
  }

  std::vector<std::size_t> mismatched;
  std::size_t moved = 0;
  std::size_t rows = 0;
  bool unsigned_voltage = true;
  for (std::size_t i = 0; i < prepared.runs.size(); ++i) {
    if (!prepared.runs[i].moved) {
      continue;
    }
    ++moved;
    const SignCount count = count_signs(prepared.runs[i]);
    unsigned_voltage =
        unsigned_voltage && count.lowest_voltage > -0.05 * std::max(0.1, count.highest_voltage);
    if (count.differ > count.agree) {
      mismatched.push_back(i);
      rows += count.differ;
    }
  }
  if (mismatched.empty()) {
    return;
  }
  if (unsigned_voltage && mismatched.size() < moved) {
    for (const std::size_t i : mismatched) {
      negate(prepared.runs[i].run.voltage);
    }
    warn(prepared.diagnostics, "sign_mismatch",
         "the voltage column carries no sign: it is positive in all {} tests, but the mechanism "
         "moves backwards in {} of them ({} rows); the voltage was negated there",
         moved, mismatched.size(), rows);
    return;
  }
  if (mismatched.size() == moved) {
    for (PreparedRun& run : prepared.runs) {
      negate(run.run.position);
      negate(run.run.velocity);
      run.direction = -run.direction;
    }
    warn(
        prepared.diagnostics, "sign_mismatch",
        "inverted encoder: positive voltage moves the encoder backwards in all {} tests that moved "
        "({} rows); position and velocity were negated, so gravity and zero refer to the negated "
        "position. Invert the encoder or the motor in the robot's code before using the gains",
        moved, rows);
    refresh_derived_columns(prepared);
    return;
  }
  std::string names;
  for (const std::size_t i : mismatched) {
    negate(prepared.runs[i].run.voltage);
    names += (names.empty() ? "" : ", ") + std::string(to_string(prepared.runs[i].run.kind));
  }
  warn(prepared.diagnostics, "sign_mismatch",
       "voltage and motion have opposite signs in {} of {} tests ({}; {} rows), as if the encoder "
       "or the motor had been inverted between tests; the voltage was given the sign of the motion "
       "there, as the reference analyser does. Record these tests again",
       mismatched.size(), moved, names, rows);
}

void drop_coarse_velocity(PreparedRecording& prepared) {
  constexpr double coarse = 0.05;  // of top speed
  constexpr double span = 0.07;    // s, of the position differences that replace it
  if (!prepared.has_position || !prepared.has_velocity ||
      prepared.velocity_quantum < coarse * prepared.top_speed ||
      prepared.velocity_quantum < 2.0 * prepared.position_quantum / span) {
    return;
  }
  prepared.has_velocity = false;
  warn(prepared.diagnostics, "coarse_velocity",
       "the velocity column has steps of {:.3g} {}/s at a top speed of {:.3g}; only the position "
       "is used",
       prepared.velocity_quantum, prepared.unit, prepared.top_speed);
}

void check_velocity_scale(PreparedRecording& prepared) {
  if (!prepared.has_position || !prepared.has_velocity) {
    return;
  }
  double ratio = velocity_ratio(prepared, true);
  if (ratio == 0.0) {
    ratio = velocity_ratio(prepared, false);
  }
  if (ratio <= 0.0) {
    return;
  }
  prepared.velocity_scale = ratio;
  if (std::abs(ratio - 1.0) > 0.03) {
    prepared.diagnostics.push_back(
        {"velocity_disagrees_with_position",
         std::abs(ratio - 1.0) > 0.15 ? Severity::warning : Severity::info,
         detail::format(
             "the velocity column is {:.3g} times the derivative of the position column; "
             "the position is believed and the velocity's scale is fitted with the gains",
             ratio)});
  }
}

}  // namespace flyball::identification
