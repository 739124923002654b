#include <flyball/math/probability/truncated_normal.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/constants.hpp"

namespace flyball {

namespace {

constexpr std::size_t half = 10;
/// The positive nodes of Gauss and Legendre's rule of 20 points on [-1, 1], and their weights
/// (Newton's method on P₂₀ in 40 digits).
constexpr std::array<double, half> legendre_nodes{
    0.07652652113349734, 0.22778585114164507, 0.37370608871541955, 0.5108670019508271,
    0.636053680726515,   0.7463319064601508,  0.8391169718222188,  0.912234428251326,
    0.9639719272779138,  0.9931285991850949};
constexpr std::array<double, half> legendre_weights{
    0.15275338713072584, 0.14917298647260374, 0.14209610931838204, 0.13168863844917664,
    0.11819453196151841, 0.10193011981724044, 0.08327674157670475, 0.06267204833410907,
    0.04060142980038694, 0.017614007139152118};

/// The mass of a density around its mode, at up to 80 places.
class NormalMass {
 public:
  /// One side of the mode, from `begin` deviations off the middle over `width` of them: the density
  /// e^(-(begin t + t²/2)) at begin + t, where it is more than e⁻⁴⁰.
  void add_side(double begin, double width, double sign) noexcept {
    constexpr double least = 80.0;  // Twice the exponent.
    const double reach = std::min(width, least / (std::hypot(begin, std::sqrt(least)) + begin));
    for (const double from : {0.0, 0.5 * reach}) {
      for (std::size_t i = 0; i < half; ++i) {
        for (const double side : {-1.0, 1.0}) {
          const double t = from + 0.25 * reach * (1.0 + side * legendre_nodes[i]);
          place_[count_] = sign * t;
          mass_[count_] = 0.25 * reach * legendre_weights[i] * std::exp(-t * (begin + 0.5 * t));
          ++count_;
        }
      }
    }
  }
  /// Its mean from the mode, and its variance.
  [[nodiscard]] Moments moments() const noexcept {
    double sum = 0.0;
    double first = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      sum += mass_[i];
      first += mass_[i] * place_[i];
    }
    const double mean = first / sum;
    double second = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      second += mass_[i] * (place_[i] - mean) * (place_[i] - mean);
    }
    return {mean, second / sum};
  }

 private:
  std::array<double, 8 * half> place_{};
  std::array<double, 8 * half> mass_{};
  std::size_t count_ = 0;
};

}  // namespace

Moments truncated_normal(double mean, double variance, double lower, double upper) noexcept {
  const bool usable = std::isfinite(mean) && variance > 0.0 && std::isfinite(variance) &&
                      lower <= upper && !(std::isinf(lower) && lower > 0.0) &&
                      !(std::isinf(upper) && upper < 0.0);
  if (!usable) {
    return {nan, nan};
  }
  const double sigma = std::sqrt(variance);
  const double a = (lower - mean) / sigma;
  const double b = (upper - mean) / sigma;
  constexpr double never = 9.0;  // Beyond it lies less than 1e-18 of the mass.
  if (a < -never && b > never) {
    return {mean, variance};
  }
  if (!(b > a)) {
    return {lower, 0.0};
  }
  NormalMass mass;
  double mode = mean;
  if (a >= 0.0) {
    mode = lower;
    mass.add_side(a, b - a, 1.0);
  } else if (b <= 0.0) {
    mode = upper;
    mass.add_side(-b, b - a, -1.0);
  } else {
    mass.add_side(0.0, -a, -1.0);
    mass.add_side(0.0, b, 1.0);
  }
  const Moments cut = mass.moments();
  return {std::clamp(mode + sigma * cut.mean, lower, upper), variance * cut.variance};
}

}  // namespace flyball
