#include <flyball/classical/response_margins.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/classical/nyquist.hpp>
#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/factors.hpp"
#include "classical/loop_peaks.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Complex = std::complex<double>;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

struct Step {
  double from = 0.0;
  double to = 0.0;
};

/// A loop with what bounds its motion between two frequencies.
class BoundedLoop {
 public:
  BoundedLoop(const FrequencyResponse& loop, Factors factors)
      : loop_(loop), period_(loop.period()), factors_(std::move(factors)) {}

  [[nodiscard]] Complex at(double w) const { return loop_.at(w)(0, 0); }
  /// The same by its factors, many times as fast: what is bounded needs no last digits.
  [[nodiscard]] Complex near(double w) const {
    const double T = period_ ? period_->si() : 1.0;
    const Complex z = period_ ? std::polar(1.0, w * T) : Complex(0.0, w);
    Complex value = std::polar(1.0, -w * factors_.delay) * factors_.gain;
    const Index common = std::min(factors_.zeros.size(), factors_.poles.size());
    for (Index i = 0; i < common; ++i) {
      value *= (z - factors_.zeros(i)) / (z - factors_.poles(i));
    }
    for (Index i = common; i < factors_.zeros.size(); ++i) {
      value *= z - factors_.zeros(i);
    }
    for (Index i = common; i < factors_.poles.size(); ++i) {
      value /= z - factors_.poles(i);
    }
    return value;
  }
  [[nodiscard]] const Factors& factors() const { return factors_; }
  [[nodiscard]] double variation(const Step& step) const {
    return detail::variation(factors_, step.from, step.to, period_);
  }

