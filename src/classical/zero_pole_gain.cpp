#include <flyball/classical/zero_pole_gain.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_parts.hpp"
#include "classical/whole_periods.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "systems/balance.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr std::string_view zero_pole_gain_noun = "zero-pole-gain";

/// The roots with each pair's members exact conjugates of each other.
Expected<VectorXcd> paired(const VectorXcd& roots, std::string_view name) {
  VectorXcd pairs = roots;
  std::vector<bool> done(static_cast<std::size_t>(roots.size()), false);
  for (Index i = 0; i < roots.size(); ++i) {
    const Complex r = roots(i);
    if (!std::isfinite(r.real()) || !std::isfinite(r.imag())) {
      return refusal(ArgumentError::not_finite, zero_pole_gain_noun, name)
          .got("not finite")
          .with("entry", static_cast<double>(i));
    }
    if (done[static_cast<std::size_t>(i)] || r.imag() == 0.0) {
      continue;
    }
    Index partner = -1;
    double nearest = 1e-12 * std::abs(r);
    for (Index j = i + 1; j < roots.size(); ++j) {
      const double distance = std::abs(roots(j) - std::conj(r));
      if (!done[static_cast<std::size_t>(j)] && distance <= nearest) {
        nearest = distance;
        partner = j;
      }
    }
    if (partner < 0) {
      return refusal(ArgumentError::malformed, zero_pole_gain_noun, name)
          .got(flyball::detail::format("without the conjugate of {} {} {}j", r.real(),
                                       r.imag() < 0.0 ? "-" : "+", std::abs(r.imag())))
          .expected("in pairs of conjugates: the coefficients are real");
    }
    pairs(partner) = std::conj(r);
    done[static_cast<std::size_t>(partner)] = true;
  }
  return pairs;
}

VectorXcd joined(const VectorXcd& a, const VectorXcd& b) {
  VectorXcd both(a.size() + b.size());
  both << a, b;
  return both;
}

/// Π(s - zᵢ)/Π(s - pⱼ), factors of like size after each other so that none overflows.
Complex quotient_of_factors(const VectorXcd& zeros, const VectorXcd& poles, Complex s) {
  const auto factors = [&](const VectorXcd& roots) {
    std::vector<Complex> differences;
    for (const Complex& root : roots) {
      differences.push_back(s - root);
    }
    std::sort(differences.begin(), differences.end(),
              [](Complex a, Complex b) { return std::abs(a) < std::abs(b); });
    return differences;
  };
  const auto above = factors(zeros);
  const auto below = factors(poles);
  Complex value = 1.0;
  for (std::size_t i = 0; i < std::max(above.size(), below.size()); ++i) {
    if (i < above.size()) {
      value *= above[i];
    }
    if (i < below.size()) {
      value /= below[i];
    }
  }
  return value;
}

Expected<void> check_periods(const ZeroPoleGain& a, const ZeroPoleGain& b, std::string_view where) {
  if (a.period().has_value() == b.period().has_value() &&
      (!a.period() || std::abs(a.period()->si() - b.period()->si()) <= 1e-12 * a.period()->si())) {
    return {};
  }
  return refusal(TransferError::period_mismatch, where, "the second's sample period")
      .got(detail::period_text(b.period()))
      .expected(detail::period_text(a.period()) + ", the first's")
      .hint("discretize or resample one of them");
}

}  // namespace

Expected<ZeroPoleGain> ZeroPoleGain::create(const VectorXcd& zeros, const VectorXcd& poles,
                                            double gain, std::optional<Time> period, Time delay) {
  FLYBALL_TRY(VectorXcd z, paired(zeros, "zeros"));
  FLYBALL_TRY(VectorXcd p, paired(poles, "poles"));
  FLYBALL_CHECK(
      Checks(zero_pole_gain_noun).finite(gain, "gain").not_negative(delay.si(), "delay", "s"));
  if (period) {
    FLYBALL_CHECK(check_positive(period->si(), zero_pole_gain_noun, "period", "s"));
    FLYBALL_CHECK(detail::check_whole_periods(delay.si(), period, zero_pole_gain_noun,
                                              "a discrete transfer function"));
  }
  return ZeroPoleGain(std::move(z), std::move(p), gain, period, delay.si());
}

