#include <flyball/classical/loop_margins.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/delay_characteristic.hpp"
#include "classical/factors.hpp"
#include "classical/loop_peaks.hpp"
#include "classical/polynomial.hpp"
#include "classical/whole_periods.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::classical {

namespace {

using detail::plus;
using detail::Polynomial;
using detail::times;
using Eigen::Index;
using Eigen::VectorXd;
using Complex = std::complex<double>;

tl::unexpected<Error> no_convergence() {
  return refusal(SystemError::no_convergence, "margins", "a root of a polynomial")
      .got("not found: the iteration for the eigenvalues of its companion matrix did not end");
}

/// x p(x).
Polynomial shifted(const Polynomial& p) {
  Polynomial more = Polynomial::zero(p.rows() + 1, 1);
  more.hi.topRows(p.rows()) = p.hi;
  more.lo.topRows(p.rows()) = p.lo;
  return more;
}

/// Horner's rule in 31 digits, since beside a weakly damped root nearly all of the terms cancel.
double at(const Polynomial& p, double x) {
  double high = 0.0;
  double low = 0.0;
  for (Index i = 0; i < p.rows(); ++i) {
    const double product = high * x;
    const double lost = std::fma(high, x, -product) + low * x;
    const double sum = product + p.hi(i, 0);
    const double back = sum - product;
    const double rest = (product - (sum - back)) + (p.hi(i, 0) - back) + lost + p.lo(i, 0);
    high = sum + rest;
    low = rest - (high - sum);
  }
  return high + low;
}

/// |p(jω)|² as a polynomial in x = ω².
Polynomial square(const detail::OnTheAxis& p) {
  return plus(times(p.even, p.even), 1.0, shifted(times(p.odd, p.odd)));
}

/// d arg p(jω)/dω |p(jω)|², in x.
Polynomial turning(const detail::OnTheAxis& p) {
  const Polynomial inner = plus(p.odd, 2.0, shifted(detail::derivative(p.odd)));
  return plus(times(p.even, inner), -2.0, shifted(times(p.odd, detail::derivative(p.even))));
}

/// A transfer function on the border of stability, in x: of a discrete one x = tan²(ωT/2).
class Border {
 public:
  explicit Border(const TransferFunction& loop) : loop_(loop) {
    num_ = detail::polynomial(loop.num());
    den_ = detail::polynomial(loop.den());
    if (!loop.period()) {
      use_unit(detail::unit_of(loop.den()));
      // Where squares would leave the doubles' range: the closed loop's unit, in which what is too
      // slow to be told from 0 is at 0.
      constexpr double range = 1e140;
      if (largest(num_) > range * largest(den_) || spread() > range) {
        num_ = detail::polynomial(loop.num());
        den_ = detail::polynomial(loop.den());
        VectorXd sum = loop.den().cwiseAbs();
        sum.tail(loop.num().size()) += loop.num().cwiseAbs();
        use_unit(detail::unit_of(sum));
        const double least = std::max(largest(num_), largest(den_)) / range;
        for (Polynomial* p : {&num_, &den_}) {
          for (Index i = 1; i < p->rows(); ++i) {
            if (std::abs(p->hi(i, 0)) < least) {
              p->hi(i, 0) = p->lo(i, 0) = 0.0;
            }
          }
        }
      }
    }
    // Squares of the coefficients are formed, of which none may leave the doubles' range.
    const int size = std::ilogb(den_.hi.cwiseAbs().maxCoeff());
    num_ = flyball::detail::scaled(std::move(num_), std::ldexp(1.0, -size));
    den_ = flyball::detail::scaled(std::move(den_), std::ldexp(1.0, -size));
    if (loop.period()) {
      // Its delay is poles at z = 0.
      const auto periods = detail::periods_in(loop.delay(), loop.period());
      for (Index i = 0; i < periods; ++i) {
        den_ = shifted(den_);
      }
      const Index degree = den_.rows() - 1;
      num_ = detail::bilinear(num_, degree);
      den_ = detail::bilinear(den_, degree);
    }
    n_ = detail::on_the_axis(num_);
    d_ = detail::on_the_axis(den_);
  }

