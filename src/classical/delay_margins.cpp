#include <flyball/classical/delay_margins.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/delay_bounds.hpp"
#include "classical/delay_frequency.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_norm.hpp"

namespace flyball::classical {

using detail::DelayBounds;
using detail::DelayPoint;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Complex = std::complex<double>;

namespace {

constexpr double closest = 1e-13;
/// Of the intervals that all crossings of one loop take.
constexpr long most_steps = 60'000;
/// Of the disk's radius, how far the ends of an interval are from its middle.
constexpr double share = 0.25;
/// The same where L bends little enough that a larger disk tells more of its slope.
constexpr double smaller_share = 1.0 / 256.0;

struct Step {
  double from = 0.0;
  double to = 0.0;

  [[nodiscard]] double middle() const { return 0.5 * (from + to); }
  [[nodiscard]] double half() const { return 0.5 * (to - from); }
  [[nodiscard]] bool is_short() const { return to - from <= closest * to; }
  /// Its halves, the higher one first.
  [[nodiscard]] std::array<Step, 2> halves() const {
    const double cut = to > 2.0 * from && from > 0.0 ? std::sqrt(from * to) : middle();
    return {Step{cut, to}, Step{from, cut}};
  }
};

/// L in the middle of a step, its slope along the axis, and what both move by on it.
struct Moves {
  Complex L;
  Complex slope;
  double off = infinity;
  double bend = infinity;

