#include <flyball/classical/transfer_function.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <flyball/systems/system_error.hpp>

#include "classical/factors.hpp"
#include "classical/polynomial.hpp"
#include "classical/whole_periods.hpp"
#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

VectorXd significant_coefficients(const VectorXd& p) {
  Index first = 0;
  while (first + 1 < p.size() && p(first) == 0.0) {
    ++first;
  }
  return p.tail(p.size() - first);
}

Expected<VectorXcd> roots_of(const VectorXd& p, std::string_view what) {
  if (auto found = detail::roots(detail::polynomial(p))) {
    return *std::move(found);
  }
  return refusal(SystemError::no_convergence, "transfer function", what)
      .got("not found: the iteration for the eigenvalues of the companion matrix did not end");
}

/// Π(s - rᵢ) in 31 digits; an error where a root has no conjugate.
Expected<VectorXd> from_roots(const VectorXcd& roots, std::string_view name) {
  std::vector<bool> done(static_cast<std::size_t>(roots.size()), false);
  detail::Polynomial p = detail::polynomial(VectorXd::Ones(1));
  for (Index i = 0; i < roots.size(); ++i) {
    const Complex r = roots(i);
    if (done[static_cast<std::size_t>(i)]) {
      continue;
    }
    if (!std::isfinite(r.real()) || !std::isfinite(r.imag())) {
      return refusal(ArgumentError::not_finite, "transfer function", name)
          .got("not finite")
          .with("entry", static_cast<double>(i));
    }
    if (r.imag() == 0.0) {
      p = detail::times(p, detail::polynomial(Eigen::Vector2d(1.0, -r.real())));
      continue;
    }
    Index partner = i + 1;
    while (partner < roots.size() &&
           (done[static_cast<std::size_t>(partner)] ||
            std::abs(roots(partner) - std::conj(r)) > 1e-12 * std::abs(r))) {
      ++partner;
    }
    if (partner == roots.size()) {
      return refusal(ArgumentError::malformed, "transfer function", name)
          .got(flyball::detail::format("without the conjugate of {} {} {}j", r.real(),
                                       r.imag() < 0.0 ? "-" : "+", std::abs(r.imag())))
          .expected("in pairs of conjugates: the coefficients are real");
    }
    done[static_cast<std::size_t>(partner)] = true;
    // s² - 2 Re s + Re² + Im², whose sum is formed in 31 digits.
    const auto square = [](double x) {
      return detail::times(detail::polynomial(VectorXd::Constant(1, x)),
                           detail::polynomial(VectorXd::Constant(1, x)));
    };
    const detail::Polynomial last = detail::plus(square(r.real()), 1.0, square(r.imag()));
    const detail::Polynomial factor =
        detail::plus(detail::polynomial(Eigen::Vector3d(1.0, -2.0 * r.real(), 0.0)), 1.0, last);
    p = detail::times(p, factor);
  }
  return VectorXd(p.rounded());
}

/// The one period of two, or the refusal.
Expected<std::optional<Time>> common_period(const TransferFunction& a, const TransferFunction& b,
                                            std::string_view where) {
  const auto& first = a.period();
  const auto& second = b.period();
  const bool same = first.has_value() == second.has_value() &&
                    (!first || std::abs(first->si() - second->si()) <= 1e-12 * first->si());
  if (!same) {
    const auto text = [](const std::optional<Time>& period) {
      return period ? flyball::detail::format("{} s", period->si()) : std::string("continuous");
    };
    return refusal(TransferError::period_mismatch, where, "the second's sample period")
        .got(text(second))
        .expected(text(first) + ", the first's")
        .hint("discretize or resample one of them");
  }
  return first;
}

}  // namespace

ErrorInfo error_info(TransferError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"zero_denominator", "the denominator is zero", ErrorKind::misuse},
      {"improper", "the numerator's degree is above the denominator's", ErrorKind::misuse},
      {"period_mismatch", "the sample periods differ", ErrorKind::misuse},
      {"algebraic_loop", "the loop acts instantly", ErrorKind::no_answer},
      {"at_a_pole", "there is a pole", ErrorKind::no_answer},
      {"delay_in_loop", "a loop with a delay in it is no rational function", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "transfer", rows);
}

