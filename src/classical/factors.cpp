#include <cmath>

#include "classical/factors.hpp"
#include "core/constants.hpp"

namespace flyball::classical {

using Complex = std::complex<double>;

namespace {

/// Left of the axis or on it, within the circle or on it: on which side the curve passes.
bool is_left(Complex root, bool discrete) {
  return discrete ? std::abs(root) <= 1.0 + 4.0 * epsilon
                  : root.real() <= 4.0 * epsilon * std::abs(root);
}

/// What one factor jω - r has turned since ω → 0, a pair of conjugates taken together.
double turned(Complex r, double w, const std::optional<Time>& period) {
  const bool left = is_left(r, period.has_value());
  if (!period) {
    const double angle = std::atan2(w - r.imag(), std::abs(r.real()));
    return left ? angle : -angle;
  }
  const double theta = w * period->si();
  if (!left) {
    return std::arg(1.0 - std::polar(1.0, theta) / r);
  }
  if (r == 1.0) {
    return 0.5 * (pi + theta);
  }
  return theta + std::arg(1.0 - r * std::polar(1.0, -theta));
}

}  // namespace

namespace detail {

std::optional<Complex> in_s(Complex root, const std::optional<Time>& period) {
  if (!period) {
    return root;
  }
  if (root == 0.0) {
    return std::nullopt;
  }
  return std::log(root) / period->si();
}

bool on_axis(Complex root, const std::optional<Time>& period) {
  return period ? std::abs(std::abs(root) - 1.0) <= 4.0 * epsilon
                : std::abs(root.real()) <= 4.0 * epsilon * std::abs(root);
}

double variation(const Factors& factors, double from, double to,
                 const std::optional<Time>& period) {
  double sum = factors.delay * (to - from);
  const auto add = [&](const Eigen::VectorXcd& roots) {
    for (const Complex root : roots) {
      if (!period) {
        const double width = on_axis(root, period) ? 0.0 : std::abs(root.real());
        const double low = from - root.imag();
        const double high = to - root.imag();
        if (width > 0.0) {
          sum += std::asinh(high / width) - std::asinh(low / width);
        } else if (low > 0.0 || high < 0.0) {
          sum += std::abs(std::log(high / low));
        } else {
          sum += infinity;
        }
        continue;
      }
      // |d ln(z - r)| = T dω/|z - r|, and |z - r| is at least that of the nearest angle.
      const double theta_low = from * period->si();
      const double theta_high = to * period->si();
      const double angle = std::arg(root);
      const double below = std::remainder(theta_low - angle, 2.0 * pi);
      const double span = theta_high - theta_low;
      const bool passes = below <= 0.0 && below + span >= 0.0;
      const double size = std::abs(root);
      double distance = std::abs(size - 1.0);
      if (!passes) {
        distance = std::min(std::abs(std::polar(1.0, theta_low) - root),
                            std::abs(std::polar(1.0, theta_high) - root));
      } else if (on_axis(root, period)) {
        distance = 0.0;
      }
      sum += span > 0.0 ? span / distance : 0.0;
    }
  };
  add(factors.zeros);
  add(factors.poles);
  return sum;
}

Asymptote low_asymptote(const Factors& factors, const std::optional<Time>& period) {
  Asymptote at_zero;
  const Complex origin = period ? Complex(1.0) : Complex(0.0);
  at_zero.negative = factors.gain < 0.0;
  at_zero.log_gain = std::log(std::abs(factors.gain));
  const auto count = [&](const Eigen::VectorXcd& roots, int sign) {
    for (const Complex root : roots) {
      const Complex value = origin - root;
      if (value == 0.0) {
        at_zero.integrators -= sign;
        // z - 1 ≈ sT
        at_zero.log_gain += period ? sign * std::log(period->si()) : 0.0;
        continue;
      }
      at_zero.log_gain += sign * std::log(std::abs(value));
      // Of a pair the product is positive.
      at_zero.negative ^= root.imag() == 0.0 && value.real() < 0.0;
    }
  };
  count(factors.zeros, 1);
  count(factors.poles, -1);
  return at_zero;
}

}  // namespace detail

double unwrapped_phase(const Factors& factors, double frequency,
                       const std::optional<Time>& period) {
  const detail::Asymptote start = detail::low_asymptote(factors, period);
  double phase = start.negative ? -pi : 0.0;
  const auto add = [&](const Eigen::VectorXcd& roots, double sign) {
    for (const Complex root : roots) {
      phase += sign * turned(root, frequency, period);
    }
  };
  add(factors.zeros, 1.0);
  add(factors.poles, -1.0);
  return (phase - frequency * factors.delay) * 180.0 / pi;
}

}  // namespace flyball::classical
