#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <flyball/control/pid_design.hpp>
#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>

#include "classical/loop_peaks.hpp"
#include "control/pid_basis.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using classical::TransferFunction;
using Complex = std::complex<double>;

/// Frequencies at which a plant shows all that it does.
struct Span {
  double slow = infinity;
  double fast = 0.0;
  int integrators = 0;
  int unstable = 0;
  bool undamped = false;  ///< Poles on the border of stability besides integrators.
  std::vector<double> grid;
};

Expected<Span> span_of(const TransferFunction& plant, std::string_view where) {
  Span span;
  std::vector<Complex> places;
  FLYBALL_TRY_IN(where, const auto poles, plant.poles());
  FLYBALL_TRY_IN(where, const auto zeros, plant.zeros());
  const auto& period = plant.period();
  for (const auto* all : {&poles, &zeros}) {
    for (const Complex& place : *all) {
      const Complex s = !period        ? place
                        : place == 0.0 ? Complex(-40.0 / period->si(), 0.0)
                                       : std::log(place) / period->si();
      if (std::abs(s) > (period ? 1e-9 / period->si() : 0.0)) {
        places.push_back(s);
        span.slow = std::min(span.slow, std::abs(s));
        span.fast = std::max(span.fast, std::abs(s));
      }
    }
  }
  for (const Complex& pole : poles) {
    const double beyond = period ? std::abs(pole) - 1.0 : pole.real();
    const double size = period ? 1.0 : std::abs(pole);
    if (period ? std::abs(pole - 1.0) < 1e-9 : pole == 0.0) {
      ++span.integrators;
    } else if (std::abs(beyond) < 1e-9 * size) {
      span.undamped = true;
    } else {
      span.unstable += beyond > 0.0 ? 1 : 0;
    }
  }
  if (plant.delay() > 0.0) {
    span.slow = std::min(span.slow, 1.0 / plant.delay());
    span.fast = std::max(span.fast, 3.0 / plant.delay());
  }
  const double end = period ? pi / period->si() : infinity;
  if (period) {
    span.slow = std::min(span.slow, 0.1 / period->si());
    span.fast = end;
  }
  if (!(span.fast > 0.0)) {
    return refusal(PidDesignError::unlimited, where, "the plant")
        .got(span.integrators > 0 ? "of integrators alone, without lag or delay"
                                  : "a gain alone, without lag or delay")
        .expected("of a lag or a delay that limits the gains")
        .hint("ask for a crossover and a phase margin instead");
  }
  const double first = 1e-3 * span.slow;
  const double last = period ? end : 100.0 * span.fast;
  // A plant of more than twenty decades is looked at more coarsely, so that the work has a bound.
  constexpr double steps = 60.0;  // a decade
  constexpr double most_steps = 1200.0;
  const int count =
      static_cast<int>(std::min(steps * (std::log10(last) - std::log10(first)), most_steps)) + 1;
  for (int i = 0; i <= count; ++i) {
    const double share = static_cast<double>(i) / count;
    span.grid.push_back(std::pow(first, 1.0 - share) * std::pow(last, share));
  }
  for (const Complex& place : places) {
    // Sharp turns near the axis.
    const double width = std::max(std::abs(place.real()), 1e-6 * std::abs(place));
    const double centre = std::abs(place.imag());
    if (width < 0.3 * centre) {
      for (int k = -30; k <= 30; ++k) {
        const double w = centre + width * std::sinh(0.15 * k);
        if (w > first && w < last) {
          span.grid.push_back(w);
        }
      }
    }
  }
  std::sort(span.grid.begin(), span.grid.end());
  span.grid.erase(std::unique(span.grid.begin(), span.grid.end()), span.grid.end());
  return span;
}

/// Gains of a sign: kp, and T_d = kd/kp.
struct Point {
  double kp = 0.0;
  double derivative_time = 0.0;
};

struct Candidate {
  Point point;
  double sign = 1.0;  ///< Of ki.
  double ki = 0.0;    ///< |ki|
};

