#pragma once

#include <array>
#include <type_traits>
#include <utility>

#include <flyball/estimation/outlier_guard.hpp>

namespace flyball {

/// A filter and its sensors' guards as one, for a DelayedFilter: going back in time takes back what
/// the guards had counted since, so that a measurement that is replayed counts once, and the result
/// is that of the measurements in the order of their times, with guards as without.
///
/// A measurement corrects by `guarded.filter()` with `guarded.guard(i)` in its options. Time that
/// is predicted over is told to the guards, for their `recover_time`.
///
/// @tparam Filter  As of DelayedFilter. @tparam Guards  How many of them.
/// Run-time object: noexcept, allocation-free where the filter is.
template <class Filter, std::size_t Guards = 1>
class GuardedFilter {
 public:
  using InputVector = typename Filter::InputVector;
  /// What to go back to.
  struct Snapshot {
    std::remove_cvref_t<decltype(std::declval<const Filter&>().estimate())> estimate;
    std::array<OutlierGuard::Memory, Guards> guards;
  };

  /// @param guards  One a kind of measurement.
  GuardedFilter(const Filter& filter, const std::array<OutlierGuard, Guards>& guards) noexcept
      : filter_(filter), guards_(guards) {}

  /// The filter that the guards stand before.
  [[nodiscard]] Filter& filter() noexcept { return filter_; }
  [[nodiscard]] const Filter& filter() const noexcept { return filter_; }
  /// @param i  Below `Guards`.
  [[nodiscard]] OutlierGuard* guard(std::size_t i = 0) noexcept { return &guards_[i]; }
  [[nodiscard]] const OutlierGuard& guard(std::size_t i = 0) const noexcept { return guards_[i]; }

  /// As Filter::predict. @param dt  s.
  auto predict(const InputVector& u, double dt) noexcept {
    for (OutlierGuard& guard : guards_) {
      guard.advance(dt);
    }
    return filter_.predict(u, dt);
  }
  [[nodiscard]] Snapshot estimate() const noexcept {
    Snapshot snapshot{filter_.estimate(), {}};
    for (std::size_t i = 0; i < Guards; ++i) {
      snapshot.guards[i] = guards_[i].memory();
    }
    return snapshot;
  }
  void restore(const Snapshot& snapshot) noexcept {
    filter_.restore(snapshot.estimate);
    for (std::size_t i = 0; i < Guards; ++i) {
      guards_[i].restore(snapshot.guards[i]);
    }
  }

 private:
  Filter filter_;
  std::array<OutlierGuard, Guards> guards_;
};

}  // namespace flyball