Expected<TransferFunction> TransferFunction::create(const VectorXd& num, const VectorXd& den,
                                                    std::optional<Time> period, Time delay) {
  constexpr std::string_view where = "transfer function";
  for (const auto& [polynomial, name] :
       {std::pair<const VectorXd&, const char*>{num, "num"}, {den, "den"}}) {
    if (polynomial.size() == 0) {
      return refusal(ArgumentError::empty, where, name)
          .got("empty")
          .expected("coefficients in descending powers, such as [1, 2] for s + 2");
    }
    FLYBALL_CHECK(check_finite(MatrixXd(polynomial), where, name));
  }
  if (period) {
    FLYBALL_CHECK(check_positive(period->si(), where, "period", "s"));
  }
  FLYBALL_CHECK(Checks(where).not_negative(delay.si(), "delay", "s"));
  VectorXd n = significant_coefficients(num);
  VectorXd d = significant_coefficients(den);
  if (d(0) == 0.0) {
    return refusal(TransferError::zero_denominator, where, "den")
        .got("zero")
        .expected("a polynomial with a coefficient that is not zero");
  }
  if (n.size() > d.size()) {
    return refusal(TransferError::improper, where, "num")
        .got(flyball::detail::format("of degree {}", n.size() - 1))
        .expected(flyball::detail::format("of degree {} at most, as den is", d.size() - 1))
        .hint("a differentiator needs a pole that ends it, such as s/(0.001 s + 1)");
  }
  FLYBALL_CHECK(
      detail::check_whole_periods(delay.si(), period, where, "a discrete transfer function"));
  return TransferFunction(std::move(n), std::move(d), period, delay.si());
}

Expected<TransferFunction> TransferFunction::from_zeros(const VectorXcd& zeros,
                                                        const VectorXcd& poles, double gain,
                                                        std::optional<Time> period, Time delay) {
  FLYBALL_TRY(const VectorXd num, from_roots(zeros, "zeros"));
  FLYBALL_TRY(const VectorXd den, from_roots(poles, "poles"));
  return create(gain * num, den, period, delay).map([&](const TransferFunction& made) {
    return made.with_roots(zeros, poles);
  });
}

TransferFunction TransferFunction::with_roots(const VectorXcd& zeros,
                                              const VectorXcd& poles) const {
  TransferFunction same = *this;
  if (!is_zero() && zeros.size() + 1 == num_.size() && poles.size() + 1 == den_.size()) {
    same.zeros_ = zeros;
    same.poles_ = poles;
  }
  return same;
}

Expected<TransferFunction> TransferFunction::scaled(double gain, Time further) const {
  FLYBALL_CHECK(Checks("transfer function").finite(gain, "the gain"));
  FLYBALL_TRY(const auto made, create(gain * num_, den_, period_, Time(delay_ + further.si())));
  return zeros_ && poles_ ? made.with_roots(*zeros_, *poles_) : made;
}

Expected<VectorXcd> TransferFunction::zeros() const {
  if (zeros_) {
    return *zeros_;
  }
  return is_zero() ? VectorXcd(0) : roots_of(num_, "zeros");
}

Expected<VectorXcd> TransferFunction::poles() const {
  if (poles_) {
    return *poles_;
  }
  FLYBALL_TRY(VectorXcd found, roots_of(den_, "poles"));
  detail::settle_on_border(found, detail::polynomial(den_), period_.has_value());
  return found;
}

Expected<bool> TransferFunction::is_stable() const {
  return poles().map([&](const VectorXcd& p) {
    return (period_ ? is_stable_discrete(p) : is_stable_continuous(p)) &&
           std::none_of(p.begin(), p.end(),
                        [&](const Complex& pole) { return detail::on_axis(pole, period_); });
  });
}

