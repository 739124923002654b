#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include <flyball/classical/filters/digital_filter.hpp>
#include <flyball/classical/filters/room.hpp>
#include <flyball/core/signal.hpp>

namespace flyball::classical {

/// Biquads one after the other, each in transposed direct form II:
///
///   y = b0 x + s1,  s1 ← b1 x - a1 y + s2,  s2 ← b2 x - a2 y.
///
/// Run-time object: no allocation, noexcept, some two nanoseconds a section. A sample that is not
/// finite counts as the last one that was, so that a drop-out holds the input; no state is ever
/// beyond `largest_signal`.
/// @tparam N  Of how many sections it has room for.
template <int N>
class BiquadCascade {
 public:
  static_assert(N >= 1);

  /// @param sections  1 … N, stable: those of a `DigitalFilter`, or written down.
  /// @errors ArgumentError::wrong_shape for more than N, empty for none, not_finite, out_of_range
  /// for one that is not stable.
  [[nodiscard]] static Expected<BiquadCascade> create(std::span<const Biquad> sections);

  /// One sample.
  double calculate(double x) noexcept {
    double value = last_ = is_signal(x) ? x : last_;
    bool ordinary = true;
    for (std::size_t i = 0; i < count_; ++i) {
      const Biquad& c = sections_[i];
      State& s = states_[i];
      const double y = c.b0 * value + s.first;
      s.first = c.b1 * value - c.a1 * y + s.second;
      s.second = c.b2 * value - c.a2 * y;
      ordinary = ordinary & is_signal(s.first);
      ordinary = ordinary & is_signal(s.second);
      value = y;
    }
    if (!ordinary) {
      for (State& s : states_) {
        s = {detail::cut(s.first), detail::cut(s.second)};
      }
    }
    return output_ = detail::cut(value);
  }

  /// As if every sample so far had been zero.
  void reset() noexcept { reset(0.0); }
  /// As if every sample so far had been x: the next output is the steady one.
  void reset(double x) noexcept {
    double value = last_ = detail::signal_or_zero(x);
    for (std::size_t i = 0; i < count_; ++i) {
      const Biquad& c = sections_[i];
      const double y = detail::cut(value * ((c.b0 + c.b1 + c.b2) / ((1.0 + c.a1) + c.a2)));
      states_[i] = {detail::cut(y - c.b0 * value), detail::cut(c.b2 * value - c.a2 * y)};
      value = y;
    }
    output_ = value;
  }

  [[nodiscard]] double output() const noexcept { return output_; }  ///< Of the last call.
  [[nodiscard]] std::span<const Biquad> sections() const noexcept {
    return {sections_.data(), count_};
  }

 private:
  struct State {
    double first = 0.0;
    double second = 0.0;
  };
  BiquadCascade() = default;

  std::array<Biquad, N> sections_{};
  std::array<State, N> states_{};
  std::size_t count_ = 0;
  double last_ = 0.0;
  double output_ = 0.0;
};

template <int N>
Expected<BiquadCascade<N>> BiquadCascade<N>::create(std::span<const Biquad> sections) {
  return check_sections(sections, "BiquadCascade")
      .and_then([&] { return detail::check_room(sections.size(), N, "BiquadCascade", "sections"); })
      .map([&] {
        BiquadCascade cascade;
        std::ranges::copy(sections, cascade.sections_.begin());
        cascade.count_ = sections.size();
        cascade.reset();
        return cascade;
      });
}

}  // namespace flyball::classical