  /// How far the phase can move on a step: each root of a continuous loop turns it one way; of a
  /// discrete one arg(z - r) has the slope T/2 + T (1 - |r|²)/2|z - r|², of a root on the circle
  /// the first part alone.
  [[nodiscard]] double turn(const Step& step) const {
    if (period_) {
      double sum = factors_.delay * (step.to - step.from);
      const double turned = 0.5 * period_->si() * (step.to - step.from);
      for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
        for (const Complex root : *roots) {
          const double off = off_circle(root);
          sum += turned * (1.0 + (off > 0.0 ? off / squared_distance(root, step) : 0.0));
        }
      }
      return std::min(sum, variation(step));
    }
    double sum = factors_.delay * (step.to - step.from);
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        const double width = std::abs(root.real());
        sum +=
            std::atan2(step.to - root.imag(), width) - std::atan2(step.from - root.imag(), width);
      }
    }
    return sum;
  }

  /// How far ln |L| can move: also by what is left of ω^{-excess} when each root is taken as
  /// 1 - r/jω, which is little at high frequencies.
  [[nodiscard]] double swing(const Step& step) const {
    const double plain = variation(step);
    if (period_) {
      return plain;
    }
    const Index excess = factors_.poles.size() - factors_.zeros.size();
    double sum = static_cast<double>(std::abs(excess)) * std::log(step.to / step.from);
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        const double nearest = std::clamp(root.imag(), step.from, step.to);
        sum += std::abs(root) * (step.to - step.from) /
               (step.from * std::abs(Complex(0.0, nearest) - root));
      }
    }
    return std::min(plain, sum);
  }

  /// The largest second derivative of the phase on a step: 2 |σ|/|jω - r|³ of each root.
  [[nodiscard]] double turn_curvature(const Step& step) const {
    if (period_) {  // T² |1 - |r|²| |r|/|z - r|³ is more than each root's.
      double sum = 0.0;
      const double T = period_->si();
      for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
        for (const Complex root : *roots) {
          if (const double off = off_circle(root); off > 0.0) {
            const double square = squared_distance(root, step);
            sum += T * T * off * std::abs(root) / (square * std::sqrt(square));
          }
        }
      }
      return std::min(sum, curvature(step));
    }
    double sum = 0.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        if (root.real() != 0.0) {
          const double nearest = std::clamp(root.imag(), step.from, step.to);
          const double distance = std::abs(Complex(0.0, nearest) - root);
          sum += 2.0 * std::abs(root.real()) / (distance * distance * distance);
        }
      }
    }
    return sum;
  }

  /// d ln L/dω
  [[nodiscard]] Complex slope(double w) const {
    const double T = period_ ? period_->si() : 1.0;
    const Complex z = period_ ? std::polar(1.0, w * T) : Complex(0.0, w);
    const Complex turn = Complex(0.0, 1.0) * (period_ ? T * z : Complex(1.0));
    Complex sum(0.0, -factors_.delay);
    for (const Complex zero : factors_.zeros) {
      sum += turn / (z - zero);
    }
    for (const Complex pole : factors_.poles) {
      sum -= turn / (z - pole);
    }
    return sum;
  }

  /// The largest |d² ln L/dω²| on a step: 1/|jω - r|², or T²|r|/|z - r|², of each root.
  [[nodiscard]] double curvature(const Step& step) const {
    double sum = 0.0;
    const double T = period_ ? period_->si() : 1.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        if (!period_) {
          const double nearest = std::clamp(root.imag(), step.from, step.to);
          sum += 1.0 / std::norm(Complex(0.0, nearest) - root);
        } else if (root != 0.0) {
          const double angle = std::clamp(std::abs(std::arg(root)), step.from * T, step.to * T);
          sum += T * T * std::abs(root) /
                 std::norm(std::polar(1.0, angle) -
                           std::polar(std::abs(root), std::abs(std::arg(root))));
        }
      }
    }
    return sum;
  }

  /// The slowest and the fastest of the roots and the delay, rad/s.
  [[nodiscard]] Step extremes() const {
    double slowest = infinity;
    double fastest = 0.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const Complex root : *roots) {
        const auto s = detail::in_s(root, period_);
        if (s && *s != 0.0) {
          slowest = std::min(slowest, std::abs(*s));
          fastest = std::max(fastest, std::abs(*s));
        }
      }
    }
    if (factors_.delay > 0.0) {
      slowest = std::min(slowest, 1.0 / factors_.delay);
      fastest = std::max(fastest, 1.0 / factors_.delay);
    }
    if (fastest == 0.0) {
      slowest = fastest = 1.0;
    }
    return {std::min(slowest, loop_.highest_frequency()), fastest};
  }

  /// Up to where phase crossings are told: with dead time a continuous loop has no last one.
  [[nodiscard]] double last_phase() const {
    return factors_.delay > 0.0 && !period_ ? 10.0 * extremes().to : infinity;
  }

  /// From where on, and up to where, |L| and its phase do not cross any more.
  [[nodiscard]] Step range() const {
    const auto [slowest, fastest] = extremes();
    const double end = loop_.highest_frequency();
    Step range{1e-6 * slowest, period_                ? end
                               : factors_.delay > 0.0 ? 10.0 * fastest
                                                      : 1e6 * fastest};
    // Beyond, the asymptotes K ω^{-N} and k ω^{-excess} are within a factor of two.
    const detail::Asymptote low = detail::low_asymptote(factors_, period_);
    if (low.integrators != 0) {
      const double crossing = std::exp(low.log_gain / low.integrators);
      range.from = std::min(range.from, 0.1 * crossing);
    }
    const Index excess = factors_.poles.size() - factors_.zeros.size();
    if (excess != 0 && !period_) {
      const double log_k = std::log(std::abs(factors_.gain));
      range.to = std::max(range.to, 10.0 * std::exp(log_k / static_cast<double>(excess)));
    }
    return {std::max(range.from, 1e-290), std::min({range.to, end, 1e290})};
  }

 private:
  /// |1 - |r|²|, zero on the circle but for rounding.
  [[nodiscard]] static double off_circle(Complex root) {
    const double size = std::abs(root);
    const double off = std::abs((1.0 - size) * (1.0 + size));
    return off <= 4.0 * std::numeric_limits<double>::epsilon() ? 0.0 : off;
  }

  /// The least |z - r|² on a step of a discrete loop.
  [[nodiscard]] double squared_distance(Complex root, const Step& step) const {
    const double T = period_->si();
    const double own = std::abs(std::arg(root));
    const double angle = std::clamp(own, step.from * T, step.to * T);
    return std::norm(std::polar(1.0, angle) - std::polar(std::abs(root), own));
  }

  const FrequencyResponse& loop_;
  std::optional<Time> period_;
  Factors factors_;
};

