#include <flyball/identification/residual_tests.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/math/probability/distributions.hpp>

namespace flyball::identification {

namespace {

struct Product {
  double sum = 0.0;
  std::size_t pairs = 0;
};

/// Σ r(t) r(t + lag) over the pairs that are there.
Product product_at(std::span<const std::vector<double>> runs, std::size_t lag) {
  Product made;
  for (const std::vector<double>& run : runs) {
    for (std::size_t i = 0; i + lag < run.size(); ++i) {
      if (const double product = run[i] * run[i + lag]; std::isfinite(product)) {
        made.sum += product;
        ++made.pairs;
      }
    }
  }
  return made;
}

}  // namespace

Whiteness whiteness_of(std::span<const std::vector<double>> runs, std::size_t lags) {
  Whiteness made;
  const Product variance = product_at(runs, 0);
  made.samples = variance.pairs;
  if (made.samples < 8 || !(variance.sum > 0.0)) {
    return made;
  }
  const auto count = static_cast<double>(made.samples);
  lags = std::min(lags, made.samples / 4);
  double q = 0.0;
  for (std::size_t lag = 1; lag <= lags; ++lag) {
    const Product at = product_at(runs, lag);
    if (at.pairs == 0) {
      break;
    }
    const double rho = at.sum / variance.sum;
    made.autocorrelation.push_back(rho);
    q += rho * rho / static_cast<double>(at.pairs);
  }
  made.statistic = count * (count + 2.0) * q;
  made.p_value = chi_squared_tail(made.statistic, static_cast<double>(made.autocorrelation.size()));
  const double limit = 2.0 / std::sqrt(count);
  for (std::size_t lag = 1; lag <= made.samples / 4; ++lag) {
    const double rho = lag <= made.autocorrelation.size()
                           ? made.autocorrelation[lag - 1]
                           : product_at(runs, lag).sum / variance.sum;
    if (std::abs(rho) < limit) {
      break;
    }
    made.correlated_lags = lag;
  }
  return made;
}

}  // namespace flyball::identification
