#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>

#include <flyball/core/random.hpp>

namespace flyball::fuzz {

/// Where a made-up problem's choices come from: a seed, or the bytes that libFuzzer mutates. Bytes
/// that have run out choose the first of what there is.
class Choices {
 public:
  explicit Choices(std::uint64_t seed) : random_(seed), seeded_(true) {}
  explicit Choices(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// A number below a bound that is at most 2^16.
  std::size_t below(std::size_t bound) {
    if (seeded_) {
      return static_cast<std::size_t>(random_.bits() >> 32) % bound;
    }
    std::size_t value = byte();
    if (bound > 256) {
      value |= byte() << 8;
    }
    return value % bound;
  }
  bool once_in(std::size_t count) { return below(count) == count - 1; }
  template <class T>
  T one_of(std::initializer_list<T> list) {
    return list.begin()[below(list.size())];
  }
  /// In [-1, 1), in steps of 2^-15.
  double fraction() { return static_cast<double>(below(65536)) / 32768.0 - 1.0; }

 private:
  std::size_t byte() {
    if (at_ >= bytes_.size()) {
      return 0;
    }
    return bytes_[at_++];
  }

  Random random_{0};
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool seeded_ = false;
};

}  // namespace flyball::fuzz
