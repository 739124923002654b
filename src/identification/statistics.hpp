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

/// The same for times that are asked for nearly in order: it begins where the last one was.
class Interpolation {
 public:
  /// Both stay.
  Interpolation(std::span<const double> x, std::span<const double> y) : x_(x), y_(y) {}
  [[nodiscard]] double at(double place) {
    while (next_ < x_.size() && x_[next_] < place) {
      ++next_;
    }
    while (next_ > 0 && x_[next_ - 1] >= place) {
      --next_;
    }
    if (next_ == 0 || next_ == x_.size()) {
      return next_ == 0 ? y_.front() : y_.back();
    }
    const double width = x_[next_] - x_[next_ - 1];
    return y_[next_ - 1] + (place - x_[next_ - 1]) / width * (y_[next_] - y_[next_ - 1]);
  }

 private:
  std::span<const double> x_;
  std::span<const double> y_;
  std::size_t next_ = 0;  ///< Of the last place, as `lower_index` says.
};

/// Index of the first entry of ascending x that is not below `at`.
[[nodiscard]] std::size_t lower_index(std::span<const double> x, double at);

}  // namespace flyball::identification
