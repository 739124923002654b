#include <flyball/classical/describing_function.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <flyball/core/text.hpp>
#include <flyball/math/search/roots.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Complex = std::complex<double>;

namespace {

constexpr std::array<std::string_view, 5> names{"saturation", "dead-zone", "relay", "hysteresis",
                                                "backlash"};

/// 2/π (asin x + x √(1 - x²)): the share of a saturation at x = width/a.
double share_below(double x) {
  return x >= 1.0 ? 1.0 : 2.0 / pi * (std::asin(x) + x * std::sqrt(1.0 - x * x));
}

std::optional<Complex> gain_of(const Nonlinearity& n, double a) {
  const double x = n.width / a;
  switch (n.kind) {
    case NonlinearityKind::saturation:
      return n.slope * share_below(x);
    case NonlinearityKind::dead_zone:
      return n.slope * (1.0 - share_below(x));
    case NonlinearityKind::relay:
      return 4.0 * n.height / (pi * a);
    case NonlinearityKind::hysteresis:
      if (x > 1.0) {
        return std::nullopt;
      }
      return 4.0 * n.height / (pi * a) * Complex(std::sqrt(1.0 - x * x), -x);
    case NonlinearityKind::backlash:
      break;
  }
  if (x > 1.0) {
    return std::nullopt;
  }
  const double y = 1.0 - 2.0 * x;
  return n.slope *
         Complex(0.5 + (std::asin(y) + y * std::sqrt(1.0 - y * y)) / pi, -4.0 * x * (1.0 - x) / pi);
}

Expected<void> check(const Nonlinearity& n, std::string_view where) {
  Checks checks(where);
  const bool relay = n.kind == NonlinearityKind::relay || n.kind == NonlinearityKind::hysteresis;
  if (n.kind != NonlinearityKind::relay) {
    checks.positive(n.width, "width");
  }
  if (relay) {
    checks.positive(n.height, "height");
  } else {
    checks.positive(n.slope, "slope");
  }
  return checks;
}

bool turns_phase(NonlinearityKind kind) {
  return kind == NonlinearityKind::hysteresis || kind == NonlinearityKind::backlash;
}

/// Amplitudes at which a real N(a) is a given gain.
std::vector<double> amplitudes_of(const Nonlinearity& n, double gain) {
  if (n.kind == NonlinearityKind::relay) {
    return {4.0 * n.height / (pi * gain)};
  }
  if (!(gain > 0.0 && gain < n.slope)) {
    return {};
  }
  // Both are monotone in width/a on (0, 1).
  const auto root = find_root(
      [&](double x) {
        const double share = share_below(x);
        const double value = n.kind == NonlinearityKind::saturation ? share : 1.0 - share;
        return value - gain / n.slope;
      },
      0.0, 1.0, {.absolute_tolerance = 1e-300});
  if (!root || !(root->x > 0.0)) {
    return {};
  }
  return {n.width / root->x};
}

/// The amplitude at which N(a) lags by an angle in (0, π/2).
double amplitude_of_lag(const Nonlinearity& n, double lag) {
  if (n.kind == NonlinearityKind::hysteresis) {
    return n.width / std::sin(lag);
  }
  const auto root = find_root(
      [&](double x) {
        const Complex gain = *gain_of(n, n.width / x);
        return std::atan2(-gain.imag(), gain.real()) - lag;
      },
      0.0, 1.0, -lag, 0.5 * pi - lag, {.absolute_tolerance = 1e-300});
  return root && root->x > 0.0 ? n.width / root->x : 0.0;
}

/// Whether the oscillation returns after a little more of it: Im(∂X/∂a · (∂X/∂ω)*) < 0 for
/// X = 1 + N(a) L(jω).
bool returns(const FrequencyResponse& loop, const Nonlinearity& n, double a, double w) {
  constexpr double part = 1e-5;
  const auto N = [&](double amplitude) { return gain_of(n, amplitude).value_or(Complex(0.0)); };
  const auto L = [&](double frequency) { return loop.at(frequency)(0, 0); };
  const double high = std::min(w * (1.0 + part), loop.highest_frequency());
  const Complex by_a = L(w) * (N(a * (1.0 + part)) - N(a * (1.0 - part)));
  const Complex by_w = N(a) * (L(high) - L(w * (1.0 - part)));
  return (by_a * std::conj(by_w)).imag() < 0.0;
}

}  // namespace