double TransferFunction::dc_gain() const {
  double n = period_ ? num_.sum() : num_(num_.size() - 1);
  double d = period_ ? den_.sum() : den_(den_.size() - 1);
  if (!period_) {
    // s = 0: what both lack at the end cancels.
    Index back = 1;
    while (n == 0.0 && d == 0.0 && back < std::min(num_.size(), den_.size())) {
      n = num_(num_.size() - 1 - back);
      d = den_(den_.size() - 1 - back);
      ++back;
    }
  } else {
    // z = 1, in 31 digits; sums that are rounding of their terms are zero, and both cancel.
    VectorXd top = num_;
    VectorXd bottom = den_;
    const auto vanishes = [](const VectorXd& p) {
      return std::abs(detail::polynomial(p).hi.sum()) <=
             1e-15 * static_cast<double>(p.size()) * p.cwiseAbs().sum();
    };
    while (vanishes(top) && vanishes(bottom) && top.size() > 1 && bottom.size() > 1) {
      for (VectorXd* p : {&top, &bottom}) {  // divided by z - 1
        for (Index i = 1; i < p->size(); ++i) {
          (*p)(i) += (*p)(i - 1);
        }
        *p = p->head(p->size() - 1).eval();
      }
    }
    n = vanishes(top) ? 0.0 : top.sum();
    d = vanishes(bottom) ? 0.0 : bottom.sum();
  }
  return d == 0.0 && n != 0.0 ? std::copysign(infinity, n) : n / d;
}

Expected<Complex> TransferFunction::at(Complex s) const {
  constexpr std::string_view where = "transfer function";
  FLYBALL_CHECK(Checks(where).finite(s.real(), "the point").finite(s.imag(), "the point"));
  const Complex d = detail::value(den_, s);
  if (d == 0.0) {
    return refusal(TransferError::at_a_pole, where, "the point")
        .got("a pole")
        .with("point", std::vector<double>{s.real(), s.imag()});
  }
  const Complex late = period_
                           ? std::pow(s, -static_cast<double>(detail::periods_in(delay_, period_)))
                           : std::exp(-s * delay_);
  return detail::value(num_, s) / d * (delay_ > 0.0 ? late : Complex(1.0));
}

Complex TransferFunction::response(double frequency) const {
  const Complex point =
      period_ ? std::polar(1.0, frequency * period_->si()) : Complex(0.0, frequency);
  // Divided by the higher powers first where s is large, so that nothing overflows.
  Complex n = 0.0;
  Complex d = 0.0;
  if (std::abs(point) <= 1.0) {
    n = detail::value(num_, point);
    d = detail::value(den_, point);
  } else {
    const Complex back = 1.0 / point;
    n = detail::value(num_.reverse(), back);
    d = detail::value(den_.reverse(), back) *
        std::pow(point, static_cast<double>(relative_degree()));
  }
  return n / d * (delay_ > 0.0 ? std::polar(1.0, -frequency * delay_) : Complex(1.0));
}

ContinuousSystem<> TransferFunction::to_state_space() const {
  const Index n = order();
  ContinuousSystem<> s{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), MatrixXd::Zero(1, n),
                       MatrixXd::Zero(1, 1)};
  VectorXd top = VectorXd::Zero(n + 1);
  top.tail(num_.size()) = num_;
  s.D(0, 0) = top(0) / den_(0);
  if (n == 0) {
    return s;
  }
  // States in units of 2^{unit k}: the companion's entries are then those of polynomials with roots
  // about one.
  const int unit = detail::unit_of(den_);
  for (Index k = 0; k < n; ++k) {
    const int power = -unit * static_cast<int>(k);
    s.A(0, k) = -std::ldexp(den_(k + 1) / den_(0), power);
    s.C(0, k) = std::ldexp((top(k + 1) - s.D(0, 0) * den_(k + 1)) / den_(0), power);
    if (k > 0) {
      s.A(k, k - 1) = std::ldexp(1.0, unit);
    }
  }
  s.B(0, 0) = 1.0;
  return s;
}

Expected<TransferFunction> series(const TransferFunction& first, const TransferFunction& second) {
  FLYBALL_TRY(const auto period, common_period(first, second, "series"));
  const auto multiply = [](const VectorXd& a, const VectorXd& b) {
    return VectorXd(detail::times(detail::polynomial(a), detail::polynomial(b)).rounded());
  };
  FLYBALL_TRY(const auto product,
              TransferFunction::create(multiply(first.num(), second.num()),
                                       multiply(first.den(), second.den()), period,
                                       Time(first.delay() + second.delay())));
  if (!first.knows_roots() || !second.knows_roots()) {
    return product;
  }
  FLYBALL_TRY(const VectorXcd first_zeros, first.zeros());
  FLYBALL_TRY(const VectorXcd first_poles, first.poles());
  FLYBALL_TRY(const VectorXcd second_zeros, second.zeros());
  FLYBALL_TRY(const VectorXcd second_poles, second.poles());
  const auto both = [](const VectorXcd& a, const VectorXcd& b) {
    VectorXcd all(a.size() + b.size());
    all << a, b;
    return all;
  };
  return product.with_roots(both(first_zeros, second_zeros), both(first_poles, second_poles));
}