  void use_unit(int unit) {
    unit_ = unit;
    detail::change_unit(num_, unit);
    detail::change_unit(den_, unit);
  }
  [[nodiscard]] static double largest(const Polynomial& p) { return p.hi.cwiseAbs().maxCoeff(); }
  /// The largest coefficient over the smallest that is not zero.
  [[nodiscard]] double spread() const {
    double most = 1.0;
    for (const Polynomial* p : {&num_, &den_}) {
      for (Index i = 0; i < p->rows(); ++i) {
        if (const double size = std::abs(p->hi(i, 0)); size > 0.0) {
          most = std::max(most, largest(den_) / size);
        }
      }
    }
    return most;
  }

  [[nodiscard]] const Polynomial& num() const { return num_; }
  [[nodiscard]] const Polynomial& den() const { return den_; }
  [[nodiscard]] const detail::OnTheAxis& n() const { return n_; }
  [[nodiscard]] const detail::OnTheAxis& d() const { return d_; }
  [[nodiscard]] Polynomial gain_above() const { return square(n_); }
  [[nodiscard]] Polynomial gain_below() const { return square(d_); }

  /// rad/s
  [[nodiscard]] double frequency(double x) const {
    return loop_.period() ? 2.0 * std::atan(std::sqrt(x)) / loop_.period()->si()
                          : std::ldexp(std::sqrt(x), unit_);
  }
  /// Of the rational part.
  [[nodiscard]] double phase(double x) const {
    const double w = std::sqrt(x);
    return std::arg(Complex(at(n_.even, x), w * at(n_.odd, x))) -
           std::arg(Complex(at(d_.even, x), w * at(d_.odd, x)));
  }
  [[nodiscard]] double gain(double x) const {
    const double w = std::sqrt(x);
    return std::abs(Complex(at(n_.even, x), w * at(n_.odd, x))) /
           std::abs(Complex(at(d_.even, x), w * at(d_.odd, x)));
  }
  /// s, of a continuous one: what is not in the polynomials.
  [[nodiscard]] double delay() const { return loop_.period() ? 0.0 : loop_.delay(); }
  /// The same in the unit of time in which x is told.
  [[nodiscard]] double own_delay() const { return std::ldexp(delay(), unit_); }