Step halves(const Step& step, bool first) {
  const double middle =
      step.to > 2.0 * step.from ? std::sqrt(step.from * step.to) : 0.5 * (step.from + step.to);
  return first ? Step{step.from, middle} : Step{middle, step.to};
}

/// Gain or phase of a loop, as what is zero where it crosses, with what bounds its motion.
struct Crossing {
  double (*value)(Complex L);
  double (*part)(Complex slope);
  double (BoundedLoop::*motion)(const Step&) const;
  double (BoundedLoop::*curvature)(const Step&) const;
};

constexpr Crossing gain_crossing{[](Complex L) { return std::log(std::abs(L)); },
                                 [](Complex slope) { return slope.real(); }, &BoundedLoop::swing,
                                 &BoundedLoop::curvature};
constexpr Crossing phase_crossing{[](Complex L) { return std::arg(-L); },
                                  [](Complex slope) { return slope.imag(); }, &BoundedLoop::turn,
                                  &BoundedLoop::turn_curvature};

/// Every zero on the range; nothing where they do not end.
std::optional<std::vector<double>> zeros(const BoundedLoop& loop, const Step& range,
                                         const Crossing& crossing) {
  std::vector<double> found;
  std::vector<Step> pending{range};
  const auto value = [&](double w) { return crossing.value(loop.at(w)); };
  constexpr double closest = 1e-13;
  constexpr int most_steps = 600'000;
  constexpr int most_exact = 60'000;  // each costs as much as hundreds of the factors' values
  int exact = 0;
  for (int count = 0; !pending.empty(); ++count) {
    if (count == most_steps || exact == most_exact) {
      return std::nullopt;
    }
    const Step step = pending.back();
    pending.pop_back();
    const double moved = (loop.*crossing.motion)(step);
    // The factors' value where that is far from deciding.
    double at_start = crossing.value(loop.near(step.from));
    if (std::abs(at_start) > moved + 1e-6) {
      continue;
    }
    ++exact;
    at_start = value(step.from);
    if (std::abs(at_start) > moved) {
      continue;
    }
    const double width = step.to - step.from;
    const double middle = 0.5 * (step.from + step.to);
    // Within a radian neither wraps; where the slope keeps its sign there is one zero or none.
    const bool monotone = moved < 1.0 && std::abs(crossing.part(loop.slope(middle))) >
                                             0.5 * width * (loop.*crossing.curvature)(step);
    if (monotone) {
      const double at_end = value(step.to);
      if ((at_start > 0.0) != (at_end > 0.0)) {
        if (const auto root = find_root(value, step.from, step.to, at_start, at_end)) {
          found.push_back(root->x);
        }
      }
      continue;
    }
    if (width <= closest * step.to) {
      // It touches zero, or jumps at a pole or zero on the axis, which is no crossing.
      if (std::isfinite(moved) && moved < 1.0 && std::abs(at_start) < 1e-9) {
        found.push_back(step.from);
      }
      continue;
    }
    pending.push_back(halves(step, false));
    pending.push_back(halves(step, true));
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end(),
                          [](double a, double b) { return b - a <= 1e-12 * b; }),
              found.end());
  return found;
}

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

