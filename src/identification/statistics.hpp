#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace flyball::identification {

/// The q-quantile (0 ≤ q ≤ 1) of the values, nearest rank; 0 of none.
[[nodiscard]] double quantile(std::vector<double> values, double q);

[[nodiscard]] double median(std::vector<double> values);

/// Standard deviation estimated from the median absolute value: 1.4826 median |x|.
[[nodiscard]] double mad_scale(std::span<const double> residuals);

/// Linear interpolation of y over ascending x; constant beyond the ends. Not empty.
[[nodiscard]] double interpolate(std::span<const double> x, std::span<const double> y, double at);

/// Index of the first entry of ascending x that is not below `at`.
[[nodiscard]] std::size_t lower_index(std::span<const double> x, double at);

}  // namespace flyball::identification
