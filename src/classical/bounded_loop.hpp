#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "classical/factors.hpp"
#include "classical/loop_peaks.hpp"

/// A loop of known factors between two frequencies.
namespace flyball::classical::detail {

/// Between two frequencies, rad/s.
struct LoopStep {
  double from = 0.0;
  double to = 0.0;
};

/// A loop with what bounds its motion between two frequencies.
class BoundedLoop {
 public:
  BoundedLoop(const FrequencyResponse& loop, Factors factors)
      : loop_(loop), period_(loop.period()), factors_(std::move(factors)) {}

  [[nodiscard]] std::complex<double> at(double w) const { return loop_.at(w)(0, 0); }
  /// The same by its factors, many times as fast: what is bounded needs no last digits.
  [[nodiscard]] std::complex<double> near(double w) const {
    const double T = period_ ? period_->si() : 1.0;
    const std::complex<double> z = period_ ? std::polar(1.0, w * T) : std::complex<double>(0.0, w);
    std::complex<double> value = std::polar(1.0, -w * factors_.delay) * factors_.gain;
    const Eigen::Index common = std::min(factors_.zeros.size(), factors_.poles.size());
    for (Eigen::Index i = 0; i < common; ++i) {
      value *= (z - factors_.zeros(i)) / (z - factors_.poles(i));
    }
    for (Eigen::Index i = common; i < factors_.zeros.size(); ++i) {
      value *= z - factors_.zeros(i);
    }
    for (Eigen::Index i = common; i < factors_.poles.size(); ++i) {
      value /= z - factors_.poles(i);
    }
    return value;
  }
  [[nodiscard]] const Factors& factors() const { return factors_; }
  [[nodiscard]] double variation(const LoopStep& step) const {
    return flyball::classical::detail::variation(factors_, step.from, step.to, period_);
  }