std::optional<LogSlope> log_slope(const BoundedLoop& loop, const Step& step, double v,
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

Peak largest(const BoundedLoop& loop, const Step& range, const Eigen::VectorXd& grid,
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
  std::vector<Step> pending;
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
  std::vector<Step> near_the_best;  // where a maximum may be above it by less than that
  constexpr int most = 60'000;
  for (int count = 0; !pending.empty() && count < most; ++count) {
    const Step step = pending.back();
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
  for (const Step& step : pending) {
    const Complex L = loop.near(step.from);
    if (bound_of(measure, L, loop.variation(step)) > doubtful * best.value &&
        bound_by_size(measure, std::abs(L), loop.swing(step)) > doubtful * best.value) {
      constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
      return {unknown, unknown};
    }
  }
  best.value = size(best.frequency);
  std::erase_if(near_the_best, [&](const Step& step) {
    return roughly(step.from) < best.value * (1.0 - 2.0 * tolerance);
  });
  std::sort(near_the_best.begin(), near_the_best.end(),
            [](const Step& a, const Step& b) { return a.from < b.from; });
  constexpr int most_tops = 20;
  int tops = 0;
  for (std::size_t i = 0; i < near_the_best.size() && tops < most_tops; ++tops) {
    Step whole = near_the_best[i++];
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

double wrapped(double degrees) {
  const double turned = std::remainder(degrees, 360.0);
  return turned == -180.0 ? 180.0 : turned;
}

/// Of a loop that is not zero.
detail::LoopPeaks peaks_of(const BoundedLoop& loop, const Step& range, const Eigen::VectorXd& grid,
                           bool discrete) {
  detail::LoopPeaks peaks{largest(loop, range, grid, Measure::sensitivity),
                          largest(loop, range, grid, Measure::complementary),
                          largest(loop, range, grid, Measure::spread)};
  const Index excess = loop.factors().poles.size() - loop.factors().zeros.size();
  const double direct = excess == 0 ? loop.factors().gain : 0.0;
  if (discrete || (loop.factors().delay > 0.0 && direct != 0.0)) {
    return peaks;
  }
  // At infinity, where it is only approached.
  const double last = 1.0 / std::abs(1.0 + direct);
  const auto consider = [](double value, Peak& peak) {
    if (value > peak.value * (1.0 - 1e-12)) {
      peak = {value, infinity};
    }
  };
  consider(last, peaks.sensitivity);
  if (direct != 0.0) {
    consider(std::abs(direct) * last, peaks.complementary);
  }
  consider(std::abs(1.0 - direct) * last, peaks.spread);
  return peaks;
}

}  // namespace

Expected<detail::LoopPeaks> detail::loop_peaks(const FrequencyResponse& response) {
  auto factors = response.factors();
  if (factors->gain == 0.0) {
    return LoopPeaks{{1.0, 0.0}, {0.0, 0.0}, {1.0, 0.0}};
  }
  FLYBALL_TRY(const FrequencyGrid grid, frequency_grid(response));
  const BoundedLoop loop(response, *std::move(factors));
  return peaks_of(loop, loop.range(), grid.frequency, response.period().has_value());
}

Expected<LoopMargins> loop_margins(const FrequencyResponse& response) {
  return detail::whole_margins(response).map(
      [](detail::WholeMargins&& whole) { return std::move(whole.margins); });
}

Expected<detail::WholeMargins> detail::whole_margins(const FrequencyResponse& response) {
  constexpr std::string_view where = "margins";
  FLYBALL_TRY(const NyquistData curve, nyquist(response).map_error([&](Error&& error) {
    return std::move(error).in(std::string(where));
  }));
  auto factors = response.factors();
  LoopMargins margins;
  margins.unstable_poles =
      curve.closed_loop_unstable.value_or(std::max(1, curve.open_loop_unstable));
  margins.stable = curve.closed_loop_unstable == 0;
  if (factors->gain == 0.0) {
    margins.sensitivity = {1.0, 0.0};
    margins.delay_margin = margins.stable ? infinity : 0.0;
    margins.disk_margin = margins.stable ? 2.0 : 0.0;
    return WholeMargins{std::move(margins), {1.0, 0.0}};
  }
  const BoundedLoop loop(response, *std::move(factors));
  const Step range = loop.range();
  double further = infinity;
  const auto unit_gain = zeros(loop, range, gain_crossing);
  auto places = zeros(loop, {range.from, std::min(range.to, loop.last_phase())}, phase_crossing);
  if (!unit_gain || !places) {
    return refusal(SystemError::no_convergence, where,
                   !unit_gain ? "gain crossings" : "phase crossings")
        .got("without end: the loop stays where it crosses");
  }
  for (const double w : *unit_gain) {
    const double margin = wrapped(180.0 + std::arg(loop.at(w)) * 180.0 / pi);
    margins.gain_crossings.push_back({w, margin});
    further = std::min(further, (margin > 0.0 ? margin : margin + 360.0) * pi / 180.0 / w);
  }
  // With an L(∞) of one or more the shortest delay has infinitely many poles on the right.
  const bool ends = !response.period() && loop.factors().delay == 0.0;
  const double direct =
      loop.factors().zeros.size() == loop.factors().poles.size() ? loop.factors().gain : 0.0;
  margins.delay_margin = margins.stable && !(ends && std::abs(direct) >= 1.0) ? further : 0.0;
  constexpr double integrator = 1e12;
  if (const double rest = response.at(0.0)(0, 0).real(); rest < 0.0 && rest > -integrator) {
    margins.phase_crossings.push_back({0.0, -1.0 / rest});
  }
  const double end = response.highest_frequency();
  if (response.period() && margins.stable && std::abs(loop.at(end)) >= 1.0) {
    // The sign of 1 + L at z = -1 is L's, which one more period turns round.
    margins.delay_margin = std::min(further, response.period()->si());
  }
  if (std::isfinite(end)) {
    std::erase_if(*places, [&](double w) { return w > end * (1.0 - 1e-9); });
    const Complex last = loop.at(end);
    if (last.real() < 0.0 && std::isfinite(last.real())) {
      places->push_back(end);
    }
  }
  for (const double w : *places) {
    const double gain = std::abs(loop.at(w));
    if (gain > 0.0 && std::isfinite(gain)) {
      margins.phase_crossings.push_back({w, 1.0 / gain});
    }
  }
  if (ends && direct < 0.0 && loop.factors().poles.size() > 0) {
    margins.phase_crossings.push_back({infinity, -1.0 / direct});
  }
  const auto off = [](double gain) { return std::abs(std::log(gain)); };
  for (const PhaseCrossing& crossing : margins.phase_crossings) {
    if (!margins.gain_margin || off(crossing.gain_margin) < off(*margins.gain_margin)) {
      margins.gain_margin = crossing.gain_margin;
    }
  }
  for (const GainCrossing& crossing : margins.gain_crossings) {
    if (!margins.phase_margin ||
        std::abs(crossing.phase_margin) < std::abs(*margins.phase_margin)) {
      margins.phase_margin = crossing.phase_margin;
    }
  }
  const auto peaks = peaks_of(loop, range, curve.frequency, response.period().has_value());
  margins.sensitivity = peaks.sensitivity;
  margins.complementary = peaks.complementary;
  margins.disk_margin = margins.stable ? 2.0 / peaks.spread.value : 0.0;
  return WholeMargins{std::move(margins), peaks.spread};
}

Expected<SampleDelayReport> sample_delay_report(const TransferFunction& loop, Time period) {
  constexpr std::string_view where = "sample delay";
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  if (loop.period()) {
    return refusal(TransferError::period_mismatch, where, "the loop")
        .got(flyball::detail::format("sampled at {} s", loop.period()->si()))
        .expected("continuous: a sampled one has its delay in it");
  }
  SampleDelayReport report;
  FLYBALL_TRY(report.without, loop_margins(loop));
  FLYBALL_TRY(const auto later, TransferFunction::create(loop.num(), loop.den(), std::nullopt,
                                                         Time(loop.delay() + 0.5 * period.si())));
  FLYBALL_TRY(report.with, loop_margins(later));
  if (!report.without.gain_crossings.empty()) {
    report.crossover = report.without.gain_crossings.back().frequency;
    report.phase_loss = 0.5 * *report.crossover * period.si() * 180.0 / pi;
  }
  return report;
}

}  // namespace flyball::classical