 private:
  const TransferFunction& loop_;
  Polynomial num_;
  Polynomial den_;
  int unit_ = 0;  ///< s = 2^unit s'.
  detail::OnTheAxis n_;
  detail::OnTheAxis d_;
};

/// In (-180, 180].
double wrapped_phase(double degrees) {
  const double turned = std::remainder(degrees, 360.0);
  return turned == -180.0 ? 180.0 : turned;
}

/// The largest of a(x)/b(x) over x >= 0 and at infinity.
Expected<std::pair<double, double>> largest_ratio(const Polynomial& above,
                                                  const Polynomial& below) {
  const Polynomial a = detail::trimmed(above);
  const Polynomial b = detail::trimmed(below);
  // The slope's numerator is a'b - ab' = a'd - ad' with d = b - a, in which what is equal above and
  // below has gone: what rounding leaves of it would be a root near infinity, beside which the
  // others are lost. So would the leading terms of an a and a d of one degree.
  const Polynomial d = detail::trimmed(plus(b, -1.0, a));
  Polynomial slope = plus(times(detail::derivative(a), d), -1.0, times(a, detail::derivative(d)));
  if (a.rows() == d.rows()) {
    slope.hi(0, 0) = slope.lo(0, 0) = 0.0;
  }
  const auto places = detail::positive_roots(slope);
  const auto poles = detail::positive_roots(b);
  if (!places || !poles) {
    return no_convergence();
  }
  double best = -1.0;
  double where = 0.0;
  const auto take = [&](double x, double value) {
    if (value > best) {
      best = value;
      where = x;
    }
  };
  const auto ratio = [&](double x) {
    const double under = at(b, x);
    return under > 0.0 ? at(a, x) / under : 0.0;
  };
  const double zero = at(b, 0.0);
  take(0.0, zero != 0.0 ? at(a, 0.0) / zero : at(a, 0.0) != 0.0 ? infinity : 0.0);
  for (const double x : *places) {
    // Where both vanish the slope does, too, and says nothing.
    take(x, ratio(x));
  }
  for (const double x : *poles) {
    // b is a square: of a root that is rounded, nothing is left in 31 digits.
    const VectorXd sizes = a.rounded().cwiseAbs();
    const VectorXd sizes_below = b.rounded().cwiseAbs();
    if (at(a, x) > 1e-12 * detail::value(sizes, x).real() &&
        at(b, x) <= 1e-27 * detail::value(sizes_below, x).real()) {
      take(x, infinity);
    }
  }
  // A narrow peak stands beside a root of b: searched there, as its slope's root may be too
  // inexact.
  const auto beside = detail::roots(b);
  if (!beside) {
    return no_convergence();
  }
  for (const Complex& root : *beside) {
    const double width = 4.0 * std::abs(root.imag());
    if (!(root.real() > 0.0) || !(width < root.real())) {
      continue;
    }
    const auto top =
        find_minimum([&](double part) { return -ratio(root.real() + part * width); }, -1.0, 1.0);
    if (top) {
      take(root.real() + top->x * width, -top->value);
    }
  }
  take(infinity, a.rows() < b.rows()   ? 0.0
                 : a.rows() > b.rows() ? infinity
                                       : a.hi(0, 0) / b.hi(0, 0));
  return std::pair(best, where);
}

/// L(∞) of the rational part, of a discrete one L(-1): where the border ends.
double at_infinity(const TransferFunction& loop) {
  if (loop.period()) {
    return loop.response(pi / loop.period()->si()).real();
  }
  return loop.relative_degree() > 0 ? 0.0 : loop.num()(0) / loop.den()(0);
}

/// Unstable roots of a closed loop's denominator, those on the border included; with a delay those
/// at s = 0 only, as the others leave the border with the first delay (`loop_margins` counts them).
Expected<int> unstable_roots(const TransferFunction& loop) {
  Polynomial den = detail::polynomial(loop.den());
  if (loop.period()) {
    const auto periods = detail::periods_in(loop.delay(), loop.period());
    for (Index i = 0; i < periods; ++i) {
      den = shifted(den);
    }
  }
  const Polynomial closed = plus(den, 1.0, detail::polynomial(loop.num()));
  auto roots = detail::roots(closed);
  if (!roots) {
    return no_convergence();
  }
  detail::settle_on_border(*roots, closed, loop.period().has_value());
  const bool leaves = !loop.period() && loop.delay() > 0.0;
  int count = 0;
  for (const Complex& root : *roots) {
    if (detail::on_axis(root, loop.period())) {
      count += leaves && root != 0.0 ? 0 : 1;
    } else {
      count += (loop.period() ? std::abs(root) > 1.0 : root.real() > 0.0) ? 1 : 0;
    }
  }
  if ((closed.hi.array() == 0.0).all()) {
    return 1;  // L is -1 everywhere
  }
  // A root at infinity: 1 + L(∞) = 0.
  return count + static_cast<int>(den.rows() - detail::trimmed(closed).rows());
}

Expected<std::vector<double>> phase_places(const Border& border) {
  const auto& n = border.n();
  const auto& d = border.d();
  if (border.own_delay() == 0.0) {
    // Im(N D*) = ω (No De - Ne Do).
    const auto places =
        detail::positive_roots(plus(times(n.odd, d.even), -1.0, times(n.even, d.odd)));
    if (!places) {
      return no_convergence();
    }
    return *places;
  }
  // f(ω) = arg L - ωT is monotone between the roots of f'.
  const Polynomial above = border.gain_above();
  const Polynomial below = border.gain_below();
  Polynomial slope = plus(times(turning(n), below), -1.0, times(turning(d), above));
  slope = plus(slope, -border.own_delay(), times(above, below));
  const auto stationary = detail::positive_roots(slope);
  if (!stationary) {
    return no_convergence();
  }
  double fastest = 1.0 / border.own_delay();
  double slowest = fastest;
  for (const Polynomial* p : {&border.num(), &border.den()}) {
    const auto roots = detail::roots(*p);
    if (!roots) {
      return no_convergence();
    }
    for (const Complex& root : *roots) {
      fastest = std::max(fastest, std::abs(root));
      slowest = root == 0.0 ? slowest : std::min(slowest, std::abs(root));
    }
  }
  const double end = 10.0 * fastest;
  std::vector<double> bounds{std::max(1e-6 * slowest, 1e-300)};
  for (const double x : *stationary) {
    const double w = std::sqrt(x);
    if (w > bounds.front() && w < end) {
      bounds.push_back(w);
    }
  }
  bounds.push_back(end);
  std::sort(bounds.begin(), bounds.end());
  constexpr std::size_t most_crossings = 1'000;
  // The phase without jumps: between neighbours it turns by less than half a turn at a time.
  const auto rational = [&](double w) { return border.phase(w * w); };
  std::vector<double> places;
  std::size_t asked = 0;
  for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
    constexpr int parts = 400;
    double a = bounds[i];
    double before = rational(a) - a * border.own_delay();
    const double ratio = std::pow(bounds[i + 1] / a, 1.0 / parts);
    for (int part = 0; part < parts; ++part) {
      const double b = part + 1 == parts ? bounds[i + 1] : a * ratio;
      const double turned =
          std::remainder(rational(b) - rational(a), 2.0 * pi) - (b - a) * border.own_delay();
      const double after = before + turned;
      const double low = std::min(before, after);
      const double high = std::max(before, after);
      for (double level = pi + 2.0 * pi * std::ceil((low - pi) / (2.0 * pi)); level <= high;
           level += 2.0 * pi) {
        // By frequency: parts and levels ascend. Beyond 2^53 turns no crossing has digits.
        if (++asked > most_crossings || level + pi == level) {
          return places;
        }
        const double from = rational(a);
        const double start = before;
        const auto root = find_root(
            [&](double w) {
              return start + std::remainder(rational(w) - from, 2.0 * pi) -
                     (w - a) * border.own_delay() - level;
            },
            a, b);
        if (root) {
          places.push_back(root->x * root->x);
        }
      }
      before = after;
      a = b;
    }
  }
  std::sort(places.begin(), places.end());
  return places;
}

