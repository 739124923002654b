#include <flyball/control/margins.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "control/sampled_loop.hpp"
#include "math/dense.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::SampledLoop;
constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Point {
  double theta;
  Complex L;
};

// A root of f between a and b, where f changes sign, to the last bits: bisection with secant steps.
template <class F>
double find_root(const F& f, double a, double b, double f_a, double f_b) {
  for (int i = 0; i < 200 && std::abs(b - a) > 4e-16 * std::max(std::abs(a), std::abs(b)); ++i) {
    const double secant = b - f_b * (b - a) / (f_b - f_a);
    const double middle = 0.5 * (a + b);
    // Each third step halves, so that the bracket cannot stay long at one end.
    const bool inside = secant > std::min(a, b) && secant < std::max(a, b);
    const double x = inside && i % 3 != 2 ? secant : middle;
    const double f_x = f(x);
    if (f_x == 0.0) {
      return x;
    }
    if ((f_x > 0.0) == (f_a > 0.0)) {
      a = x;
      f_a = f_x;
    } else {
      b = x;
      f_b = f_x;
    }
  }
  return std::abs(f_a) < std::abs(f_b) ? a : b;
}

// The place of the smallest f in [a, b], by golden sections.
template <class F>
double find_minimum(const F& f, double a, double b) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double c = b - ratio * (b - a);
  double d = a + ratio * (b - a);
  double f_c = f(c);
  double f_d = f(d);
  for (int i = 0; i < 60; ++i) {
    if (f_c < f_d) {
      b = d;
      d = c;
      f_d = f_c;
      c = b - ratio * (b - a);
      f_c = f(c);
    } else {
      a = c;
      c = d;
      f_c = f_d;
      d = a + ratio * (b - a);
      f_d = f(d);
    }
  }
  return 0.5 * (a + b);
}

double log_gain(const Complex& L) {
  return std::log(std::abs(L));
}

// Frequencies at which L is looked at first: all decades, every turn of the delay's phase, and the
// neighbourhood of each pole.
std::vector<double> first_grid(const SampledLoop& loop) {
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
  const auto around = [&](const Eigen::MatrixXd& M) {
    if (M.rows() == 0) {
      return;
    }
    for (const Complex& pole : detail::eigenvalues_of(M)) {
      const double angle = std::abs(std::arg(pole));
      const double width = std::abs(std::log(std::max(std::abs(pole), 1e-3)));
      for (int k = -4; k <= 3; ++k) {
        const double offset = std::max(width, 1e-9) * std::exp2(k);
        grid.push_back(angle + offset);
        grid.push_back(angle - offset);
      }
    }
  };
  around(loop.A());
  around(loop.A_c());
  around(loop.closed(1.0));
  std::erase_if(grid, [](double theta) { return !(theta > 1e-9 && theta <= pi); });
  std::sort(grid.begin(), grid.end());
  grid.erase(
      std::unique(grid.begin(), grid.end(), [](double a, double b) { return b - a < 1e-13 * b; }),
      grid.end());
  return grid;
}

