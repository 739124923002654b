#include <flyball/control/margins.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <flyball/math/search/minimum.hpp>
#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "control/delay_margin.hpp"
#include "control/sampled_loop.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::lag_to_minus_one;
using detail::log_gain;
using detail::SampledLoop;
constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Point {
  double theta;
  Complex L;
};

// Frequencies at which L is looked at first: all decades, every turn of the delay's phase, and the
// neighbourhood of each pole.
std::vector<double> first_grid(const SampledLoop& loop, const Eigen::VectorXcd& closed_poles) {
  std::vector<double> grid;
  constexpr int decades = 9;
  constexpr int a_decade = 32;
  for (int i = 0; i <= decades * a_decade; ++i) {
    grid.push_back(pi * std::pow(10.0, -static_cast<double>(i) / a_decade));
  }
  const int turns = 64 + 16 * static_cast<int>(loop.whole_delays());
  for (int i = 1; i < turns; ++i) {
    grid.push_back(pi * i / turns);
  }
  const auto around = [&](const Eigen::VectorXcd& poles) {
    for (const Complex& pole : poles) {
      const double angle = std::abs(std::arg(pole));
      const double width = std::abs(std::log(std::max(std::abs(pole), 1e-3)));
      for (int k = -4; k <= 3; ++k) {
        const double offset = std::max(width, 1e-9) * std::exp2(k);
        grid.push_back(angle + offset);
        grid.push_back(angle - offset);
      }
    }
  };
  around(detail::eigenvalues_of(loop.A()));
  around(detail::eigenvalues_of(loop.A_c()));
  around(closed_poles);
  std::erase_if(grid, [](double theta) { return !(theta > 1e-9 && theta <= pi); });
  std::sort(grid.begin(), grid.end());
  grid.erase(
      std::unique(grid.begin(), grid.end(), [](double a, double b) { return b - a < 1e-13 * b; }),
      grid.end());
  return grid;
}

// L on a grid so fine that between two points neither gain nor phase nor 1 + L turns far. Each pole
// and zero of it turns L through a few hundred points, each period of delay through forty: where
// more are needed L is rounding, and nothing is answered.
std::optional<std::vector<Point>> sample(const SampledLoop& loop,
                                         const Eigen::VectorXcd& closed_poles) {
  constexpr double turn = 0.15;
  constexpr double to_start_with = 10000.0;
  constexpr double a_state = 500.0;
  constexpr double a_period = 64.0;
  const auto most_points =
      static_cast<std::size_t>(to_start_with + a_period * loop.whole_delays() +
                               a_state * static_cast<double>(loop.A().rows() + loop.A_c().rows()));
  std::vector<Point> points;
  std::vector<Point> pending;
  const std::vector<double> grid = first_grid(loop, closed_poles);
  points.push_back({grid.front(), loop.response(grid.front())});
  for (std::size_t i = 1; i < grid.size(); ++i) {
    pending.push_back({grid[i], loop.response(grid[i])});
    while (!pending.empty()) {
      const Point& from = points.back();
      const Point& to = pending.back();
      const Complex ratio = to.L / from.L;
      const Complex distance = (1.0 + to.L) / (1.0 + from.L);
      const bool coarse = std::abs(std::arg(ratio)) > turn || std::abs(log_gain(ratio)) > turn ||
                          std::abs(std::arg(distance)) > turn;
      if (coarse && to.theta - from.theta > 1e-12 * to.theta) {
        if (points.size() + pending.size() > most_points) {
          return std::nullopt;
        }
        const double middle = 0.5 * (from.theta + to.theta);
        pending.push_back({middle, loop.response(middle)});
      } else {
        points.push_back(to);
        pending.pop_back();
      }
    }
  }
  return points;
}

