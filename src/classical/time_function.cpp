#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <flyball/classical/partial_fractions.hpp>

#include "classical/polynomial.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

double TimeFunction::value(double t) const {
  const double since = t - delay;
  if (since < 0.0) {
    return 0.0;
  }
  double sum = 0.0;
  for (const TimeTerm& term : terms) {
    double power = 1.0;
    for (int k = 1; k <= term.power; ++k) {
      power *= since / k;
    }
    sum += power * std::exp(term.rate * since) *
           (term.cosine * std::cos(term.frequency * since) +
            term.sine * std::sin(term.frequency * since));
  }
  return sum;
}

std::string TimeFunction::text(int digits) const {
  const std::string t =
      delay > 0.0 ? "(t - " + text::number(delay, digits) + ")" : std::string("t");
  std::string written;
  const auto add = [&](double factor, const std::string& rest) {
    if (factor == 0.0) {
      return;
    }
    written += written.empty() ? (factor < 0.0 ? "-" : "") : factor < 0.0 ? " - " : " + ";
    const std::string size = text::number(std::abs(factor), digits);
    written += rest.empty() ? size : size == "1" ? rest : size + " " + rest;
  };
  std::string mark;
  for (const double impulse : impulses) {
    add(impulse, "δ" + mark + (delay > 0.0 ? t : "(t)"));
    mark += "'";
  }
  for (const TimeTerm& term : terms) {
    double factorial = 1.0;
    for (int k = 2; k <= term.power; ++k) {
      factorial *= k;
    }
    std::string shape;
    const auto times = [&](const std::string& part) {
      shape += (shape.empty() || part.empty() ? "" : " ") + part;
    };
    if (term.power > 0) {
      times(term.power == 1 ? t : flyball::detail::format("{}^{}", t, term.power));
    }
    const auto argument = [&](double rate) {
      const std::string size = text::number(std::abs(rate), digits);
      return (rate < 0.0 ? "-" : "") + (size == "1" ? t : size + " " + t);
    };
    if (term.rate != 0.0) {
      times("e^(" + argument(term.rate) + ")");
    }
    if (term.frequency == 0.0) {
      add(term.cosine / factorial, shape);
      continue;
    }
    const std::string before = shape;
    times("cos(" + argument(term.frequency) + ")");
    add(term.cosine / factorial, shape);
    shape = before;
    times("sin(" + argument(term.frequency) + ")");
    add(term.sine / factorial, shape);
  }
  if (written.empty()) {
    return "0";
  }
  return delay > 0.0 ? written + " from t = " + text::number(delay, digits) + " on" : written;
}

TimeFunction function_of_time(const PartialFractions& fractions, double delay) {
  TimeFunction f;
  f.impulses = fractions.polynomial.reverse();
  f.delay = delay;
  for (const PartialFraction& fraction : fractions.fractions) {
    const Complex p = fraction.pole;
    if (p.imag() < 0.0) {
      continue;  // with its conjugate
    }
    for (Index k = 0; k < fraction.residues.size(); ++k) {
      // r e^{pt} and its conjugate: 2 e^{at} (Re r cos ωt - Im r sin ωt).
      const Complex r = fraction.residues(k);
      if (r == 0.0) {
        continue;
      }
      const double both = p.imag() > 0.0 ? 2.0 : 1.0;
      f.terms.push_back({static_cast<int>(k), p.real(), p.imag(), both * r.real(),
                         p.imag() > 0.0 ? -both * r.imag() : 0.0});
    }
  }
  return f;
}

namespace {

Expected<void> check_continuous(const std::optional<Time>& period) {
  if (!period) {
    return {};
  }
  return refusal(TransferError::period_mismatch, "inverse_laplace", "the transform")
      .got(flyball::detail::format("of z, with a period of {} s", period->si()))
      .expected("of s");
}

}  // namespace

Expected<TimeFunction> inverse_laplace(const TransferFunction& transform) {
  FLYBALL_CHECK(check_continuous(transform.period()));
  FLYBALL_TRY(const auto fractions, partial_fractions(transform.num(), transform.den()));
  return function_of_time(fractions, transform.delay());
}

Expected<TimeFunction> inverse_laplace(const ZeroPoleGain& transform) {
  FLYBALL_CHECK(check_continuous(transform.period()));
  FLYBALL_TRY(const auto fractions, partial_fractions(transform));
  return function_of_time(fractions, transform.delay());
}

Expected<TimeFunction> step_in_closed_form(const TransferFunction& transfer) {
  FLYBALL_CHECK(check_continuous(transfer.period()));
  VectorXd den = VectorXd::Zero(transfer.den().size() + 1);
  den.head(transfer.den().size()) = transfer.den();
  FLYBALL_TRY(const auto fractions, partial_fractions(transfer.num(), den));
  return function_of_time(fractions, transfer.delay());
}

}  // namespace flyball::classical
