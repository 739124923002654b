#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/plot_data.hpp"

namespace flyball::io {
namespace {

bool drawn(double x, double y) {
  return std::isfinite(x) && std::isfinite(y);
}

}  // namespace

Points thin_curve(const std::vector<double>& x, const std::vector<double>& y, std::size_t pixels) {
  const std::size_t count = std::min(x.size(), y.size());
  double last = -std::numeric_limits<double>::infinity();
  double first = std::numeric_limits<double>::quiet_NaN();
  bool ascending = true;
  for (std::size_t i = 0; i < count && ascending; ++i) {
    if (std::isfinite(x[i])) {
      ascending = x[i] >= last;
      last = x[i];
      first = std::isnan(first) ? x[i] : first;
    }
  }
  if (!ascending || count <= 4 * pixels || !(last > first)) {
    return {{x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count)},
            {y.begin(), y.begin() + static_cast<std::ptrdiff_t>(count)}};
  }
  Points result;
  const double scale = static_cast<double>(pixels) / (last - first);
  const auto column = [&](std::size_t i) { return std::floor((x[i] - first) * scale); };
  for (std::size_t i = 0; i < count;) {
    if (!drawn(x[i], y[i])) {
      result.x.push_back(x[i]);
      result.y.push_back(std::numeric_limits<double>::quiet_NaN());
      while (i < count && !drawn(x[i], y[i])) {
        ++i;
      }
      continue;
    }
    const std::size_t begin = i;
    std::size_t least = i;
    std::size_t greatest = i;
    for (; i < count && drawn(x[i], y[i]) && column(i) == column(begin); ++i) {
      least = y[i] < y[least] ? i : least;
      greatest = y[i] > y[greatest] ? i : greatest;
    }
    std::array<std::size_t, 4> kept = {begin, least, greatest, i - 1};
    std::sort(kept.begin(), kept.end());
    for (auto k = kept.begin(); k != std::unique(kept.begin(), kept.end()); ++k) {
      result.x.push_back(x[*k]);
      result.y.push_back(y[*k]);
    }
  }
  return result;
}

Points thin_scatter(const std::vector<double>& x, const std::vector<double>& y, std::size_t columns,
                    std::size_t rows) {
  const std::size_t count = std::min(x.size(), y.size());
  Range x_range;
  Range y_range;
  for (std::size_t i = 0; i < count; ++i) {
    if (drawn(x[i], y[i])) {
      x_range.include(x[i]);
      y_range.include(y[i]);
    }
  }
  if (x_range.empty()) {
    return {};
  }
  x_range.pad(0.0);
  y_range.pad(0.0);
  const auto cell = [](double value, const Range& range, std::size_t cells) {
    const double place = (value - range.low()) / range.span() * static_cast<double>(cells);
    return std::min(static_cast<std::size_t>(std::max(place, 0.0)), cells - 1);
  };
  std::vector<bool> taken(columns * rows, false);
  Points result;
  for (std::size_t i = 0; i < count; ++i) {
    if (!drawn(x[i], y[i])) {
      continue;
    }
    const std::size_t at = cell(y[i], y_range, rows) * columns + cell(x[i], x_range, columns);
    if (!taken[at]) {
      taken[at] = true;
      result.x.push_back(x[i]);
      result.y.push_back(y[i]);
    }
  }
  return result;
}

void Range::include(double value) {
  // Beyond this gnuplot's own arithmetic on axes overflows.
  constexpr double largest = 1e300;
  if (!std::isfinite(value) || std::abs(value) > largest || (logarithmic_ && value <= 0.0)) {
    return;
  }
  if (empty()) {
    low_ = high_ = value;
  } else {
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
}

void Range::include(const std::vector<double>& values) {
  for (const double value : values) {
    include(value);
  }
}

void Range::pad(double fraction) {
  if (empty()) {
    low_ = logarithmic_ ? 0.1 : -1.0;
    high_ = logarithmic_ ? 10.0 : 1.0;
    return;
  }
  if (logarithmic_) {
    const double factor = high_ > low_ ? std::pow(high_ / low_, fraction) : 2.0;
    low_ /= factor;
    high_ *= factor;
    return;
  }
  // A constant, or one up to rounding, gets a tenth of its size to either side.
  const double size = std::max(std::abs(low_), std::abs(high_));
  const double margin = span() > 1e-9 * size ? fraction * span() : size > 0.0 ? 0.1 * size : 1.0;
  low_ -= margin;
  high_ += margin;
}

void Range::widen_to(double span) {
  const double centre = 0.5 * (low_ + high_);
  low_ = centre - 0.5 * span;
  high_ = centre + 0.5 * span;
}

double tick_step(double span, int at_most) {
  const double least = span / std::max(at_most, 1);
  if (!std::isfinite(least) || least < 1e-290) {
    return 0.0;
  }
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least * (1.0 - 1e-9)) {
      return factor * power;
    }
  }
  return 10.0 * power;
}

void round_out(Range& range, double step) {
  constexpr double nearly = 0.02;  // of the span
  if (step <= 0.0) {
    return;
  }
  const double margin = nearly * range.span();
  const double low = std::floor(range.low() / step) * step;
  const double high = std::ceil(range.high() / step) * step;
  if (range.low() - low < margin) {
    range.include(low);
  }
  if (high - range.high() < margin) {
    range.include(high);
  }
}

}  // namespace flyball::io