class Search {
 public:
  Search(const TransferFunction& plant, const RobustnessGoal& goal, PidForm form, Span span)
      : plant_(plant), goal_(goal), form_(form), span_(std::move(span)) {
    responses_.reserve(span_.grid.size());
    for (const double w : span_.grid) {
      responses_.push_back(plant.response(w));
    }
  }

  [[nodiscard]] double filter(const Point& point) const {
    return goal_.filter_ratio > 0.0 ? point.derivative_time / goal_.filter_ratio : 0.0;
  }

  /// How far |ki| may go at a frequency; -1 where no small one is allowed either.
  [[nodiscard]] double limit(double w, Complex P, const Point& point, double sign) const {
    const auto basis = detail::pid_basis(plant_.period(), filter(point), w);
    const Complex L = P * point.kp * (1.0 + point.derivative_time * basis.derivative);
    const Complex a = 1.0 + L;
    const Complex b = sign * P * basis.integral;
    const double square = std::norm(b);
    if (!std::isfinite(square) || !std::isfinite(std::norm(a))) {
      return infinity;
    }
    const double S = goal_.sensitivity;
    // |a + κb|² >= 1/M_s².
    double most = first_root(square, (a * std::conj(b)).real(), std::norm(a) - 1.0 / (S * S));
    if (std::isfinite(goal_.complementary)) {
      // (M_t² - 1)|L|² + 2 M_t² Re L + M_t² >= 0.
      const double T = goal_.complementary * goal_.complementary;
      most = std::min(
          most, first_root((T - 1.0) * square, (T - 1.0) * (L * std::conj(b)).real() + T * b.real(),
                           (T - 1.0) * std::norm(L) + 2.0 * T * L.real() + T));
    }
    if (form_ == PidForm::pid) {
      // |P S/(jω)| <= 1/ki: |a|² + 2κ Re(a b*) >= 0.
      const double slope = (a * std::conj(b)).real();
      most = std::min(most, slope < 0.0 ? std::norm(a) / (-2.0 * slope) : infinity);
    }
    return most;
  }

  /// The largest |ki|: the least limit of all frequencies; -1 if none is allowed.
  [[nodiscard]] double largest(const Point& point, double sign) const {
    double least = infinity;
    std::size_t at = 0;
    for (std::size_t i = 0; i < responses_.size(); ++i) {
      const double value = limit(span_.grid[i], responses_[i], point, sign);
      if (value < 0.0) {
        return -1.0;
      }
      if (value < least) {
        least = value;
        at = i;
      }
    }
    if (!std::isfinite(least)) {
      return least;
    }
    // Refined between its neighbours.
    const double low = span_.grid[at > 0 ? at - 1 : 0];
    const double high = span_.grid[std::min(at + 1, responses_.size() - 1)];
    const auto refined = find_minimum(
        [&](double w) { return limit(w, plant_.response(w), point, sign); }, low, high);
    return refined ? std::min(least, refined->value) : least;
  }

  /// Whether 1 + L turns as often as a stable loop's does along the grid: what keeps its distance
  /// from -1 may be on the wrong side of it.
  [[nodiscard]] bool may_be_stable(const Candidate& candidate) const {
    if (span_.undamped) {
      return true;
    }
    double turned = 0.0;
    Complex before = 0.0;
    for (std::size_t i = 0; i < responses_.size(); ++i) {
      const auto& [kp, time] = candidate.point;
      const auto basis = detail::pid_basis(plant_.period(), filter(candidate.point), span_.grid[i]);
      const Complex now = 1.0 + responses_[i] * (kp * (1.0 + time * basis.derivative) +
                                                 candidate.sign * candidate.ki * basis.integral);
      turned += i > 0 ? std::arg(now / before) : 0.0;
      before = now;
    }
    const double whole = pi * (0.5 * (span_.integrators + 1) + span_.unstable);
    return std::abs(turned - whole) < 0.5 * pi;
  }

  [[nodiscard]] const Span& span() const { return span_; }
  [[nodiscard]] const std::vector<Complex>& responses() const { return responses_; }