Expected<ZeroPoleGain> ZeroPoleGain::create(const TransferFunction& transfer) {
  FLYBALL_TRY(const VectorXcd zeros, transfer.zeros());
  FLYBALL_TRY(const VectorXcd poles, transfer.poles());
  return create(zeros, poles, transfer.num()(0) / transfer.den()(0), transfer.period(),
                Time(transfer.delay()));
}

bool ZeroPoleGain::is_stable() const {
  return is_proper() && (period_ ? is_stable_discrete(poles_) : is_stable_continuous(poles_));
}

bool ZeroPoleGain::is_minimum_phase() const {
  return std::none_of(zeros_.begin(), zeros_.end(), [&](const Complex& z) {
    return period_ ? std::abs(z) > 1.0 : z.real() > 0.0;
  });
}

double ZeroPoleGain::dc_gain() const {
  const Complex rest = period_ ? 1.0 : 0.0;
  const auto others = [&](const VectorXcd& roots) {
    std::vector<Complex> kept;
    for (const Complex& root : roots) {
      if (root != rest) {
        kept.push_back(root);
      }
    }
    return VectorXcd(Eigen::Map<const VectorXcd>(kept.data(), static_cast<Index>(kept.size())));
  };
  const VectorXcd z = others(zeros_);
  const VectorXcd p = others(poles_);
  const Index excess = (zeros_.size() - z.size()) - (poles_.size() - p.size());
  const double value = gain_ * quotient_of_factors(z, p, rest).real();
  return gain_ == 0.0 || excess > 0 ? 0.0 : excess < 0 ? std::copysign(infinity, value) : value;
}

Expected<Complex> ZeroPoleGain::at(Complex s) const {
  FLYBALL_CHECK(
      Checks(zero_pole_gain_noun).finite(s.real(), "the point").finite(s.imag(), "the point"));
  if ((poles_.array() == s).any()) {
    return refusal(TransferError::at_a_pole, zero_pole_gain_noun, "the point")
        .got("a pole")
        .with("point", std::vector<double>{s.real(), s.imag()});
  }
  const Complex late = period_
                           ? std::pow(s, -static_cast<double>(detail::periods_in(delay_, period_)))
                           : std::exp(-s * delay_);
  return gain_ * quotient_of_factors(zeros_, poles_, s) * (delay_ > 0.0 ? late : Complex(1.0));
}

Complex ZeroPoleGain::response(double frequency) const {
  const Complex point =
      period_ ? std::polar(1.0, frequency * period_->si()) : Complex(0.0, frequency);
  return gain_ * quotient_of_factors(zeros_, poles_, point) *
         (delay_ > 0.0 ? std::polar(1.0, -frequency * delay_) : Complex(1.0));
}

namespace {

Refusal improper(const ZeroPoleGain& G) {
  return refusal(TransferError::improper, zero_pole_gain_noun, "the number of zeros")
      .got(std::to_string(G.zeros().size()))
      .expected(flyball::detail::format("at most {}, the number of poles", G.poles().size()))
      .hint("a differentiator needs a pole that ends it; `descriptor` realises it as it is");
}

}  // namespace

Expected<TransferFunction> ZeroPoleGain::to_transfer_function() const {
  if (!is_proper()) {
    return improper(*this);
  }
  return TransferFunction::from_zeros(is_zero() ? VectorXcd(0) : zeros_, poles_, gain_, period_,
                                      Time(delay_));
}

Expected<ContinuousSystem<>> ZeroPoleGain::to_state_space() const {
  if (!is_proper()) {
    return improper(*this);
  }
  flyball::detail::ZeroPoleGain zpk;
  if (!is_zero()) {
    zpk.zeros.assign(zeros_.begin(), zeros_.end());
    zpk.poles.assign(poles_.begin(), poles_.end());
  }
  zpk.gain = gain_;
  const auto chain = flyball::detail::series_of_sections(zpk);
  return flyball::detail::scaled_system(chain,
                                        flyball::detail::scaling_of(chain.A, chain.B, chain.C));
}

Expected<ZeroPoleGain> product(const ZeroPoleGain& first, const ZeroPoleGain& second) {
  FLYBALL_CHECK(check_periods(first, second, "product"));
  return ZeroPoleGain::create(joined(first.zeros(), second.zeros()),
                              joined(first.poles(), second.poles()), first.gain() * second.gain(),
                              first.period(), Time(first.delay() + second.delay()));
}

