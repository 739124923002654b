#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "recording/recorded_motion.hpp"

namespace flyball::recording {

using identification::TestRun;

namespace {

/// Whether velocities go in steps so coarse that their mean is not the velocity's (truncation).
bool are_coarse(const std::vector<TestRun>& runs) {
  constexpr double coarse = 0.06;  // of the fastest
  double step = std::numeric_limits<double>::infinity();
  double fastest = 0.0;
  for (const TestRun& run : runs) {
    for (std::size_t i = 0; i < run.velocity.size(); ++i) {
      fastest = std::max(fastest, std::abs(run.velocity[i]));
      const double change = i > 0 ? std::abs(run.velocity[i] - run.velocity[i - 1]) : 0.0;
      step = change > 0.0 ? std::min(step, change) : step;
    }
  }
  return step > coarse * fastest;
}

/// The turn that positions keep within, in their own unit; 0 if it is none.
double turn_of(const std::vector<double>& positions) {
  if (positions.empty()) {
    return 0.0;
  }
  const auto [low, high] = std::minmax_element(positions.begin(), positions.end());
  const double range = *high - *low;
  for (const double turn : {1.0, 2.0 * std::numbers::pi, 360.0}) {
    if (range > 0.9 * turn && range < 1.01 * turn) {
      return turn;
    }
  }
  return 0.0;
}

}  // namespace

std::optional<double> velocity_ratio(const std::vector<TestRun>& runs) {
  if (are_coarse(runs)) {
    return std::nullopt;
  }
  constexpr double window = 0.2;       // s
  constexpr double furthest = 0.12;    // s
  constexpr double shift_step = 0.01;  // s
  constexpr double least_correlation = 0.9;
  double best_correlation = least_correlation;
  std::optional<double> ratio;
  for (double shift = -furthest; shift < furthest + 0.5 * shift_step; shift += shift_step) {
    double vv = 0.0;
    double pv = 0.0;
    double pp = 0.0;
    for (const TestRun& run : runs) {
      const std::size_t n = run.time.size();
      if (run.position.size() != n || run.velocity.size() != n || n < 3) {
        continue;
      }
      std::vector<double> integral(n, 0.0);
      for (std::size_t i = 1; i < n; ++i) {
        integral[i] = integral[i - 1] + 0.5 * (run.velocity[i] + run.velocity[i - 1]) *
                                            (run.time[i] - run.time[i - 1]);
      }
      const auto integral_at = [&](double t) {
        const auto next = std::upper_bound(run.time.begin(), run.time.end(), t);
        const auto i = static_cast<std::size_t>(next - run.time.begin());
        if (i == 0 || i == n) {
          return i == 0 ? integral.front() : integral.back();
        }
        const double step = run.time[i] - run.time[i - 1];
        const double share = step > 0.0 ? (t - run.time[i - 1]) / step : 0.0;
        return integral[i - 1] + share * (integral[i] - integral[i - 1]);
      };
      std::size_t from = 0;
      for (std::size_t to = 1; to < n; ++to) {
        if (run.time[to] - run.time[from] < window) {
          continue;
        }
        const double begin = run.time[from] + shift;
        const double end = run.time[to] + shift;
        if (begin >= run.time.front() && end <= run.time.back()) {
          const double moved = run.position[to] - run.position[from];
          const double integrated = integral_at(end) - integral_at(begin);
          vv += integrated * integrated;
          pv += moved * integrated;
          pp += moved * moved;
        }
        from = to;
      }
    }
    const double correlation = vv > 0.0 && pp > 0.0 ? pv / std::sqrt(vv) / std::sqrt(pp) : 0.0;
    // Signs that disagree are another matter: preparation tells of them.
    if (std::abs(correlation) > best_correlation) {
      best_correlation = std::abs(correlation);
      ratio = std::sqrt(vv / pp);
    }
  }
  return ratio;
}

std::size_t unwrap_turns(std::vector<double>& positions) {
  const double turn = turn_of(positions);
  if (turn == 0.0) {
    return 0;
  }
  // The motion before and after a row, over rows that repeat a value.
  const std::size_t n = positions.size();
  std::vector<double> before(n, 0.0);
  std::vector<double> after(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) {
    const double moved = positions[i] - positions[i - 1];
    before[i] = moved != 0.0 ? moved : before[i - 1];
  }
  for (std::size_t i = n - 1; i > 0; --i) {
    const double moved = positions[i] - positions[i - 1];
    after[i - 1] = moved != 0.0 ? moved : after[i];
  }
  std::size_t leaps = 0;
  double turned = 0.0;
  double last = positions.front();
  for (std::size_t i = 1; i < n; ++i) {
    const double leap = positions[i] - last;
    const auto against = [&](double motion) {
      return motion * leap < 0.0 && std::abs(motion) < 0.5 * turn;
    };
    if (std::abs(leap) > 0.6 * turn && against(before[i - 1]) && against(after[i])) {
      turned -= std::copysign(turn, leap);
      ++leaps;
    }
    last = positions[i];
    positions[i] += turned;
  }
  return leaps;
}

double speed_at_full_voltage(const std::vector<TestRun>& runs, std::optional<double> ratio) {
  constexpr double window = 0.2;  // s
  constexpr double nominal = 12.0;
  double fastest = 0.0;
  for (const TestRun& run : runs) {
    const std::size_t n = run.time.size();
    std::size_t from = 0;
    for (std::size_t to = 1; to < n; ++to) {
      const double span = run.time[to] - run.time[from];
      if (span < window) {
        continue;
      }
      double speed = 0.0;
      if (run.position.size() == n) {
        speed = std::abs(run.position[to] - run.position[from]) / span;
      } else if (run.velocity.size() == n) {
        speed = 0.5 * std::abs(run.velocity[to] + run.velocity[from]) / ratio.value_or(1.0);
      }
      const double volts = std::max(std::abs(run.voltage[to]), std::abs(run.voltage[from]));
      if (volts > 0.5) {
        fastest = std::max(fastest, speed * nominal / volts);
      }
      from = to;
    }
  }
  return fastest;
}

}  // namespace flyball::recording