 private:
  /// The smallest positive root of a x² + 2 b x + c; ∞ without one, -1 where c < 0.
  static double first_root(double a, double b, double c) {
    if (c < 0.0) {
      return -1.0;
    }
    const double discriminant = b * b - a * c;
    if (a > 0.0 ? b >= 0.0 || discriminant <= 0.0 : discriminant < 0.0) {
      return infinity;
    }
    if (a < 0.0) {
      return (-b - std::sqrt(discriminant)) / a;
    }
    const double below = -b + std::sqrt(discriminant);
    return below > 0.0 ? c / below : infinity;
  }

  const TransferFunction& plant_;
  const RobustnessGoal& goal_;
  PidForm form_;
  Span span_;
  std::vector<Complex> responses_;
};

PidGains gains_of(const Candidate& candidate) {
  return {candidate.point.kp, candidate.sign * candidate.ki,
          candidate.point.kp * candidate.point.derivative_time};
}

/// Climbs from a candidate in log kp, log T_d: both by steps that halve.
Candidate climbed(const Search& search, Candidate best, bool derivative) {
  double step_p = 0.3;
  double step_d = derivative ? 0.4 : 0.0;
  const auto attempt = [&](double p, double d) {
    Candidate next = best;
    next.point.kp *= std::exp(p);
    next.point.derivative_time *= std::exp(d);
    next.ki = search.largest(next.point, next.sign);
    if (next.ki > best.ki) {
      best = next;
      return true;
    }
    return false;
  };
  if (best.point.kp == 0.0) {
    return best;
  }
  for (int i = 0; i < 400 && (step_p > 1e-10 || step_d > 1e-10); ++i) {
    bool better = attempt(step_p, 0.0) || attempt(-step_p, 0.0);
    if (derivative) {
      better = attempt(0.0, step_d) || attempt(0.0, -step_d) || better;
      // Along ridges.
      better = better || attempt(step_p, step_d) || attempt(-step_p, step_d) ||
               attempt(step_p, -step_d) || attempt(-step_p, -step_d) ||
               attempt(0.5 * step_p, step_d) || attempt(-0.5 * step_p, step_d) ||
               attempt(step_p, 0.5 * step_d) || attempt(-step_p, 0.5 * step_d);
    }
    if (!better) {
      step_p *= 0.6;
      step_d *= 0.6;
    }
  }
  return best;
}

Expected<TransferFunction> loop_of(const TransferFunction& plant, const PidGains& gains,
                                   double tau) {
  FLYBALL_TRY(const auto controller, pid_transfer(gains, tau, plant.period()));
  return series(controller, plant);
}

}  // namespace

