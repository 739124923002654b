#include <flyball/classical/response_margins.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/classical/nyquist.hpp>
#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/bounded_loop.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using detail::BoundedLoop;
using detail::halves;
using detail::LoopStep;
using Complex = std::complex<double>;

namespace {

/// Gain or phase of a loop, as what is zero where it crosses, with what bounds its motion.
struct Crossing {
  double (*value)(Complex L);
  double (*part)(Complex slope);
  double (BoundedLoop::*motion)(const LoopStep&) const;
  double (BoundedLoop::*curvature)(const LoopStep&) const;
};

constexpr Crossing gain_crossing{[](Complex L) { return std::log(std::abs(L)); },
                                 [](Complex slope) { return slope.real(); }, &BoundedLoop::swing,
                                 &BoundedLoop::curvature};
constexpr Crossing phase_crossing{[](Complex L) { return std::arg(-L); },
                                  [](Complex slope) { return slope.imag(); }, &BoundedLoop::turn,
                                  &BoundedLoop::turn_curvature};

/// Every zero on the range; nothing where they do not end within the work.
std::optional<std::vector<double>> zeros(const BoundedLoop& loop, const LoopStep& range,
                                         const Crossing& crossing, detail::CrossingWork& work) {
  std::vector<double> found;
  std::vector<LoopStep> pending{range};
  constexpr double closest = 1e-13;
  const auto n = static_cast<double>(loop.factors().poles.size());
  // A bound or a value by factors, and the value itself: of a state space two solutions with its
  // Hessenberg form, refined in 31 digits.
  const double by_factors = 6.0 * (n + static_cast<double>(loop.factors().zeros.size())) + 10.0;
  const double exact = 8.0 * n * n + 30.0 * n + 200.0;
  const auto value = [&](double w) {
    work.spend(exact);
    return crossing.value(loop.at(w));
  };
  while (!pending.empty()) {
    if (!work.spend(2.0 * by_factors)) {
      return std::nullopt;
    }
    const LoopStep step = pending.back();
    pending.pop_back();
    const double moved = (loop.*crossing.motion)(step);
    // The factors' value where that is far from deciding.
    double at_start = crossing.value(loop.near(step.from));
    if (std::abs(at_start) > moved + 1e-6) {
      continue;
    }
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

double wrapped(double degrees) {
  const double turned = std::remainder(degrees, 360.0);
  return turned == -180.0 ? 180.0 : turned;
}

}  // namespace

Expected<LoopMargins> loop_margins(const FrequencyResponse& response) {
  return detail::whole_margins(response).map(
      [](detail::WholeMargins&& whole) { return std::move(whole.margins); });
}

Expected<detail::WholeMargins> detail::whole_margins(const FrequencyResponse& response) {
  const auto factors = response.factors();
  CrossingWork work(factors ? factors->poles.size() : 0);
  return whole_margins(response, work);
}

Expected<detail::WholeMargins> detail::whole_margins(const FrequencyResponse& response,
                                                     CrossingWork& work) {
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
  const LoopStep range = loop.range();
  double further = infinity;
  const auto without_end = [&](const char* crossings) {
    return refusal(SystemError::no_convergence, where, crossings)
        .got("without end: the loop stays where it crosses, or crosses more often than is listed");
  };
  const auto unit_gain = zeros(loop, range, gain_crossing, work);
  if (!unit_gain) {
    return without_end("the list of gain crossings");
  }
  auto places =
      zeros(loop, {range.from, std::min(range.to, loop.last_phase())}, phase_crossing, work);
  if (!places) {
    return without_end("the list of phase crossings");
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
  if (direct != 0.0 && !response.period() && loop.factors().delay > 0.0) {
    detail::approach(1.0 / std::abs(direct), margins);
  }
  for (const GainCrossing& crossing : margins.gain_crossings) {
    if (!margins.phase_margin ||
        std::abs(crossing.phase_margin) < std::abs(*margins.phase_margin)) {
      margins.phase_margin = crossing.phase_margin;
    }
  }
  const auto peaks = detail::peaks_of(loop, range, curve.frequency, response.period().has_value());
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
