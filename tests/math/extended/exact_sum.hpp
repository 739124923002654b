#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace flyball::test {

/// A sum of doubles and of products of two, without any rounding: a fixed-point number over the
/// whole range of doubles, digits of 32 bits.
class ExactSum {
 public:
  void add(double x) {
    int exponent = 0;
    const double fraction = std::frexp(std::abs(x), &exponent);
    const auto mantissa = static_cast<std::uint64_t>(std::ldexp(fraction, 53));
    const auto place = static_cast<std::size_t>(exponent - 53 + lowest);
    const std::int64_t sign = x < 0.0 ? -1 : 1;
    add_at(place, mantissa & 0xffffffffU, sign);
    add_at(place + 32, mantissa >> 32U, sign);
  }
  void add_product(double a, double b) {
    const double p = a * b;
    add(p);
    add(std::fma(a, b, -p));
  }
  /// The sum, as the nearest double or one beside it.
  [[nodiscard]] double value() const {
    std::array<std::int64_t, digits> d = digit_;
    carry(d);
    const bool negative = d.back() < 0;
    if (negative) {
      for (std::int64_t& digit : d) {
        digit = -digit;
      }
      carry(d);
    }
    double sum = 0.0;
    for (std::size_t k = digits; k-- > 0;) {
      sum += std::ldexp(static_cast<double>(d[k]), static_cast<int>(32 * k) - lowest);
    }
    return negative ? -sum : sum;
  }

 private:
  static constexpr int lowest = 1200;  ///< 2^-1200 is the last place.
  static constexpr std::size_t digits = 76;

  static void carry(std::array<std::int64_t, digits>& d) {
    for (std::size_t k = 0; k + 1 < digits; ++k) {
      const std::int64_t over = d[k] >> 32;
      d[k] -= over * (std::int64_t{1} << 32);
      d[k + 1] += over;
    }
  }
  void add_at(std::size_t place, std::uint64_t part, std::int64_t sign) {
    const std::uint64_t shifted = part << (place % 32);
    digit_[place / 32] += sign * static_cast<std::int64_t>(shifted & 0xffffffffU);
    digit_[place / 32 + 1] += sign * static_cast<std::int64_t>(shifted >> 32U);
  }

  std::array<std::int64_t, digits> digit_{};
};

}  // namespace flyball::test