Expected<void> check_order(const TransferFunction& loop) {
  constexpr Index most_states = 60;
  if (const double states = static_cast<double>(loop.order()) +
                            (loop.period() ? loop.delay() / loop.period()->si() : 0.0);
      states > static_cast<double>(most_states)) {
    return refusal(ArgumentError::out_of_range, "margins", "the loop's order")
        .got(flyball::detail::format("{}, its delay counted", states))
        .expected(flyball::detail::format("at most {}", most_states))
        .hint("sample it more slowly, or leave out what is fast");
  }
  return {};
}

/// What the crossings of a loop tell, without the peaks.
Expected<LoopMargins> crossings_of(const TransferFunction& loop, const Border& border) {
  LoopMargins margins;
  const Polynomial difference = plus(border.gain_above(), -1.0, border.gain_below());
  const auto unit_gain = detail::positive_roots(difference);
  if (!unit_gain) {
    return no_convergence();
  }
  const Polynomial steepness = detail::derivative(difference);
  FLYBALL_TRY(margins.unstable_poles, unstable_roots(loop));
  double unstable = margins.unstable_poles;  // may be many more than an int holds
  double further = infinity;
  for (const double x : *unit_gain) {
    const double w = border.frequency(x);
    constexpr double most_turned = 1e9;  // rad, of which a double has 1e-7 left
    if (!(w * border.delay() <= most_turned)) {
      return refusal(ArgumentError::out_of_range, "margins", "the delay")
          .got(flyball::detail::format("{} s, where the loop's gain is 1 at {} rad/s", loop.delay(),
                                       w))
          .expected(flyball::detail::format("at most {} s there", text::number(most_turned / w)))
          .hint("the phase turns so often by then that no digit of a margin is left");
    }
    const double rational = border.phase(x) * 180.0 / pi;
    const double margin = wrapped_phase(180.0 + rational - w * border.delay() * 180.0 / pi);
    margins.gain_crossings.push_back({w, margin});
    // Roots cross the axis at w when the delay is (φ + 2πk)/w, rightwards where |L| falls.
    double turn = std::fmod(180.0 + rational + 720.0, 360.0) * pi / 180.0;
    const int direction = at(steepness, x) < 0.0 ? 2 : -2;
    if (turn < 1e-9 || turn > 2.0 * pi - 1e-9) {
      // On the axis without a delay, and not counted there: they come, or have gone.
      turn = direction > 0 ? 0.0 : 2.0 * pi;
    }
    if (border.delay() > 0.0 && border.delay() * w >= turn * (1.0 - 1e-14)) {
      const double crossings =
          std::floor((border.delay() * w - turn) / (2.0 * pi) * (1.0 + 1e-14)) + 1.0;
      unstable += direction * crossings;
    }
    const double ahead = margin > 0.0 ? margin : margin + 360.0;
    further = std::min(further, ahead * pi / 180.0 / w);
  }
  const double last = std::abs(at_infinity(loop));
  if (last >= detail::endless_from && !loop.period()) {
    // Behind a delay infinitely many poles are near σ, e^{σT} = |L(∞)|.
    unstable = border.delay() > 0.0 ? infinity : unstable;
    further = 0.0;
  } else if (last >= 1.0 - 1e-14) {
    // The sign of 1 + L at z = -1 is L's, which one more period turns round.
    further = std::min(further, loop.period()->si());
  }
  margins.unstable_poles = static_cast<int>(std::clamp(unstable, 0.0, 2147483647.0));
  margins.stable = margins.unstable_poles == 0;
  margins.delay_margin = margins.stable ? further : 0.0;

  // L is real at zero frequency, too.
  const double rest = loop.dc_gain();
  if (rest < 0.0 && std::isfinite(rest)) {
    margins.phase_crossings.push_back({0.0, 1.0 / std::abs(rest)});
  }
  FLYBALL_TRY(const auto places, phase_places(border));
  for (const double x : places) {
    const double gain = border.gain(x);
    const double w = border.frequency(x);
    const double turned = border.phase(x) - w * border.delay();
    if (std::cos(turned) < 0.0 && gain > 0.0 && std::isfinite(gain)) {
      margins.phase_crossings.push_back({w, 1.0 / gain});
    }
  }
  if (loop.period()) {
    const Complex end = loop.response(pi / loop.period()->si());
    if (end.real() < 0.0 && std::isfinite(end.real())) {
      margins.phase_crossings.push_back({pi / loop.period()->si(), 1.0 / std::abs(end.real())});
    }
  }
  if (const double end = at_infinity(loop);
      !loop.period() && border.delay() == 0.0 && loop.order() > 0 && end < 0.0) {
    margins.phase_crossings.push_back({infinity, 1.0 / std::abs(end)});
  }
  for (const PhaseCrossing& crossing : margins.phase_crossings) {
    const auto off = [](double gain) { return std::abs(std::log(gain)); };
    if (!margins.gain_margin || off(crossing.gain_margin) < off(*margins.gain_margin)) {
      margins.gain_margin = crossing.gain_margin;
    }
  }
  if (const double end = at_infinity(loop); end != 0.0 && !loop.period() && border.delay() > 0.0) {
    detail::approach(1.0 / std::abs(end), margins);
  }
  for (const GainCrossing& crossing : margins.gain_crossings) {
    if (!margins.phase_margin ||
        std::abs(crossing.phase_margin) < std::abs(*margins.phase_margin)) {
      margins.phase_margin = crossing.phase_margin;
    }
  }
  return margins;
}

}  // namespace