// All places where f(L) is zero: changes of sign, and extrema between the points that reach zero.
template <class F>
std::vector<double> zeros(const SampledLoop& loop, const std::vector<Point>& points, const F& f) {
  std::vector<double> found;
  const auto at = [&](double theta) { return f(loop.response(theta)); };
  const auto add = [&](double a, double b, double f_a, double f_b) {
    if ((f_a > 0.0) != (f_b > 0.0)) {
      if (const auto root = find_root(at, a, b, f_a, f_b)) {
        found.push_back(root->x);
      }
    }
  };
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double b = f(points[i].L);
    const double a = f(points[i - 1].L);
    add(points[i - 1].theta, points[i].theta, a, b);
    if (i + 1 == points.size()) {
      break;
    }
    const double c = f(points[i + 1].L);
    const bool dips = (a > 0.0) == (b > 0.0) && (b > 0.0) == (c > 0.0) &&
                      std::abs(b) <= std::abs(a) && std::abs(b) <= std::abs(c);
    // Between points the gain and the phase move by at most the grid's turn.
    if (dips && std::abs(b) < 0.2 * std::max(1.0, std::abs(points[i].L))) {
      const double sign = b > 0.0 ? 1.0 : -1.0;
      const auto lowest = find_minimum([&](double theta) { return sign * at(theta); },
                                       points[i - 1].theta, points[i + 1].theta);
      if (lowest && lowest->value < 0.0) {
        const double value = sign * lowest->value;
        add(points[i - 1].theta, lowest->x, a, value);
        add(lowest->x, points[i + 1].theta, value, c);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

Crossover crossover(double theta, const Complex& L, double period) {
  return {theta / period, std::abs(L), std::arg(L) * 180.0 / pi};
}

void set_gain_margins(StabilityMargins& margins) {
  margins.gain_margin_up = infinity;
  margins.gain_margin_down = 0.0;
  for (const Crossover& c : margins.phase_crossovers) {
    const double factor = 1.0 / c.gain;
    if (factor > 1.0) {
      margins.gain_margin_up = std::min(margins.gain_margin_up, factor);
    } else {
      margins.gain_margin_down = std::max(margins.gain_margin_down, factor);
    }
  }
}

void set_disk_margin(StabilityMargins& margins, const SampledLoop& loop,
                     const std::vector<Point>& points, double period) {
  // |S - T| = |1 - L|/|1 + L|
  const auto size = [](const Complex& L) { return std::abs(1.0 - L) / std::abs(1.0 + L); };
  double peak = 0.0;
  double theta = 0.0;
  const auto consider = [&](double value, double at) {
    if (value > peak) {
      peak = value;
      theta = at;
    }
  };
  double highest = 0.0;
  for (const Point& point : points) {
    highest = std::max(highest, size(point.L));
    consider(size(point.L), point.theta);
  }
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const double here = size(points[i].L);
    // The grid turns 1 + L by little, so a maximum between points is not much above them.
    if (here >= size(points[i - 1].L) && here >= size(points[i + 1].L) && here > 0.8 * highest) {
      if (const auto top = find_minimum([&](double t) { return -size(loop.response(t)); },
                                        points[i - 1].theta, points[i + 1].theta)) {
        consider(-top->value, top->x);
      }
    }
  }
  const double alpha = 2.0 / peak;
  margins.disk_margin = alpha;
  margins.disk_gain_up = alpha < 2.0 ? (2.0 + alpha) / (2.0 - alpha) : infinity;
  margins.disk_gain_down = (2.0 - alpha) / (2.0 + alpha);
  margins.disk_phase = 2.0 * std::atan(0.5 * alpha) * 180.0 / pi;
  margins.disk_frequency = theta / period;
}

}  // namespace

Expected<StabilityMargins> stability_margins(const PlantInputLoop& loop) {
  FLYBALL_CHECK(detail::check_loop(loop, "stability_margins"));
  FLYBALL_TRY(auto sampled, SampledLoop::create(loop));
  const double period = loop.period.si();
  StabilityMargins margins;
  const Eigen::VectorXcd closed_poles = detail::eigenvalues_of(sampled.closed(1.0));
  margins.spectral_radius = closed_poles.size() == 0 ? 0.0 : closed_poles.cwiseAbs().maxCoeff();
  margins.stable = margins.spectral_radius < 1.0;

  const auto sampled_points = sample(sampled, closed_poles);
  if (!sampled_points) {
    return refusal(SystemError::no_convergence, "stability_margins", "the loop's response")
        .got("rounding: it turns between any two frequencies")
        .hint(
            "measure states and outputs in units in which the entries of A, B, C and K are near "
            "one");
  }
  const std::vector<Point>& points = *sampled_points;
  const std::vector<double> gain_crossovers = zeros(sampled, points, log_gain);
  for (const double theta : gain_crossovers) {
    margins.gain_crossovers.push_back(crossover(theta, sampled.response(theta), period));
  }
  // L is real at both ends of the frequencies, too; with an integrator it has no value at zero.
  const Complex at_zero = sampled.response(0.0);
  if (std::isfinite(at_zero.real()) && std::abs(at_zero) < 1e12 && at_zero.real() < 0.0) {
    margins.phase_crossovers.push_back(crossover(0.0, at_zero.real(), period));
  }
  for (const double theta : zeros(sampled, points, [](const Complex& L) { return L.imag(); })) {
    const Complex L = sampled.response(theta);
    if (L.real() < 0.0 && theta < pi) {
      margins.phase_crossovers.push_back(crossover(theta, L.real(), period));
    }
  }
  const Complex at_nyquist = sampled.response(pi);
  if (at_nyquist.real() < 0.0) {
    margins.phase_crossovers.push_back(crossover(pi, at_nyquist.real(), period));
  }
  if (!margins.stable) {
    return margins;
  }

  set_gain_margins(margins);
  margins.phase_margin = 180.0;
  for (const double theta : gain_crossovers) {
    const double lag = lag_to_minus_one(sampled.response(theta));
    margins.phase_margin =
        std::min(margins.phase_margin, std::min(lag, 2.0 * pi - lag) * 180.0 / pi);
  }
  margins.delay_margin = detail::delay_margin(loop, gain_crossovers, sampled);
  set_disk_margin(margins, sampled, points, period);
  return margins;
}

}  // namespace flyball
