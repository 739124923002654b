#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/math/search/minimum.hpp>

#include "classical/bounded_loop.hpp"
#include "classical/delay_characteristic.hpp"
#include "classical/loop_peaks.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using detail::BoundedLoop;
using detail::halves;
using detail::LoopStep;
using Eigen::Index;
using Complex = std::complex<double>;

namespace {

/// What a loop is looked at for: its largest over the frequencies.
enum class Measure { sensitivity, complementary, spread };

/// |1/(1 + L)|, |L/(1 + L)| or |(1 - L)/(1 + L)|.
double size_of(Measure measure, Complex L) {
  const double top = measure == Measure::sensitivity     ? 1.0
                     : measure == Measure::complementary ? std::abs(L)
                                                         : std::abs(1.0 - L);
  return top / std::abs(1.0 + L);
}

/// The largest that it can be where ln L has moved by no more than v.
double bound_of(Measure measure, Complex L, double v) {
  const double moved = std::expm1(v);
  double bound = infinity;
  // As a function of L, and of M = 1/L, which is small where L is large.
  const Complex M = 1.0 / L;
  const double way_of_L = std::abs(L) * moved;
  const double way_of_M = std::abs(M) * moved;
  if (const double left = std::abs(1.0 + L) - way_of_L; left > 0.0) {
    const double top = measure == Measure::sensitivity     ? 1.0
                       : measure == Measure::complementary ? std::abs(L) + way_of_L
                                                           : std::abs(1.0 - L) + way_of_L;
    bound = std::min(bound, top / left);
  }
  if (const double left = std::abs(1.0 + M) - way_of_M; left > 0.0) {
    const double top = measure == Measure::sensitivity     ? std::abs(M) + way_of_M
                       : measure == Measure::complementary ? 1.0
                                                           : std::abs(1.0 - M) + way_of_M;
    bound = std::min(bound, top / left);
  }
  return bound;
}

/// At most on a step on which ln |L| moves by `swing`, whatever the phase does.
double bound_by_size(Measure measure, double size, double swing) {
  const double most = size * std::exp(swing);
  const double least = size * std::exp(-swing);
  const auto top = [&](double L) {
    return measure == Measure::sensitivity ? 1.0 : measure == Measure::complementary ? L : 1.0 + L;
  };
  return most < 1.0    ? top(most) / (1.0 - most)
         : least > 1.0 ? top(least) / (least - 1.0)
                       : infinity;
}

/// The slope of the logarithm where a step begins, -Re L'/(1 + L), Re (L'/L)/(1 + L) or
/// -Re 2L'/(1 - L²), and how far it can be from that on the step.
struct LogSlope {
  double value;
  double change;