Expected<bool> detail::keeps_stable(const TransferFunction& loop) {
  FLYBALL_CHECK(check_order(loop));
  return crossings_of(loop, Border(loop)).map([](const LoopMargins& of) { return of.stable; });
}

Expected<LoopMargins> loop_margins(const TransferFunction& loop) {
  FLYBALL_CHECK(check_order(loop));
  const Border border(loop);
  FLYBALL_TRY(LoopMargins margins, crossings_of(loop, border));
  if (border.delay() == 0.0) {
    const Polynomial above = border.gain_above();
    const Polynomial below = border.gain_below();
    const auto closed = detail::on_the_axis(plus(border.den(), 1.0, border.num()));
    const auto opposite = detail::on_the_axis(plus(border.den(), -1.0, border.num()));
    FLYBALL_TRY(const auto sensitivity, largest_ratio(below, square(closed)));
    margins.sensitivity = {std::sqrt(sensitivity.first), border.frequency(sensitivity.second)};
    FLYBALL_TRY(const auto complementary, largest_ratio(above, square(closed)));
    margins.complementary = {std::sqrt(complementary.first),
                             border.frequency(complementary.second)};
    FLYBALL_TRY(const auto spread, largest_ratio(square(opposite), square(closed)));
    margins.disk_margin = margins.stable ? 2.0 / std::sqrt(spread.first) : 0.0;
    return margins;
  }
  // With a delay no polynomial has the peaks, and no grid of its turns alone: they are bounded.
  FLYBALL_TRY(const FrequencyResponse response, frequency_response(loop));
  FLYBALL_TRY(const detail::LoopPeaks peaks, detail::loop_peaks(response));
  margins.sensitivity = peaks.sensitivity;
  margins.complementary = peaks.complementary;
  margins.disk_margin = margins.stable ? 2.0 / peaks.spread.value : 0.0;
  return margins;
}

Expected<std::optional<double>> bandwidth(const TransferFunction& transfer, double factor) {
  const double dc = std::abs(transfer.dc_gain());
  if (!(dc > 0.0) || !std::isfinite(dc)) {
    return std::nullopt;
  }
  // Of a gain of about one, so that its square is a number.
  int power = 0;
  const double level = factor * std::frexp(dc, &power);
  FLYBALL_TRY(const auto unit, TransferFunction::create(std::ldexp(1.0, -power) * transfer.num(),
                                                        transfer.den(), transfer.period()));
  const Border border(unit);
  const Polynomial bound =
      times(border.gain_below(), detail::polynomial(VectorXd::Constant(1, level * level)));
  const auto places = detail::positive_roots(plus(border.gain_above(), -1.0, bound));
  if (!places) {
    return no_convergence();
  }
  if (places->empty()) {
    return std::nullopt;
  }
  return std::optional(border.frequency(places->front()));
}

Expected<Peak> peak_gain(const TransferFunction& transfer) {
  const Border border(transfer);
  FLYBALL_TRY(const auto found, largest_ratio(border.gain_above(), border.gain_below()));
  return Peak{std::sqrt(found.first), border.frequency(found.second)};
}

}  // namespace flyball::classical
