#pragma once

#include <cstdint>

#include <flyball/core/expected.hpp>

namespace flyball::classical {

/// Which edges of a switch have to last before they count.
enum class DebounceEdge {
  rising,   ///< True, once it has been true for the time; false at once.
  falling,  ///< False, once it has been false for the time; true at once.
  both,
};

/// A switch without its bounces.
///
/// A change counts with the first sample at which it has lasted the whole time without a
/// break. Run-time object: no allocation, noexcept.
class Debouncer {
 public:
  /// @param time  s, not negative; rounded up to whole periods. @param period  s, between two
  /// calls.
  /// @errors ArgumentError::not_positive, not_finite, out_of_range.
  /// The output begins with false; with `DebounceEdge::falling`, true.
  [[nodiscard]] static Expected<Debouncer> create(double time, double period,
                                                  DebounceEdge edge = DebounceEdge::rising);

  /// One sample.
  bool calculate(bool x) noexcept;

  /// The output is x from here on.
  void reset(bool x) noexcept;

  [[nodiscard]] bool output() const noexcept { return output_; }  ///< Of the last call.

 private:
  Debouncer() = default;

  std::int64_t needed_ = 1;  ///< Samples that a change must last.
  std::int64_t lasted_ = 0;
  DebounceEdge edge_ = DebounceEdge::rising;
  bool output_ = false;
};

}  // namespace flyball::classical