  /// Whether it only rises or only falls, so that no more is there than at the ends.
  [[nodiscard]] bool is_monotone() const { return std::abs(value) > change; }
};

std::optional<LogSlope> log_slope(const BoundedLoop& loop, const LoopStep& step, double v,
                                  Measure measure) {
  const double h = step.to - step.from;
  const Complex L = loop.near(step.from);
  const Complex by_log = loop.slope(step.from);
  const double curvature = loop.curvature(step);
  const double steepest = std::abs(by_log) + curvature * h;
  const double size = std::abs(L) * std::exp(v);
  const double first = size * steepest;
  const double second = size * (steepest * steepest + curvature);
  const double way = std::abs(L) * std::expm1(v);
  const double least = std::abs(1.0 + L) - way;
  const double other = std::abs(1.0 - L) - way;
  if (!(least > 0.0) || (measure == Measure::spread && !(other > 0.0))) {
    return std::nullopt;
  }
  switch (measure) {
    case Measure::sensitivity:
      return LogSlope{-(by_log * L / (1.0 + L)).real(),
                      h * (second / least + (first / least) * (first / least))};
    case Measure::complementary:
      return LogSlope{(by_log / (1.0 + L)).real(),
                      h * (curvature / least + steepest * first / (least * least))};
    case Measure::spread:
      break;
  }
  const double both = least * other;
  return LogSlope{-(2.0 * by_log * L / (1.0 - L * L)).real(),
                  2.0 * h * (second / both + 2.0 * size * (first / both) * (first / both))};
}

Peak largest(const BoundedLoop& loop, const LoopStep& range, const Eigen::VectorXd& grid,
             Measure measure) {
  Peak best;
  const auto size = [&](double w) {
    const double value = size_of(measure, loop.at(w));
    return std::isnan(value) ? 0.0 : value;
  };
  const auto roughly = [&](double w) {
    const double value = size_of(measure, loop.near(w));
    return std::isnan(value) ? 0.0 : value;
  };
  const auto consider = [&](double value, double w) {
    if (value > best.value) {
      best = {value, w};
    }
  };
  std::vector<LoopStep> pending;
  double last = range.from;
  for (const double w : grid) {
    consider(roughly(w), w);
    if (w > last && w < range.to) {
      pending.push_back({last, w});
      last = w;
    }
  }
  pending.push_back({last, range.to});
  // The low ones first: where the work ends before the steps do, what was not looked at is high up.
  std::reverse(pending.begin(), pending.end());
  constexpr double tolerance = 1e-5;
  std::vector<LoopStep> near_the_best;  // where a maximum may be above it by less than that
  constexpr int most = 30'000;
  for (int count = 0; !pending.empty() && count < most; ++count) {
    const LoopStep step = pending.back();
    pending.pop_back();
    const Complex L = loop.near(step.from);
    const double here = roughly(step.from);
    consider(here, step.from);
    consider(roughly(step.to), step.to);
    const double width = step.to - step.from;
    const double v = loop.variation(step);
    double bound =
        std::min(bound_of(measure, L, v), bound_by_size(measure, std::abs(L), loop.swing(step)));
    if (!(bound > best.value) || width <= 1e-13 * step.to) {
      continue;
    }
    if (const auto slope = v < 1.0 ? log_slope(loop, step, v, measure) : std::nullopt) {
      if (slope->is_monotone()) {
        continue;
      }
      bound = std::min(bound, here * std::exp(width * (slope->value + slope->change)));
    }
    if (bound > best.value * (1.0 + tolerance)) {
      pending.push_back(halves(step, true));
      pending.push_back(halves(step, false));
    } else if (bound > best.value) {
      near_the_best.push_back(step);
    }
  }
  // What is left once the work is done may be larger: then nothing is told.
  constexpr double doubtful = 1.01;
  for (const LoopStep& step : pending) {
    const Complex L = loop.near(step.from);
    if (bound_of(measure, L, loop.variation(step)) > doubtful * best.value &&
        bound_by_size(measure, std::abs(L), loop.swing(step)) > doubtful * best.value) {
      constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
      return {unknown, unknown};
    }
  }
  best.value = size(best.frequency);
  std::erase_if(near_the_best, [&](const LoopStep& step) {
    return roughly(step.from) < best.value * (1.0 - 2.0 * tolerance);
  });
  std::sort(near_the_best.begin(), near_the_best.end(),
            [](const LoopStep& a, const LoopStep& b) { return a.from < b.from; });
  constexpr int most_tops = 20;
  int tops = 0;
  for (std::size_t i = 0; i < near_the_best.size() && tops < most_tops; ++tops) {
    LoopStep whole = near_the_best[i++];
    while (i < near_the_best.size() && near_the_best[i].from <= whole.to * (1.0 + 1e-12)) {
      whole.to = near_the_best[i++].to;
    }
    const auto top =
        find_minimum([&](double w) { return -size(w); }, whole.from, std::min(whole.to, range.to));
    if (top) {
      consider(-top->value, top->x);
    }
  }
  for (const double width : {1e-2, 1e-4}) {
    if (!std::isfinite(best.value) || !(best.frequency > 0.0)) {
      break;
    }
    const auto top = find_minimum([&](double w) { return -size(w); },
                                  std::max(range.from, best.frequency * (1.0 - width)),
                                  std::min(range.to, best.frequency * (1.0 + width)));
    if (top) {
      consider(-top->value, top->x);
    }
  }
  // A maximum at the end is flat there.
  if (const double at_end = size(range.to); at_end >= best.value * (1.0 - 1e-13)) {
    best = {std::max(at_end, best.value), range.to};
  }
  return best;
}

}  // namespace

detail::LoopPeaks detail::peaks_of(const BoundedLoop& loop, const LoopStep& range,
                                   const Eigen::VectorXd& grid, bool discrete) {
  detail::LoopPeaks peaks{largest(loop, range, grid, Measure::sensitivity),
                          largest(loop, range, grid, Measure::complementary),
                          largest(loop, range, grid, Measure::spread)};
  const Index excess = loop.factors().poles.size() - loop.factors().zeros.size();
  const double direct = excess == 0 ? loop.factors().gain : 0.0;
  if (discrete) {
    return peaks;
  }
  const auto consider = [](double value, Peak& peak, double share) {
    if (value > peak.value * share) {
      peak = {value, infinity};
    }
  };
  // At infinity, where it is only approached; behind dead time with every phase.
  if (loop.factors().delay > 0.0 && direct != 0.0) {
    const double size = std::abs(direct);
    const double nearest = size < detail::endless_from || size > 2.0 - detail::endless_from
                               ? std::abs(1.0 - size)
                               : 0.0;
    const double more = 1.0 + 1e-9;
    consider(1.0 / nearest, peaks.sensitivity, more);
    consider(size / nearest, peaks.complementary, more);
    consider((1.0 + size) / nearest, peaks.spread, more);
    return peaks;
  }
  const double last = 1.0 / std::abs(1.0 + direct);
  const double as_much = 1.0 - 1e-12;
  consider(last, peaks.sensitivity, as_much);
  if (direct != 0.0) {
    consider(std::abs(direct) * last, peaks.complementary, as_much);
  }
  consider(std::abs(1.0 - direct) * last, peaks.spread, as_much);
  return peaks;
}

void detail::approach(double factor, LoopMargins& margins) {
  const auto off = [](double gain) { return std::abs(std::log(gain)); };
  if (!margins.gain_margin || off(factor) < off(*margins.gain_margin)) {
    margins.gain_margin = factor;
  }
}

Expected<detail::LoopPeaks> detail::loop_peaks(const FrequencyResponse& response) {
  auto factors = response.factors();
  if (factors->gain == 0.0) {
    return LoopPeaks{{1.0, 0.0}, {0.0, 0.0}, {1.0, 0.0}};
  }
  FLYBALL_TRY(const FrequencyGrid grid, frequency_grid(response));
  const BoundedLoop loop(response, *std::move(factors));
  return peaks_of(loop, loop.range(), grid.frequency, response.period().has_value());
}

}  // namespace flyball::classical
