#include <flyball/classical/steady_state.hpp>

#include <cmath>
#include <limits>
#include <utility>

#include <flyball/classical/loop_margins.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/polynomial.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

/// (s - rest)^excess times a function that is `value` there.
struct AtRest {
  int excess = 0;
  double value = 0.0;
};

/// How often a polynomial is zero at s = 0, or z = 1, and what is left there.
std::pair<int, double> at_rest(VectorXd p, bool discrete) {
  int times = 0;
  const auto vanishes = [&] {
    return discrete
               ? std::abs(p.sum()) <= 1e-15 * static_cast<double>(p.size()) * p.cwiseAbs().sum()
               : p(p.size() - 1) == 0.0;
  };
  while (p.size() > 1 && vanishes()) {
    ++times;
    if (discrete) {
      for (Index i = 1; i < p.size(); ++i) {
        p(i) += p(i - 1);
      }
    }
    p = VectorXd(p.head(p.size() - 1));
  }
  return {times, discrete ? p.sum() : p(p.size() - 1)};
}

AtRest limit_of(const TransferFunction& G) {
  if (G.is_zero()) {
    return {std::numeric_limits<int>::max() / 2, 0.0};
  }
  const bool discrete = G.period().has_value();
  const auto [above, n] = at_rest(G.num(), discrete);
  const auto [below, d] = at_rest(G.den(), discrete);
  return {above - below, n / d};
}

}  // namespace

Expected<double> initial_value(const TransferFunction& transform) {
  if (transform.is_zero() || transform.delay() > 0.0) {
    return 0.0;
  }
  const Index degree = transform.relative_degree();
  if (transform.period()) {
    return degree > 0 ? 0.0 : transform.num()(0) / transform.den()(0);
  }
  if (degree == 0) {
    return refusal(TransferError::improper, "initial_value", "the transform")
        .got("a number at infinity: the signal begins with an impulse")
        .expected("of a higher degree below than above");
  }
  return degree > 1 ? 0.0 : transform.num()(0) / transform.den()(0);
}

Expected<double> final_value(const TransferFunction& transform) {
  constexpr std::string_view where = "final_value";
  if (transform.is_zero()) {
    return 0.0;
  }
  const bool discrete = transform.period().has_value();
  const AtRest rest = limit_of(transform);
  FLYBALL_TRY(const VectorXcd poles, transform.poles());
  const auto refused = [&](Complex pole) {
    return refusal(SystemError::not_stable, where, "the signal")
        .got("without a limit")
        .expected(discrete ? "the transform of a signal whose poles but one at z = 1 lie within "
                             "the unit circle"
                           : "the transform of a signal whose poles but one at s = 0 lie left of "
                             "the imaginary axis")
        .with("pole", std::vector<double>{pole.real(), pole.imag()});
  };
  if (rest.excess < -1) {
    return refused(discrete ? 1.0 : 0.0);
  }
  // Poles at rest are counted by the coefficients, not by their roots' digits.
  const int at_rest_poles = at_rest(transform.den(), discrete).first;
  int near = 0;
  for (const Complex& pole : poles) {
    const bool here = discrete ? std::abs(pole - 1.0) <= 1e-5 : pole == 0.0;
    if (here && near < at_rest_poles) {
      ++near;
      continue;
    }
    if (discrete ? std::abs(pole) >= 1.0 : pole.real() >= 0.0) {
      return refused(pole);
    }
  }
  return rest.excess == -1 ? rest.value : 0.0;
}

Expected<SteadyStateError> steady_state_error(const TransferFunction& loop) {
  SteadyStateError found;
  FLYBALL_TRY(const auto margins, loop_margins(loop));
  found.stable = margins.stable;
  const AtRest rest = limit_of(loop);
  found.type = loop.is_zero() ? 0 : -rest.excess;
  const double T = loop.period() ? loop.period()->si() : 1.0;
  const auto constant = [&](int power) {
    const int excess = rest.excess + power;
    return excess > 0   ? 0.0
           : excess < 0 ? std::copysign(infinity, rest.value)
                        : rest.value / std::pow(T, power);
  };
  found.position_constant = constant(0);
  found.velocity_constant = constant(1);
  found.acceleration_constant = constant(2);
  if (found.stable) {
    found.step = 1.0 / (1.0 + found.position_constant);
    found.ramp = found.velocity_constant == 0.0 ? infinity : 1.0 / found.velocity_constant;
    found.parabola =
        found.acceleration_constant == 0.0 ? infinity : 1.0 / found.acceleration_constant;
  }
  return found;
}

}  // namespace flyball::classical