Expected<TransferFunction> parallel(const TransferFunction& first, const TransferFunction& second) {
  FLYBALL_TRY(const auto period, common_period(first, second, "parallel"));
  if (first.delay() != second.delay() && !first.is_zero() && !second.is_zero()) {
    return refusal(TransferError::delay_in_loop, "parallel", "the second's delay")
        .got(flyball::detail::format("{} s", second.delay()))
        .expected(flyball::detail::format(
            "{} s, the first's: the sum of others is no rational function", first.delay()));
  }
  using detail::polynomial;
  using detail::times;
  const VectorXd num = detail::plus(times(polynomial(first.num()), polynomial(second.den())), 1.0,
                                    times(polynomial(second.num()), polynomial(first.den())))
                           .rounded();
  const VectorXd den = times(polynomial(first.den()), polynomial(second.den())).rounded();
  return TransferFunction::create(num, den, period,
                                  Time(first.is_zero() ? second.delay() : first.delay()));
}

Expected<TransferFunction> feedback(const TransferFunction& forward, const TransferFunction& back,
                                    bool negative) {
  constexpr std::string_view where = "feedback";
  FLYBALL_TRY(const auto period, common_period(forward, back, where));
  if (forward.delay() + back.delay() > 0.0) {
    return refusal(TransferError::delay_in_loop, where, "the loop's delay")
        .got(flyball::detail::format("{} s", forward.delay() + back.delay()))
        .expected("zero, or a rational approximation of it (`pade`)")
        .hint("exact it is as a DelaySystem, of an expression feedback(G, H)");
  }
  using detail::polynomial;
  using detail::times;
  const VectorXd num = times(polynomial(forward.num()), polynomial(back.den())).rounded();
  const VectorXd den =
      detail::plus(times(polynomial(forward.den()), polynomial(back.den())), negative ? 1.0 : -1.0,
                   times(polynomial(forward.num()), polynomial(back.num())))
          .rounded();
  const Index order = forward.order() + back.order();
  const double cancelled = std::abs(forward.den()(0) * back.den()(0));
  if (significant_coefficients(den).size() < order + 1 || std::abs(den(0)) <= 4e-16 * cancelled) {
    return refusal(TransferError::algebraic_loop, where, negative ? "1 + G1 G2" : "1 - G1 G2")
        .got("zero at infinite frequency")
        .expected("invertible")
        .hint("give one of the paths dynamics: no loop acts instantly");
  }
  return TransferFunction::create(num, den, period);
}

Expected<TransferFunction> unity_feedback(const TransferFunction& forward, bool negative) {
  FLYBALL_TRY(const auto one,
              TransferFunction::create(VectorXd::Ones(1), VectorXd::Ones(1), forward.period()));
  return feedback(forward, one, negative);
}

Expected<TransferFunction> pade(Time delay, int order) {
  constexpr std::string_view where = "pade";
  FLYBALL_CHECK(Checks(where).not_negative(delay.si(), "delay", "s"));
  if (order < 0 || order > 20) {
    return refusal(ArgumentError::out_of_range, where, "order")
        .got(std::to_string(order))
        .expected("from 0 to 20");
  }
  if (delay.si() == 0.0 || order == 0) {
    return TransferFunction::create(VectorXd::Ones(1), VectorXd::Ones(1));
  }
  // cₖ = (2n - k)! n! / ((2n)! k! (n - k)!) Tᵏ, of which the numerator takes the sign (-1)ᵏ.
  VectorXd num(order + 1);
  VectorXd den(order + 1);
  double c = 1.0;
  for (int k = 0; k <= order; ++k) {
    den(order - k) = c;
    num(order - k) = k % 2 == 0 ? c : -c;
    c *= delay.si() * static_cast<double>(order - k) /
         (static_cast<double>(2 * order - k) * static_cast<double>(k + 1));
  }
  return TransferFunction::create(num, den);
}

}  // namespace flyball::classical
