#include <algorithm>
#include <cmath>

#include "identification/statistics.hpp"

namespace flyball::identification {

double quantile(std::vector<double> values, double q) {
  if (values.empty()) {
    return 0.0;
  }
  const double place = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::lround(place));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

double mad_scale(std::span<const double> residuals) {
  std::vector<double> magnitudes(residuals.size());
  std::transform(residuals.begin(), residuals.end(), magnitudes.begin(),
                 [](double residual) { return std::abs(residual); });
  return 1.4826 * median(std::move(magnitudes));
}

double interpolate(std::span<const double> x, std::span<const double> y, double at) {
  if (at <= x.front()) {
    return y.front();
  }
  if (at >= x.back()) {
    return y.back();
  }
  const std::size_t next = lower_index(x, at);
  const double width = x[next] - x[next - 1];
  const double fraction = width > 0.0 ? (at - x[next - 1]) / width : 1.0;
  return y[next - 1] + fraction * (y[next] - y[next - 1]);
}

std::size_t lower_index(std::span<const double> x, double at) {
  return static_cast<std::size_t>(std::lower_bound(x.begin(), x.end(), at) - x.begin());
}

}  // namespace flyball::identification