  /// How far the phase can move on a step: each root of a continuous loop turns it one way; of a
  /// discrete one arg(z - r) has the slope T/2 + T (1 - |r|²)/2|z - r|², of a root on the circle
  /// the first part alone.
  [[nodiscard]] double turn(const LoopStep& step) const {
    if (period_) {
      double sum = factors_.delay * (step.to - step.from);
      const double turned = 0.5 * period_->si() * (step.to - step.from);
      for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
        for (const std::complex<double> root : *roots) {
          const double off = off_circle(root);
          sum += turned * (1.0 + (off > 0.0 ? off / squared_distance(root, step) : 0.0));
        }
      }
      return std::min(sum, variation(step));
    }
    double sum = factors_.delay * (step.to - step.from);
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const std::complex<double> root : *roots) {
        const double width = std::abs(root.real());
        sum +=
            std::atan2(step.to - root.imag(), width) - std::atan2(step.from - root.imag(), width);
      }
    }
    return sum;
  }

  /// How far ln |L| can move: also by what is left of ω^{-excess} when each root is taken as
  /// 1 - r/jω, which is little at high frequencies.
  [[nodiscard]] double swing(const LoopStep& step) const {
    const double plain = variation(step);
    if (period_) {
      return plain;
    }
    const Eigen::Index excess = factors_.poles.size() - factors_.zeros.size();
    double sum = static_cast<double>(std::abs(excess)) * std::log(step.to / step.from);
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const std::complex<double> root : *roots) {
        const double nearest = std::clamp(root.imag(), step.from, step.to);
        sum += std::abs(root) * (step.to - step.from) /
               (step.from * std::abs(std::complex<double>(0.0, nearest) - root));
      }
    }
    return std::min(plain, sum);
  }

  /// The largest second derivative of the phase on a step: 2 |σ|/|jω - r|³ of each root.
  [[nodiscard]] double turn_curvature(const LoopStep& step) const {
    if (period_) {  // T² |1 - |r|²| |r|/|z - r|³ is more than each root's.
      double sum = 0.0;
      const double T = period_->si();
      for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
        for (const std::complex<double> root : *roots) {
          if (const double off = off_circle(root); off > 0.0) {
            const double square = squared_distance(root, step);
            sum += T * T * off * std::abs(root) / (square * std::sqrt(square));
          }
        }
      }
      return std::min(sum, curvature(step));
    }
    double sum = 0.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const std::complex<double> root : *roots) {
        if (root.real() != 0.0) {
          const double nearest = std::clamp(root.imag(), step.from, step.to);
          const double distance = std::abs(std::complex<double>(0.0, nearest) - root);
          sum += 2.0 * std::abs(root.real()) / (distance * distance * distance);
        }
      }
    }
    return sum;
  }

  /// d ln L/dω
  [[nodiscard]] std::complex<double> slope(double w) const {
    const double T = period_ ? period_->si() : 1.0;
    const std::complex<double> z = period_ ? std::polar(1.0, w * T) : std::complex<double>(0.0, w);
    const std::complex<double> turn =
        std::complex<double>(0.0, 1.0) * (period_ ? T * z : std::complex<double>(1.0));
    std::complex<double> sum(0.0, -factors_.delay);
    for (const std::complex<double> zero : factors_.zeros) {
      sum += turn / (z - zero);
    }
    for (const std::complex<double> pole : factors_.poles) {
      sum -= turn / (z - pole);
    }
    return sum;
  }

  /// The largest |d² ln L/dω²| on a step: 1/|jω - r|², or T²|r|/|z - r|², of each root.
  [[nodiscard]] double curvature(const LoopStep& step) const {
    double sum = 0.0;
    const double T = period_ ? period_->si() : 1.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const std::complex<double> root : *roots) {
        if (!period_) {
          const double nearest = std::clamp(root.imag(), step.from, step.to);
          sum += 1.0 / std::norm(std::complex<double>(0.0, nearest) - root);
        } else if (root != 0.0) {
          const double angle = std::clamp(std::abs(std::arg(root)), step.from * T, step.to * T);
          sum += T * T * std::abs(root) /
                 std::norm(std::polar(1.0, angle) -
                           std::polar(std::abs(root), std::abs(std::arg(root))));
        }
      }
    }
    return sum;
  }

  /// The slowest and the fastest of the roots and the delay, rad/s.
  [[nodiscard]] LoopStep extremes() const {
    double slowest = std::numeric_limits<double>::infinity();
    double fastest = 0.0;
    for (const auto* roots : {&factors_.zeros, &factors_.poles}) {
      for (const std::complex<double> root : *roots) {
        const auto s = in_s(root, period_);
        if (s && *s != 0.0) {
          slowest = std::min(slowest, std::abs(*s));
          fastest = std::max(fastest, std::abs(*s));
        }
      }
    }
    if (factors_.delay > 0.0) {
      slowest = std::min(slowest, 1.0 / factors_.delay);
      fastest = std::max(fastest, 1.0 / factors_.delay);
    }
    if (fastest == 0.0) {
      slowest = fastest = 1.0;
    }
    return {std::min(slowest, loop_.highest_frequency()), fastest};
  }

  /// Up to where phase crossings are told: with dead time a continuous loop has no last one.
  [[nodiscard]] double last_phase() const {
    return factors_.delay > 0.0 && !period_ ? 10.0 * extremes().to
                                            : std::numeric_limits<double>::infinity();
  }

  /// From where on, and up to where, |L| and its phase do not cross any more.
  [[nodiscard]] LoopStep range() const {
    const auto [slowest, fastest] = extremes();
    const double end = loop_.highest_frequency();
    LoopStep range{1e-6 * slowest, period_                ? end
                                   : factors_.delay > 0.0 ? 10.0 * fastest
                                                          : 1e6 * fastest};
    // Beyond, the asymptotes K ω^{-N} and k ω^{-excess} are within a factor of two.
    const Asymptote low = low_asymptote(factors_, period_);
    if (low.integrators != 0) {
      const double crossing = std::exp(low.log_gain / low.integrators);
      range.from = std::min(range.from, 0.1 * crossing);
    }
    const Eigen::Index excess = factors_.poles.size() - factors_.zeros.size();
    if (excess != 0 && !period_) {
      const double log_k = std::log(std::abs(factors_.gain));
      range.to = std::max(range.to, 10.0 * std::exp(log_k / static_cast<double>(excess)));
    }
    return {std::max(range.from, 1e-290), std::min({range.to, end, 1e290})};
  }

 private:
  /// |1 - |r|²|, zero on the circle but for rounding.
  [[nodiscard]] static double off_circle(std::complex<double> root) {
    const double size = std::abs(root);
    const double off = std::abs((1.0 - size) * (1.0 + size));
    return off <= 4.0 * std::numeric_limits<double>::epsilon() ? 0.0 : off;
  }

  /// The least |z - r|² on a step of a discrete loop.
  [[nodiscard]] double squared_distance(std::complex<double> root, const LoopStep& step) const {
    const double T = period_->si();
    const double own = std::abs(std::arg(root));
    const double angle = std::clamp(own, step.from * T, step.to * T);
    return std::norm(std::polar(1.0, angle) - std::polar(std::abs(root), own));
  }

  const FrequencyResponse& loop_;
  std::optional<Time> period_;
  Factors factors_;
};

/// The lower or the upper half of a step, by its ratio where that is large.
[[nodiscard]] inline LoopStep halves(const LoopStep& step, bool first) {
  const double middle =
      step.to > 2.0 * step.from ? std::sqrt(step.from * step.to) : 0.5 * (step.from + step.to);
  return first ? LoopStep{step.from, middle} : LoopStep{middle, step.to};
}

/// `loop_peaks` of a loop that is not zero. @param grid  rad/s, where every resonance is met.
[[nodiscard]] LoopPeaks peaks_of(const BoundedLoop& loop, const LoopStep& range,
                                 const Eigen::VectorXd& grid, bool discrete);

}  // namespace flyball::classical::detail
