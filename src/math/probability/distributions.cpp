#include <flyball/math/probability/distributions.hpp>

#include <cmath>
#include <numbers>

#include "core/constants.hpp"

namespace flyball {

namespace {

constexpr double tiny = 1e-290;
constexpr int most_terms = 100'000;

/// A continued fraction b₀ + a₁/(b₁ + a₂/(b₂ + …)) from its terms (modified Lentz).
template <class Terms>
double continued_fraction(double b0, const Terms& terms) {
  double f = b0 == 0.0 ? tiny : b0;
  double c = f;
  double d = 0.0;
  for (int i = 1; i <= most_terms; ++i) {
    const auto [a, b] = terms(i);
    d = b + a * d;
    d = 1.0 / (d == 0.0 ? tiny : d);
    c = b + a / c;
    c = c == 0.0 ? tiny : c;
    f *= c * d;
    if (std::abs(c * d - 1.0) < epsilon) {
      break;
    }
  }
  return f;
}

struct Term {
  double a;
  double b;
};

/// xᵃ e⁻ˣ / Γ(a).
double gamma_front(double a, double x) {
  return std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// Σ xⁿ/(a(a + 1)…(a + n)), times the front: P(a, x) where x < a + 1.
double gamma_series(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n <= most_terms && term > epsilon * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * gamma_front(a, x);
}

/// Q(a, x) where x ≥ a + 1.
double gamma_fraction(double a, double x) {
  const double f = continued_fraction(
      x + 1.0 - a, [&](int i) { return Term{-i * (i - a), x + 2.0 * i + 1.0 - a}; });
  return gamma_front(a, x) / f;
}

}  // namespace

double normal_pdf(double x, double mean, double sigma) noexcept {
  return std::exp(normal_log_pdf(x, mean, sigma));
}

double normal_log_pdf(double x, double mean, double sigma) noexcept {
  if (!(sigma > 0.0)) {
    return nan;
  }
  const double z = (x - mean) / sigma;
  return -0.5 * z * z - std::log(sigma) - 0.5 * std::log(2.0 * std::numbers::pi);
}

double normal_cdf(double x) noexcept {
  return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

double normal_quantile(double p) noexcept {
  return student_quantile(p, infinity);
}

double lower_gamma_ratio(double a, double x) noexcept {
  if (!(a > 0.0 && x >= 0.0)) {
    return nan;
  }
  return x == 0.0        ? 0.0
         : x == infinity ? 1.0
         : x < a + 1.0   ? gamma_series(a, x)
                         : 1.0 - gamma_fraction(a, x);
}

double upper_gamma_ratio(double a, double x) noexcept {
  if (!(a > 0.0 && x >= 0.0)) {
    return nan;
  }
  return x == 0.0        ? 1.0
         : x == infinity ? 0.0
         : x < a + 1.0   ? 1.0 - gamma_series(a, x)
                         : gamma_fraction(a, x);
}

double beta_ratio(double a, double b, double x) noexcept {
  if (!(a > 0.0 && b > 0.0 && x >= 0.0 && x <= 1.0)) {
    return nan;
  }
  if (x == 0.0 || x == 1.0) {
    return x;
  }
  if (x > (a + 1.0) / (a + b + 2.0)) {  // The fraction converges fast below.
    return 1.0 - beta_ratio(b, a, 1.0 - x);
  }
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x)) /
                       a;
  const double f = continued_fraction(1.0, [&](int i) {
    const double m = i / 2;  // NOLINT(bugprone-integer-division): terms come in pairs
    const double numerator = i % 2 == 0
                                 ? m * (b - m) / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
                                 : -(a + m) * (a + b + m) / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
    return Term{numerator * x, 1.0};
  });
  return front / f;
}

double chi_squared_tail(double x, double freedom) noexcept {
  return upper_gamma_ratio(0.5 * freedom, 0.5 * x);
}

double chi_squared_quantile(double p, double freedom) noexcept {
  if (!(p >= 0.0 && p <= 1.0 && freedom > 0.0)) {
    return nan;
  }
  if (p == 0.0 || p == 1.0) {
    return p == 0.0 ? 0.0 : infinity;
  }
  // The smaller of the two tails, which keeps its relative accuracy.
  const auto below = [&](double x) {
    return p < 0.5 ? lower_gamma_ratio(0.5 * freedom, 0.5 * x) < p
                   : chi_squared_tail(x, freedom) > 1.0 - p;
  };
  double high = freedom;
  while (below(high) && high < 1e300) {
    high *= 2.0;
  }
  double low = 0.5 * high;
  while (!below(low) && low > 1e-300) {
    high = low;
    low *= 0.5;
  }
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) {
      break;
    }
    (below(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double f_tail(double f, double numerator, double denominator) noexcept {
  if (!(f >= 0.0)) {
    return nan;
  }
  const double x = f == infinity ? 0.0 : denominator / (denominator + numerator * f);
  return beta_ratio(0.5 * denominator, 0.5 * numerator, x);
}

double student_cdf(double t, double freedom) noexcept {
  if (freedom == infinity) {
    return normal_cdf(t);
  }
  if (freedom > 1e6) {  // Γ functions would cancel; the next term is of the size 1/freedom².
    return normal_cdf(t * (1.0 - (1.0 + t * t) / (4.0 * freedom)));
  }
  if (std::abs(t) < 1.0) {  // near one half, where the other form cancels
    const double half = 0.5 * beta_ratio(0.5, 0.5 * freedom, t * t / (freedom + t * t));
    return t > 0.0 ? 0.5 + half : 0.5 - half;
  }
  const double tail = 0.5 * beta_ratio(0.5 * freedom, 0.5, freedom / (freedom + t * t));
  return t > 0.0 ? 1.0 - tail : tail;
}

double student_quantile(double p, double freedom) noexcept {
  if (!(p >= 0.0 && p <= 1.0 && freedom > 0.0)) {
    return nan;
  }
  if (p == 0.0 || p == 1.0) {
    return p == 0.0 ? -infinity : infinity;
  }
  if (p > 0.5) {
    return -student_quantile(1.0 - p, freedom);
  }
  // The lower tail, which keeps its relative accuracy, is bracketed and bisected.
  double low = -1.0;
  while (student_cdf(low, freedom) > p && low > -1e300) {
    low *= 2.0;
  }
  double high = low == -1.0 ? 0.0 : 0.5 * low;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) {
      break;
    }
    (student_cdf(middle, freedom) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace flyball
