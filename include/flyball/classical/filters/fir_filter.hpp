#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include <Eigen/Core>

#include <flyball/classical/filters/room.hpp>

namespace flyball::classical {

/// y_k = Σ b_i x_{k-i}: moving averages, differences, Savitzky–Golay and windowed filters.
///
/// Run-time object: no allocation, noexcept, one multiplication a tap. A sample that is not finite
/// counts as the last one that was.
/// @tparam N  For how many taps it has room.
template <int N>
class FirFilter {
 public:
  static_assert(N >= 1);

  /// @param taps  1 … N, newest sample's first: those of `fir_design.hpp`.
  /// @errors ArgumentError::empty, wrong_shape for more than N, not_finite for one that is not, or
  /// is above 1e100.
  [[nodiscard]] static Expected<FirFilter> create(std::span<const double> taps) {
    return detail::check_taps(taps, N).map([&] {
      FirFilter filter;
      filter.count_ = taps.size();
      std::ranges::copy(taps, filter.taps_.begin());
      return filter;
    });
  }
  [[nodiscard]] static Expected<FirFilter> create(const Eigen::VectorXd& taps) {
    return create(std::span(taps.data(), static_cast<std::size_t>(taps.size())));
  }

  /// One sample.
  double calculate(double x) noexcept {
    if (!is_signal(x)) {
      x = past_[newest_];
    }
    newest_ = newest_ == 0 ? count_ - 1 : newest_ - 1;
    past_[newest_] = x;
    past_[newest_ + count_] = x;  // twice, so that the last samples always stand in a row
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += taps_[i] * past_[newest_ + i];
    }
    return output_ = detail::cut(sum);
  }

  /// As if every sample so far had been x.
  void reset(double x = 0.0) noexcept {
    past_.fill(detail::signal_or_zero(x));
    newest_ = 0;
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += taps_[i] * past_[i];
    }
    output_ = detail::cut(sum);
  }

  [[nodiscard]] double output() const noexcept { return output_; }  ///< Of the last call.
  [[nodiscard]] std::span<const double> taps() const noexcept { return {taps_.data(), count_}; }

 private:
  FirFilter() = default;

  std::array<double, N> taps_{};
  std::array<double, 2 * static_cast<std::size_t>(N)> past_{};
  std::size_t count_ = 0;
  std::size_t newest_ = 0;
  double output_ = 0.0;
};

}  // namespace flyball::classical
