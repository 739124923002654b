#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/classical/step_metrics.hpp>

namespace flyball::classical::detail {

/// The metrics as points and crossings come in, of y in the final value's direction and unit.
class Judge {
 public:
  /// @param rounding  What y is off by.
  explicit Judge(double band, double rounding = 1e-14) : band_(band), rounding_(rounding) {}

  void point(double time, double y) {
    if (y > peak_) {
      peak_ = y;
      peak_time_ = time;
    }
    if (y < least_) {
      least_ = y;
      least_time_ = time;
    }
  }
  /// Whether [low, high] has neither a new peak nor a new least.
  [[nodiscard]] bool holds(double low, double high) const { return least_ <= low && high <= peak_; }
  void reaches(double level, double time) {
    double& first = level == 0.1 ? ten_ : ninety_;
    first = std::isnan(first) ? time : first;
  }
  void outside_until(double time) { settled_ = time; }
  [[nodiscard]] bool waits_for(double level) const {
    return std::isnan(level == 0.1 ? ten_ : ninety_);
  }
  [[nodiscard]] double band() const { return band_; }

  /// Of y itself, where it ends at zero.
  [[nodiscard]] StepMetrics of_zero(double delay) const {
    StepMetrics m;
    const bool above = std::abs(peak_) >= std::abs(least_);
    if (std::max(peak_, -least_) > 0.0) {
      m.peak = above ? peak_ : least_;
      m.peak_time = (above ? peak_time_ : least_time_) + delay;
    } else {
      m.peak = 0.0;
    }
    return m;
  }

  [[nodiscard]] StepMetrics metrics(double final_value, double delay) const {
    StepMetrics m{.final_value = final_value};
    if (!std::isnan(ten_) && !std::isnan(ninety_)) {
      m.rise_time = ninety_ - ten_;
    }
    m.settling_time = settled_ + (settled_ > 0.0 || delay > 0.0 ? delay : 0.0);
    const bool beyond = peak_ > 1.0 + 100.0 * rounding_;
    m.overshoot = beyond ? peak_ - 1.0 : 0.0;
    m.undershoot = least_ < -rounding_ ? -least_ : 0.0;
    m.peak = beyond ? peak_ * final_value : final_value;
    if (beyond) {
      m.peak_time = peak_time_ + delay;
    }
    return m;
  }

 private:
  double band_;
  double rounding_;
  double peak_ = -std::numeric_limits<double>::infinity();
  double peak_time_ = 0.0;
  double least_ = 0.0;
  double least_time_ = 0.0;
  double ten_ = std::numeric_limits<double>::quiet_NaN();
  double ninety_ = std::numeric_limits<double>::quiet_NaN();
  double settled_ = 0.0;
};

}  // namespace flyball::classical::detail