// L on a grid so fine that between two points neither gain nor phase nor 1 + L turns far.
std::vector<Point> sample(const SampledLoop& loop) {
  constexpr double turn = 0.15;
  constexpr std::size_t most_points = 60000;
  std::vector<Point> points;
  std::vector<Point> pending;
  const std::vector<double> grid = first_grid(loop);
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
      if (coarse && to.theta - from.theta > 1e-12 * to.theta && points.size() < most_points) {
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
      found.push_back(find_root(at, a, b, f_a, f_b));
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
      const double lowest = find_minimum([&](double theta) { return sign * at(theta); },
                                         points[i - 1].theta, points[i + 1].theta);
      const double value = at(lowest);
      if (sign * value < 0.0) {
        add(points[i - 1].theta, lowest, a, value);
        add(lowest, points[i + 1].theta, value, c);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

Crossover crossover(double theta, const Complex& L, double period) {
  return {theta / period, std::abs(L), std::arg(L) * 180.0 / pi};
}

// The lag in (0, 2π] that turns L into -1 when |L| = 1.
double lag_to_minus_one(const Complex& L) {
  const double lag = std::remainder(std::arg(L) - pi, 2.0 * pi);
  return lag > 0.0 ? lag : lag + 2.0 * pi;
}

// Where |L| = 1 near a frequency, for a loop that differs a little.
std::optional<double> follow_crossover(const SampledLoop& loop, double theta) {
  const auto at = [&](double t) { return log_gain(loop.response(t)); };
  const double f_0 = at(theta);
  for (double reach = 1e-3; reach < 0.5; reach *= 2.0) {
    for (const double other : {theta * (1.0 + reach), theta * (1.0 - reach)}) {
      const double end = std::min(other, pi);
      const double f_1 = at(end);
      if ((f_0 > 0.0) != (f_1 > 0.0)) {
        return find_root(at, theta, end, f_0, f_1);
      }
    }
  }
  return std::nullopt;
}

class DelayMargin {
 public:
  explicit DelayMargin(const PlantInputLoop& loop) : loop_(loop), period_(loop.period.si()) {}

  // The smallest further delay at which the closed loop has a pole on the unit circle. A delay of
  // whole periods does not move a crossover θ and costs θ of its lag a period, so the last whole
  // period before the limit is known at once; within it the crossover is followed.
  [[nodiscard]] double find(const std::vector<double>& crossovers,
                            const SampledLoop& sampled) const {
    double margin = infinity;
    for (const double theta : crossovers) {
      const double lag = lag_to_minus_one(sampled.response(theta));
      const double whole = std::floor(lag / theta);
      if (whole * period_ < margin) {
        margin = std::min(margin, within_period(theta, lag, whole));
      }
    }
    return agrees(margin) ? margin : scan(margin);
  }

 private:
  struct Followed {
    double theta;
    double lag;  // Left at `whole` periods and a part of the next; negative beyond the limit.
  };

  [[nodiscard]] std::optional<Followed> follow(const Followed& from, double part,
                                               double whole) const {
    const auto loop = SampledLoop::create(loop_, Time(part));
    if (!loop) {
      return std::nullopt;
    }
    const auto theta = follow_crossover(*loop, from.theta);
    if (!theta) {
      return std::nullopt;
    }
    // Unwrapped: the lag moves little between two parts.
    const double lag = lag_to_minus_one(loop->response(*theta)) - whole * *theta;
    return Followed{*theta, from.lag + std::remainder(lag - from.lag, 2.0 * pi)};
  }

  [[nodiscard]] double within_period(double theta, double lag, double whole) const {
    constexpr int parts = 16;
    Followed before{theta, lag - whole * theta};
    double from = 0.0;
    for (int i = 1; i <= parts; ++i) {
      const double to = period_ * i / parts;
      const auto after = follow(before, to, whole);
      if (!after) {
        return infinity;
      }
      if (after->lag <= 0.0) {
        return whole * period_ + refine(before, from, to, whole);
      }
      before = *after;
      from = to;
    }
    return (whole + 1.0) * period_;
  }

  [[nodiscard]] double refine(Followed before, double from, double to, double whole) const {
    for (int i = 0; i < 60 && to - from > 1e-15 * period_; ++i) {
      const double middle = 0.5 * (from + to);
      const auto there = follow(before, middle, whole);
      if (!there) {
        break;
      }
      if (there->lag > 0.0) {
        before = *there;
        from = middle;
      } else {
        to = middle;
      }
    }
    return 0.5 * (from + to);
  }

  [[nodiscard]] bool stable(double further) const {
    const auto loop = SampledLoop::create(loop_, Time(further));
    return loop && detail::spectral_radius(loop->closed(1.0)) < 1.0;
  }

  // The eigenvalues confirm the limit, and that nothing smaller was missed.
  [[nodiscard]] bool agrees(double margin) const {
    if (margin == infinity) {
      return stable(0.5 * period_) && stable(3.7 * period_);
    }
    // Eigenvalues of a loop with hundreds of stored inputs would cost more than they confirm.
    constexpr double most_stored = 150.0;
    if (margin + loop_.delay.si() > most_stored * period_) {
      return true;
    }
    constexpr double hair = 1e-6;
    bool agreed = stable(margin * (1.0 - hair)) && !stable(margin * (1.0 + hair));
    for (int i = 1; agreed && i < 6; ++i) {
      agreed = stable(margin * i / 6.0);
    }
    return agreed;
  }

  // Where a crossover could not be followed: the first loss of stability on a grid, halved down.
  [[nodiscard]] double scan(double guess) const {
    const double most = std::isfinite(guess) ? 1.01 * guess : 64.0 * period_;
    const double step = period_ / 16.0;
    for (double from = 0.0; from < most; from += step) {
      if (!stable(from + step)) {
        double low = from;
        double high = from + step;
        while (high - low > 1e-14 * high) {
          const double middle = 0.5 * (low + high);
          (stable(middle) ? low : high) = middle;
        }
        return 0.5 * (low + high);
      }
    }
    return guess;
  }

  const PlantInputLoop& loop_;
  double period_;
};

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
      const double place = find_minimum([&](double t) { return -size(loop.response(t)); },
                                        points[i - 1].theta, points[i + 1].theta);
      consider(size(loop.response(place)), place);
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
  if (auto checked = detail::check_loop(loop, "stability_margins"); !checked) {
    return tl::unexpected(checked.error());
  }
  auto sampled = SampledLoop::create(loop);
  if (!sampled) {
    return tl::unexpected(sampled.error());
  }
  const double period = loop.period.si();
  StabilityMargins margins;
  margins.spectral_radius = detail::spectral_radius(sampled->closed(1.0));
  margins.stable = margins.spectral_radius < 1.0;

  const std::vector<Point> points = sample(*sampled);
  const std::vector<double> gain_crossovers = zeros(*sampled, points, log_gain);
  for (const double theta : gain_crossovers) {
    margins.gain_crossovers.push_back(crossover(theta, sampled->response(theta), period));
  }
  // L is real at both ends of the frequencies, too; with an integrator it has no value at zero.
  const Complex at_zero = sampled->response(0.0);
  if (std::isfinite(at_zero.real()) && std::abs(at_zero) < 1e12 && at_zero.real() < 0.0) {
    margins.phase_crossovers.push_back(crossover(0.0, at_zero.real(), period));
  }
  for (const double theta : zeros(*sampled, points, [](const Complex& L) { return L.imag(); })) {
    const Complex L = sampled->response(theta);
    if (L.real() < 0.0 && theta < pi) {
      margins.phase_crossovers.push_back(crossover(theta, L.real(), period));
    }
  }
  const Complex at_nyquist = sampled->response(pi);
  if (at_nyquist.real() < 0.0) {
    margins.phase_crossovers.push_back(crossover(pi, at_nyquist.real(), period));
  }
  if (!margins.stable) {
    return margins;
  }

  set_gain_margins(margins);
  margins.phase_margin = 180.0;
  for (const double theta : gain_crossovers) {
    const double lag = lag_to_minus_one(sampled->response(theta));
    margins.phase_margin =
        std::min(margins.phase_margin, std::min(lag, 2.0 * pi - lag) * 180.0 / pi);
  }
  margins.delay_margin = DelayMargin(loop).find(gain_crossovers, *sampled);
  set_disk_margin(margins, *sampled, points, period);
  return margins;
}

}  // namespace flyball
