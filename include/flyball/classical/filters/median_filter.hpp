#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <flyball/classical/filters/room.hpp>

namespace flyball::classical {

/// The median of the last samples: up to half of them may be wild without moving it far.
///
/// Until there are as many samples as the window holds, of those that there are; of an even number
/// the mean of the two in the middle. Run-time object: no allocation, noexcept, O(window) moves at
/// most. A sample that is not finite is left out.
/// @tparam N  For how many samples it has room.
template <int N>
class MedianFilter {
 public:
  static_assert(N >= 1);

  /// @param window  Samples, 1 … N. @errors ArgumentError::out_of_range.
  [[nodiscard]] static Expected<MedianFilter> create(int window = N) {
    return detail::check_window(window, N).map([&] {
      MedianFilter filter;
      filter.window_ = static_cast<std::size_t>(window);
      return filter;
    });
  }

  /// One sample. @return The median; zero before the first.
  double calculate(double x) noexcept {
    if (!is_signal(x)) {
      return output_;
    }
    double* const first = sorted_.data();
    if (count_ == window_) {
      // The sample that leaves makes room; those between move by one.
      double* const place = std::lower_bound(first, first + count_, past_[oldest_]);
      std::move(place + 1, first + count_, place);
      --count_;
    }
    double* const place = std::upper_bound(first, first + count_, x);
    std::move_backward(place, first + count_, first + count_ + 1);
    *place = x;
    past_[oldest_] = x;
    oldest_ = oldest_ + 1 == window_ ? 0 : oldest_ + 1;
    ++count_;
    const std::size_t middle = count_ / 2;
    return output_ =
               count_ % 2 == 1 ? sorted_[middle] : 0.5 * (sorted_[middle - 1] + sorted_[middle]);
  }

  /// Forgets every sample.
  void reset() noexcept {
    count_ = 0;
    oldest_ = 0;
    output_ = 0.0;
  }

  [[nodiscard]] double output() const noexcept { return output_; }  ///< Of the last call.

 private:
  MedianFilter() = default;

  std::array<double, N> past_{};
  std::array<double, N> sorted_{};
  std::size_t window_ = 1;
  std::size_t count_ = 0;
  std::size_t oldest_ = 0;
  double output_ = 0.0;
};

}  // namespace flyball::classical