Expected<PidLoop> tune_by_robustness(const TransferFunction& plant, PidForm form,
                                     const RobustnessGoal& goal) {
  constexpr std::string_view where = "tune_by_robustness";
  FLYBALL_CHECK(Checks(where).not_negative(goal.filter_ratio, "the filter ratio"));
  for (const auto& [value, name] : {std::pair(goal.sensitivity, "the sensitivity"),
                                    {goal.complementary, "the complementary sensitivity"}}) {
    if (!(value > 1.0) || std::isinf(goal.sensitivity)) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(format_number(value))
          .expected("above 1, such as 1.4");
    }
  }
  if (form != PidForm::pi && form != PidForm::pid) {
    return refusal(PidDesignError::no_rule, where, "the form")
        .got(form == PidForm::p ? "P" : "PD")
        .expected("PI or PID: it is the integral gain that is made large");
  }
  const bool derivative = form == PidForm::pid;
  if (derivative && !plant.period()) {
    FLYBALL_CHECK(check_positive(goal.filter_ratio, where, "the filter ratio"));
  }
  FLYBALL_TRY(auto span, span_of(plant, where));
  const Search search(plant, goal, form, std::move(span));

  // A grid of proportional gains that matter somewhere, and of derivative times.
  double least_gain = infinity;
  double most_gain = 0.0;
  for (const Complex& P : search.responses()) {
    const double size = std::abs(P);
    if (size > 0.0 && std::isfinite(size)) {
      least_gain = std::min(least_gain, 1.0 / size);
      most_gain = std::max(most_gain, 1.0 / size);
    }
  }
  if (!(most_gain > 0.0)) {
    return refusal(PidDesignError::no_rule, where, "the plant").got("zero");
  }
  std::vector<double> kps{0.0};
  const double first = 0.03 * least_gain;
  const double last = std::min(most_gain, 1e9 * least_gain);
  const int count = static_cast<int>(10.0 * std::log10(last / first)) + 1;
  for (int i = 0; i <= count; ++i) {
    kps.push_back(first * std::pow(last / first, static_cast<double>(i) / count));
  }
  std::vector<double> times{0.0};
  if (derivative) {
    const double shortest = 0.03 / search.span().fast;
    const double longest = 3.0 / search.span().slow;
    constexpr int parts = 24;
    for (int i = 0; i <= parts; ++i) {
      times.push_back(shortest * std::pow(longest / shortest, static_cast<double>(i) / parts));
    }
  }
  std::vector<Candidate> found;
  for (const double sign : {1.0, -1.0}) {
    for (const double kp : kps) {
      for (const double time : times) {
        if (kp == 0.0 && time > 0.0) {
          continue;
        }
        const Candidate candidate{{sign * kp, time}, sign, search.largest({sign * kp, time}, sign)};
        if (candidate.ki > 0.0) {
          found.push_back(candidate);
        }
      }
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Candidate& a, const Candidate& b) { return a.ki > b.ki; });
  constexpr int most_tried = 40;
  int tried = 0;
  int climbs = 0;
  std::optional<Candidate> best;
  for (const Candidate& start : found) {
    if (tried == most_tried || climbs == (derivative ? 6 : 2) ||
        (best && start.ki < 0.5 * best->ki)) {
      break;
    }
    Candidate finite = start;
    finite.ki = std::isfinite(start.ki) ? start.ki : 1.0;
    if (!search.may_be_stable(finite)) {
      continue;
    }
    ++tried;
    const auto stable = loop_of(plant, gains_of(finite), search.filter(finite.point))
                            .and_then(classical::detail::keeps_stable);
    if (!stable || !*stable) {
      continue;
    }
    ++climbs;
    const Candidate top = std::isinf(start.ki) ? start : climbed(search, start, derivative);
    // A gain of one beyond all that the plant does: nothing there would stop it.
    if (std::isinf(top.ki) || std::abs(top.point.kp) >= 0.3 * last) {
      return refusal(PidDesignError::unlimited, where, "the integral gain")
          .got("without a bound: the plant has so little lag that any is as robust")
          .hint("ask for a crossover and a phase margin instead");
    }
    if (!best || top.ki > best->ki) {
      best = top;
    }
  }
  if (!best) {
    return refusal(PidDesignError::nothing_robust, where, "the sensitivity")
        .got(format_number(goal.sensitivity))
        .expected("a value that some stable loop of this form keeps")
        .hint("a larger sensitivity, or PID where it was PI");
  }
  const double tau = search.filter(best->point);
  // Down by what the grid of frequencies may have missed.
  const auto excess = [&](double ki) {
    Candidate trial = *best;
    trial.ki = ki;
    const auto margins =
        loop_of(plant, gains_of(trial), tau).and_then([](const TransferFunction& loop) {
          return classical::loop_margins(loop);
        });
    return margins && margins->stable ? margins->sensitivity.value - goal.sensitivity * (1.0 + 1e-9)
                                      : infinity;
  };
  if (const double at_best = excess(best->ki); at_best > 0.0) {
    const double half = 0.5 * best->ki;
    const double at_half = excess(half);
    if (at_half > 0.0) {
      return refusal(PidDesignError::nothing_robust, where, "a set of gains")
          .got("not found that is as robust as on the grid of frequencies")
          .hint("ask for a crossover and a phase margin instead");
    }
    const auto limit =
        find_root(excess, half, best->ki, at_half, at_best, {.relative_tolerance = 1e-12});
    best->ki = !limit                   ? half
               : limit->residual <= 0.0 ? limit->x
                                        : std::min(limit->low, limit->high);
  }
  FLYBALL_TRY_IN(where, auto loop, assess_pid(plant, gains_of(*best), tau));
  return loop;
}

}  // namespace flyball