std::string_view to_string(NonlinearityKind kind) {
  return names[static_cast<std::size_t>(kind)];
}

Expected<NonlinearityKind> parse_nonlinearity(std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) {
      return static_cast<NonlinearityKind>(i);
    }
  }
  const std::vector<std::string_view> all(names.begin(), names.end());
  const std::string nearest = nearest_name(name, all);
  return refusal(ArgumentError::unknown_name, "describing function", "nonlinearity")
      .got("\"" + std::string(name) + "\"")
      .expected("one of saturation, dead-zone, relay, hysteresis, backlash")
      .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
}

Expected<std::optional<Complex>> describing_function(const Nonlinearity& nonlinearity,
                                                     double amplitude) {
  constexpr std::string_view where = "describing function";
  FLYBALL_CHECK(check(nonlinearity, where));
  FLYBALL_CHECK(check_positive(amplitude, where, "amplitude"));
  return gain_of(nonlinearity, amplitude);
}

Expected<std::vector<LimitCycle>> limit_cycles(const FrequencyResponse& loop,
                                               const Nonlinearity& nonlinearity) {
  constexpr std::string_view where = "limit cycles";
  FLYBALL_CHECK(check(nonlinearity, where));
  if (loop.inputs() != 1 || loop.outputs() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("of one input and one output");
  }
  FLYBALL_TRY(const auto grid, frequency_grid(loop, {.most_points = 20'000}));
  const Eigen::VectorXd& w = grid.frequency;
  FLYBALL_TRY(const Eigen::MatrixXcd values, loop.sample(w));
  std::vector<LimitCycle> cycles;
  const auto lag = [&](double x) { return std::arg(-loop.at(x)(0, 0)); };
  const auto add = [&](double a, double x) {
    if (std::isfinite(a) && a > 0.0) {
      cycles.push_back({a, x, returns(loop, nonlinearity, a, x)});
    }
  };
  for (Index k = 1; k < w.size(); ++k) {
    const double before = std::arg(-values(0, k - 1));
    const double after = std::arg(-values(0, k));
    if (!turns_phase(nonlinearity.kind)) {
      // -1/N(a) is the negative axis: L crosses it.
      if ((before > 0.0) != (after > 0.0) && std::abs(after - before) < pi) {
        if (const auto root = find_root(lag, w(k - 1), w(k), before, after)) {
          const double gain = 1.0 / std::abs(loop.at(root->x)(0, 0));
          for (const double a : amplitudes_of(nonlinearity, gain)) {
            add(a, root->x);
          }
        }
      }
      continue;
    }
    // N lags by up to a quarter: there L lags that much less than by a half turn.
    const auto excess = [&](double x) {
      const double angle = lag(x);
      if (!(angle > 0.0 && angle < 0.5 * pi)) {
        return std::numeric_limits<double>::quiet_NaN();
      }
      const double a = amplitude_of_lag(nonlinearity, angle);
      const auto gain = a > 0.0 ? gain_of(nonlinearity, a) : std::nullopt;
      return gain ? std::log(std::abs(*gain) * std::abs(loop.at(x)(0, 0)))
                  : std::numeric_limits<double>::quiet_NaN();
    };
    const double f_a = excess(w(k - 1));
    const double f_b = excess(w(k));
    if (std::isfinite(f_a) && std::isfinite(f_b) && (f_a > 0.0) != (f_b > 0.0)) {
      if (const auto root = find_root(excess, w(k - 1), w(k), f_a, f_b)) {
        add(amplitude_of_lag(nonlinearity, lag(root->x)), root->x);
      }
    }
  }
  std::sort(cycles.begin(), cycles.end(),
            [](const LimitCycle& a, const LimitCycle& b) { return a.frequency < b.frequency; });
  return cycles;
}

}  // namespace flyball::classical
