#pragma once

#include <array>
#include <cstdint>

namespace flyball {

/// A seeded source of random numbers whose sequence is part of the interface: the same seed gives
/// the same numbers on every machine (up to the last bit of the C library's logarithm in `normal`).
///
/// xoshiro256++ seeded through splitmix64. Source: Blackman and Vigna, "Scrambled linear
/// pseudorandom number generators", ACM TOMS 47 (2021).
class Random {
 public:
  /// @param seed  Any number; neighbouring seeds give unrelated sequences.
  explicit Random(std::uint64_t seed) noexcept;

  std::uint64_t bits() noexcept;                     ///< 64 random bits.
  double uniform() noexcept;                         ///< In [0, 1), 53 random bits.
  double uniform(double low, double high) noexcept;  ///< In [low, high).
  double normal() noexcept;                          ///< Standard normal (polar method).
  double normal(double mean, double std) noexcept;   ///< Normal with a standard deviation.

  /// An independent source for a sub-task, so that adding draws in one does not shift another.
  [[nodiscard]] Random split() noexcept;

 private:
  std::array<std::uint64_t, 4> state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace flyball
