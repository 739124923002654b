#include <flyball/classical/filters/slew_rate_limiter.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/core/signal.hpp>

#include "core/try.hpp"

namespace flyball::classical {

Expected<SlewRateLimiter> SlewRateLimiter::create(const SlewRates& rates, double period,
                                                  double initial) {
  constexpr std::string_view where = "SlewRateLimiter";
  for (const auto& [rate, name] : {std::pair{rates.rising, "rising"}, {rates.falling, "falling"}}) {
    if (!(rate > 0.0)) {
      return refusal(ArgumentError::not_positive, where, name)
          .got(format_number(rate))
          .expected("positive, or infinity for any");
    }
  }
  FLYBALL_CHECK(Checks(where).positive(period, "period", "s").finite(initial, "initial"));
  SlewRateLimiter limiter;
  limiter.up_ = std::min(rates.rising * period, 4.0 * largest_signal);
  limiter.down_ = std::min(rates.falling * period, 4.0 * largest_signal);
  limiter.reset(initial);
  return limiter;
}

double SlewRateLimiter::calculate(double x) noexcept {
  if (is_signal(x)) {
    const double change = x - output_;
    // Reached exactly, not by a rounded sum.
    output_ = change > up_ ? output_ + up_ : change < -down_ ? output_ - down_ : x;
  }
  return output_;
}

void SlewRateLimiter::reset(double x) noexcept {
  output_ = flyball::detail::signal_or_zero(x);
}

}  // namespace flyball::classical