  Moves(const DelayBounds& bounds, const DelayPoint& middle, const Step& step, double part)
      : L(middle.value(0, 0)), slope(middle.slope(0, 0) * Complex(0.0, 1.0)) {
    off = bounds.bound(middle, step.half() / part)(0, 0) * part;
    bend = off / step.half() * (1.0 / ((1.0 - part) * (1.0 - part)) - 1.0);
  }
  /// Whether a part of L' conj(L) keeps its sign.
  [[nodiscard]] bool keeps(double (*of)(Complex)) const {
    const double changed = bend * (std::abs(L) + off) + std::abs(slope) * off;
    return std::isfinite(off) && off < 0.5 * std::abs(L) &&
           std::abs(of(slope * std::conj(L))) > changed;
  }
};

Expected<void> check_single(const DelaySystem& loop, std::string_view where) {
  if (loop.inputs() != 1 || loop.outputs() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("of one input and one output");
  }
  return {};
}

/// Gain or phase of a loop, as what is zero where it crosses.
struct DelayCrossing {
  double (*value)(Complex L);
  /// Of L'/L along the axis.
  double (*part)(Complex slope);
  /// Whether it may be zero where L is within `off` of a value.
  bool (*possible)(Complex L, double off);
};

constexpr DelayCrossing gain_crossing_of_delays{
    [](Complex L) { return std::log(std::abs(L)); }, [](Complex slope) { return slope.real(); },
    [](Complex L, double off) { return std::abs(std::abs(L) - 1.0) <= off; }};
constexpr DelayCrossing phase_crossing_of_delays{
    [](Complex L) { return std::arg(-L); }, [](Complex slope) { return slope.imag(); },
    // The distance from the negative half of the real line.
    [](Complex L, double off) {
      return (L.real() < 0.0 ? std::abs(L.imag()) : std::abs(L)) <= off;
    }};

/// So many, and fewer of more than ten states and delays, N, because a step costs O(N³).
long steps_of(const DelaySystem& system, long most) {
  const double size = 0.1 * static_cast<double>(system.states() + system.form().delays.size());
  return std::lround(static_cast<double>(most) / std::max(1.0, size * size * size));
}

/// Every zero on the range, nothing where they do not end. What holds on the whole of a step of
/// which ln L moves by less than a radian: its slope's part keeps the sign, or it is halved.
/// @param steps  How many steps are left.
std::optional<std::vector<double>> zeros(const DelaySystem& loop, const DelayBounds& bounds,
                                         const Step& range, const DelayCrossing& crossing,
                                         long& steps) {
  std::vector<double> found;
  std::vector<Step> pending{range};
  const auto value = [&](double w) { return crossing.value(loop.response(w)(0, 0)); };
  while (!pending.empty()) {
    if (--steps < 0) {
      return std::nullopt;
    }
    const Step step = pending.back();
    pending.pop_back();
    const DelayPoint middle = bounds.at(step.middle());
    const Moves moves(bounds, middle, step, share);
    if (std::isfinite(moves.off) && !crossing.possible(moves.L, moves.off)) {
      continue;
    }
    const auto keeps = [&](double part) {
      return Moves(bounds, middle, step, part).keeps(crossing.part);
    };
    // Of a step far below every root the disk may reach up to those.
    const double least_share = step.half() / (0.1 * bounds.slowest());
    if (moves.keeps(crossing.part) || keeps(smaller_share) ||
        (least_share < smaller_share && keeps(least_share))) {
      const double at_start = value(step.from);
      const double at_end = value(step.to);
      if ((at_start > 0.0) != (at_end > 0.0)) {
        if (const auto root = find_root(value, step.from, step.to, at_start, at_end)) {
          found.push_back(root->x);
        }
      }
      continue;
    }
    if (step.is_short()) {
      // It touches zero, or there is a pole or zero of L on the axis, which is no crossing.
      if (std::isfinite(moves.off) && moves.off < 0.1 * std::abs(moves.L) &&
          std::abs(crossing.value(moves.L)) < 1e-9) {
        found.push_back(step.middle());
      }
      continue;
    }
    for (const Step& half : step.halves()) {
      pending.push_back(half);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end(),
                          [](double a, double b) { return b - a <= 1e-12 * b; }),
              found.end());
  return found;
}

/// From where the asymptote K ω^{-N} rules, so that it does not cross one below.
double lowest(const DelaySystem& loop, const DelayBounds& bounds) {
  double from = 1e-6 * bounds.slowest();
  const double here = std::abs(loop.response(from)(0, 0));
  const double before = std::abs(loop.response(0.5 * from)(0, 0));
  const double integrators = std::round(std::log2(before / here));
  if (std::isfinite(integrators) && integrators != 0.0 && here > 0.0 &&
      (here < 1.0) == (integrators > 0.0)) {
    from *= 0.1 * std::pow(here, 1.0 / integrators);
  }
  // What is 1 at rest leaves it as a square, which is rounding at first.
  while (std::abs(std::log(std::abs(loop.response(from)(0, 0)))) < 1e-8 &&
         from < 1e-3 * bounds.slowest()) {
    from *= 2.0;
  }
  return std::max(from, 1e-290);
}

/// From where on the gain stays below a level; infinite if that is not known.
double last_above(const DelayBounds& bounds, double level) {
  const auto below = [&](double w) {
    const MatrixXd most = bounds.beyond(w);
    return most.allFinite() && flyball::detail::singular_values_of(most)(0) < level;
  };
  if (!below(infinity)) {
    return infinity;
  }
  double high = bounds.fastest();
  for (int i = 0; i < 200 && !below(high); ++i) {
    high *= 2.0;
  }
  return high;
}

/// u = F y + E r, y' = H y + J r with multiples of the identity.
Expected<DelaySystem> closed(const DelaySystem& loop, double of_output, double of_input) {
  const MatrixXd one = MatrixXd::Identity(loop.inputs(), loop.inputs());
  return rewired(loop, {-one, one, of_output * one, of_input * one});
}

double largest(const MatrixXcd& G) {
  return G.allFinite() ? flyball::detail::spectral_norm_of_complex(G) : 0.0;
}

double wrapped_degrees(double degrees) {
  const double turned = std::remainder(degrees, 360.0);
  return turned == -180.0 ? 180.0 : turned;
}

}  // namespace

Expected<Peak> peak_gain(const DelaySystem& system) {
  constexpr std::string_view where = "peak gain";
  if (system.period()) {
    return refusal(TransferError::period_mismatch, where, "the system")
        .got(flyball::detail::format("sampled at {} s", system.period()->si()))
        .expected("continuous");
  }
  Eigen::VectorXcd rightmost;
  if (system.has_delay_in_loop()) {
    if (const auto found = rightmost_poles(system)) {
      rightmost = found->poles;
    }
  }
  return detail::peak_gain_with(system, rightmost);
}

Expected<Peak> detail::peak_gain_with(const DelaySystem& system,
                                      const Eigen::VectorXcd& rightmost) {
  FLYBALL_TRY_IN("peak gain", const auto grid, frequency_grid(response_with(system, rightmost)));
  DelayBounds bounds(system);
  Peak best;
  const auto consider = [&](double value, double w) {
    if (value > best.value) {
      best = {value, w};
    }
  };
  const auto size = [&](double w) { return largest(system.response(w)); };
  consider(size(0.0), 0.0);
  std::vector<Step> pending;
  double last = 0.0;
  for (const double w : grid.frequency) {
    consider(size(w), w);
    pending.push_back({last, w});
    last = w;
  }
  // As far as anything above the best can be.
  constexpr double tolerance = 1e-5;
  const double at_infinity = bounds.largest_at_infinity();
  const double most = std::max(best.value, at_infinity) * (1.0 + 1e-3);
  const double end = std::min(last_above(bounds, most), 1e3 * std::max(bounds.fastest(), last));
  for (; last < end; last *= 2.0) {
    pending.push_back({last, 2.0 * last});
  }
  std::reverse(pending.begin(), pending.end());
  long steps = steps_of(system, 20'000);
  for (; !pending.empty() && steps > 0; --steps) {
    const Step step = pending.back();
    pending.pop_back();
    const DelayPoint middle = bounds.at(step.middle());
    consider(largest(middle.value), step.middle());
    // Straight between the ends, of which the norm is largest at one, and what is left.
    const double rest =
        bounds.bound(middle, step.half() / share).norm() * share * share / (1.0 - share);
    const MatrixXcd moved = middle.slope * Complex(0.0, step.half());
    const double bound =
        std::isfinite(rest)
            ? std::max(largest(middle.value + moved), largest(middle.value - moved)) + rest
            : infinity;
    if (bound > best.value * (1.0 + tolerance) && !step.is_short()) {
      for (const Step& half : step.halves()) {
        pending.push_back(half);
      }
    }
  }
  if (best.frequency > 0.0) {
    for (const double width : {1e-2, 1e-4}) {
      const auto top = find_minimum([&](double w) { return -size(w); },
                                    best.frequency * (1.0 - width), best.frequency * (1.0 + width));
      if (top) {
        consider(-top->value, top->x);
      }
    }
  }
  if (at_infinity > best.value * (1.0 - 1e-12)) {
    best = {at_infinity, infinity};
  }
  return best;
}

Expected<LoopMargins> loop_margins(const DelaySystem& loop) {
  constexpr std::string_view where = "margins";
  FLYBALL_CHECK(check_single(loop, where));
  if (loop.period()) {
    FLYBALL_TRY_IN(where, const auto states, loop.to_discrete());
    FLYBALL_TRY_IN(where, const auto response, frequency_response(states));
    return loop_margins(response);
  }
  if (!loop.has_delay()) {
    FLYBALL_TRY_IN(where, const auto states, loop.to_continuous());
    FLYBALL_TRY_IN(where, const auto response, frequency_response(states));
    return loop_margins(response);
  }
  FLYBALL_TRY_IN(where, const DelaySystem T, feedback(loop));
  FLYBALL_TRY_IN(where, const DelayPoles poles, rightmost_poles(T));
  LoopMargins margins;
  margins.stable = poles.stable;
  margins.unstable_poles = poles.unstable;
  DelayBounds bounds(loop);
  bounds.consider(poles.poles);
  const double fastest = 10.0 * bounds.fastest();
  const double from = lowest(loop, bounds);
  const double end = last_above(bounds, 1.0);
  long steps = steps_of(loop, most_steps);
  const auto unit_gain =
      zeros(loop, bounds, {from, std::isfinite(end) ? std::max(end, fastest) : fastest},
            gain_crossing_of_delays, steps);
  const auto places = zeros(loop, bounds, {from, fastest}, phase_crossing_of_delays, steps);
  if (!unit_gain || !places) {
    return refusal(SystemError::no_convergence, where,
                   !unit_gain ? "the list of gain crossings" : "the list of phase crossings")
        .got("without end: the loop stays where it crosses, or crosses very often");
  }
  double further = infinity;
  for (const double w : *unit_gain) {
    const double margin = wrapped_degrees(180.0 + std::arg(loop.response(w)(0, 0)) * 180.0 / pi);
    margins.gain_crossings.push_back({w, margin});
    further = std::min(further, (margin > 0.0 ? margin : margin + 360.0) * pi / 180.0 / w);
    if (!margins.phase_margin || std::abs(margin) < std::abs(*margins.phase_margin)) {
      margins.phase_margin = margin;
    }
  }
  const bool jumps = std::isinf(end) && bounds.largest_at_infinity() >= 1.0;
  margins.delay_margin = margins.stable && !jumps ? further : 0.0;
  constexpr std::size_t most = 1000;
  constexpr double integrator = 1e12;
  if (const double rest = loop.response(0.0)(0, 0).real(); rest < 0.0 && rest > -integrator) {
    margins.phase_crossings.push_back({0.0, -1.0 / rest});
    margins.gain_margin = -1.0 / rest;
  }
  for (const double w : *places) {
    const double gain = std::abs(loop.response(w)(0, 0));
    if (!(gain > 0.0) || !std::isfinite(gain) || margins.phase_crossings.size() == most) {
      continue;
    }
    margins.phase_crossings.push_back({w, 1.0 / gain});
    if (!margins.gain_margin ||
        std::abs(std::log(gain)) < std::abs(std::log(*margins.gain_margin))) {
      margins.gain_margin = 1.0 / gain;
    }
  }
  FLYBALL_TRY_IN(where, const DelaySystem S, closed(loop, -1.0, 1.0));
  FLYBALL_TRY_IN(where, const DelaySystem difference, closed(loop, -2.0, 1.0));
  FLYBALL_TRY_IN(where, margins.sensitivity, detail::peak_gain_with(S, poles.poles));
  FLYBALL_TRY_IN(where, margins.complementary, detail::peak_gain_with(T, poles.poles));
  FLYBALL_TRY_IN(where, const Peak spread, detail::peak_gain_with(difference, poles.poles));
  margins.disk_margin = margins.stable ? 2.0 / spread.value : 0.0;
  return margins;
}

Expected<std::optional<double>> bandwidth(const DelaySystem& system, double factor) {
  constexpr std::string_view where = "bandwidth";
  FLYBALL_CHECK(check_single(system, where));
  const double rest = std::abs(system.dc_gain()(0, 0));
  if (!(rest > 0.0) || !std::isfinite(rest)) {
    return std::optional<double>();
  }
  // |G| crosses factor |G(0)| where |G/(factor |G(0)|)| crosses one.
  const MatrixXd scale = MatrixXd::Constant(1, 1, 1.0 / (factor * rest));
  FLYBALL_TRY_IN(where, const DelaySystem gain, DelaySystem::gain(scale, system.period()));
  FLYBALL_TRY_IN(where, const DelaySystem scaled, series(system, gain));
  const auto falls = [&](double w) {
    return std::abs(scaled.response(w * (1.0 + 1e-6))(0, 0)) < 1.0;
  };
  if (scaled.period() || !scaled.has_delay()) {
    FLYBALL_TRY_IN(where, const LoopMargins margins, loop_margins(scaled));
    for (const GainCrossing& at : margins.gain_crossings) {
      if (falls(at.frequency)) {
        return std::optional(at.frequency);
      }
    }
    return std::optional<double>();
  }
  const DelayBounds bounds(scaled);
  const double end = last_above(bounds, 1.0);
  long steps = steps_of(scaled, most_steps);
  const auto crossings = zeros(
      scaled, bounds, {lowest(scaled, bounds), std::isfinite(end) ? end : 10.0 * bounds.fastest()},
      gain_crossing_of_delays, steps);
  if (!crossings) {
    return refusal(SystemError::no_convergence, where, "the list of gain crossings")
        .got("without end");
  }
  for (const double w : *crossings) {
    if (falls(w)) {
      return std::optional(w);
    }
  }
  return std::optional<double>();
}

}  // namespace flyball::classical
