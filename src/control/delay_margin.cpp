#include <algorithm>
#include <cmath>
#include <optional>

#include <flyball/math/search/roots.hpp>

#include "control/delay_margin.hpp"
#include "core/constants.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

// Where |L| = 1 near a frequency, for a loop that differs a little.
std::optional<double> follow_crossover(const SampledLoop& loop, double theta) {
  const auto at = [&](double t) { return log_gain(loop.response(t)); };
  const double f_0 = at(theta);
  for (double reach = 1e-3; reach < 0.5; reach *= 2.0) {
    for (const double other : {theta * (1.0 + reach), theta * (1.0 - reach)}) {
      const double end = std::min(other, pi);
      if (const auto root = find_root(at, theta, end, f_0, at(end))) {
        return root->x;
      }
    }
  }
  return std::nullopt;
}

class DelayMargin {
 public:
  explicit DelayMargin(const PlantInputLoop& loop) : loop_(loop), period_(loop.period.si()) {}

  // A delay of whole periods does not move a crossover θ and costs θ of its lag a period, so the
  // last whole period before the limit is known at once; within it the crossover is followed.
  [[nodiscard]] double find(const std::vector<double>& crossovers,
                            const SampledLoop& sampled) const {
    struct Start {
      double theta, lag, whole;
    };
    std::vector<Start> starts;
    for (const double theta : crossovers) {
      const double lag = lag_to_minus_one(sampled.response(theta));
      if (std::isfinite(lag)) {
        starts.push_back({theta, lag, std::floor(lag / theta)});
      }
    }
    std::sort(starts.begin(), starts.end(),
              [](const Start& a, const Start& b) { return a.whole < b.whole; });
    double margin = infinity;
    for (const Start& start : starts) {
      if (start.whole * period_ < margin) {
        margin = std::min(margin, within_period(start.theta, start.lag, start.whole));
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
    return loop && spectral_radius(loop->closed(1.0)) < 1.0;
  }

  // The eigenvalues confirm the limit, and that nothing smaller was missed.
  [[nodiscard]] bool agrees(double margin) const {
    if (margin == infinity) {
      return stable(0.5 * period_) && stable(3.7 * period_);
    }
    // Eigenvalues of a loop with hundreds of stored inputs would cost more than they confirm.
    constexpr double most_stored = 64.0;
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
    // Further, each step is an eigenvalue problem of as many stored inputs as periods.
    const double most = std::min(1.01 * guess, 32.0 * period_);
    const double step = period_ / 16.0;
    constexpr double most_work = 1e7;  // Of n³ for n states.
    double work = 0.0;
    for (int i = 0; i * step < most && work < most_work && step > 0.0; ++i) {
      const double from = i * step;
      const double stored = (loop_.delay.si() + from) / period_;
      work += std::pow(static_cast<double>(loop_.A.rows() + loop_.A_c.rows()) + stored, 3.0);
      if (!stable(from + step)) {
        double low = from;
        double high = from + step;
        for (int k = 0; k < 60 && high - low > 1e-14 * high; ++k) {
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

}  // namespace

double lag_to_minus_one(const Complex& L) {
  const double lag = std::remainder(std::arg(L) - pi, 2.0 * pi);
  return lag > 0.0 ? lag : lag + 2.0 * pi;
}

double delay_margin(const PlantInputLoop& loop, const std::vector<double>& crossovers,
                    const SampledLoop& sampled) {
  return DelayMargin(loop).find(crossovers, sampled);
}

}  // namespace flyball::detail