Expected<ZeroPoleGain> quotient(const ZeroPoleGain& first, const ZeroPoleGain& second) {
  constexpr std::string_view where = "quotient";
  FLYBALL_CHECK(check_periods(first, second, where));
  if (second.is_zero()) {
    return refusal(TransferError::zero_denominator, where, "the second").got("zero");
  }
  if (second.delay() > first.delay()) {
    return refusal(ArgumentError::out_of_range, where, "the second's delay")
        .got(flyball::detail::format("{} s", second.delay()))
        .expected(flyball::detail::format("at most {} s, the first's", first.delay()))
        .hint("nothing answers before it is asked");
  }
  return ZeroPoleGain::create(joined(first.zeros(), second.poles()),
                              joined(first.poles(), second.zeros()), first.gain() / second.gain(),
                              first.period(), Time(first.delay() - second.delay()));
}

Expected<ZeroPoleGain> feedback(const ZeroPoleGain& forward, const ZeroPoleGain& back,
                                bool negative) {
  FLYBALL_CHECK(check_periods(forward, back, "feedback"));
  FLYBALL_TRY(const auto G, forward.to_transfer_function());
  FLYBALL_TRY(const auto H, back.to_transfer_function());
  FLYBALL_TRY(const auto loop, feedback(G, H, negative));
  FLYBALL_TRY(const VectorXcd poles, loop.poles());
  return ZeroPoleGain::create(joined(forward.zeros(), back.poles()), poles,
                              loop.num()(0) / loop.den()(0), loop.period());
}

Expected<Cancelled> without_cancellations(const ZeroPoleGain& transfer, double tolerance) {
  constexpr std::string_view where = "without_cancellations";
  FLYBALL_CHECK(check_not_negative(tolerance, where, "tolerance"));
  if (tolerance >= 1.0) {
    return refusal(ArgumentError::out_of_range, where, "tolerance")
        .got(format_number(tolerance))
        .expected("below 1");
  }
  std::vector<Complex> zeros(transfer.zeros().begin(), transfer.zeros().end());
  std::vector<Complex> poles(transfer.poles().begin(), transfer.poles().end());
  std::vector<Cancellation> cancelled;
  bool hides = false;
  const bool discrete = transfer.period().has_value();
  const auto outside = [&](Complex root) {
    return discrete ? std::abs(root) >= 1.0 : root.real() >= 0.0;
  };
  const auto take = [](std::vector<Complex>& roots, Complex root) {
    roots.erase(std::find(roots.begin(), roots.end(), root));
  };
  for (;;) {
    double nearest = infinity;
    std::pair<Complex, Complex> best;
    for (const Complex& z : zeros) {
      for (const Complex& p : poles) {
        // A pair cancels a pair, a real root a real one.
        if (z.imag() < 0.0 || p.imag() < 0.0 || (z.imag() == 0.0) != (p.imag() == 0.0)) {
          continue;
        }
        const double size = std::max(std::abs(z), std::abs(p));
        const double distance = size > 0.0 ? std::abs(z - p) / size : 0.0;
        if (distance < nearest) {
          nearest = distance;
          best = {z, p};
        }
      }
    }
    if (!(nearest <= tolerance)) {
      break;
    }
    const auto [z, p] = best;
    const Cancellation pair{z, p, nearest, outside(p),
                            discrete ? std::abs(z) > 1.0 : z.real() > 0.0};
    hides = hides || pair.unstable || pair.nonminimum_phase;
    cancelled.push_back(pair);
    take(zeros, z);
    take(poles, p);
    if (z.imag() > 0.0) {
      cancelled.push_back(
          {std::conj(z), std::conj(p), nearest, pair.unstable, pair.nonminimum_phase});
      take(zeros, std::conj(z));
      take(poles, std::conj(p));
    }
  }
  const auto vector = [](const std::vector<Complex>& roots) {
    return VectorXcd(Eigen::Map<const VectorXcd>(roots.data(), static_cast<Index>(roots.size())));
  };
  FLYBALL_TRY(auto left, ZeroPoleGain::create(vector(zeros), vector(poles), transfer.gain(),
                                              transfer.period(), Time(transfer.delay())));
  return Cancelled{std::move(left), std::move(cancelled), hides};
}

}  // namespace flyball::classical
