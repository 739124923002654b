#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>

#include <flyball/core/signal.hpp>

namespace flyball {

/// Whether a history took what it was told. Unless it did, nothing has changed.
enum class DelayStatus {
  taken,
  not_finite,     ///< The time is not a finite number.
  in_the_past,    ///< An input for a time that is over.
  too_old,        ///< A measurement of before the oldest sample that is kept.
  in_the_future,  ///< A measurement of a time that the inputs have not reached.
};

/// A filter that takes measurements late and in any order, as cameras and radios bring them: it
/// keeps its last `Capacity` samples (inputs and measurements, each with the estimate after it),
/// goes back to the one before a late measurement, takes it there, and goes through the later ones
/// again. The result is that of the same measurements in the order of their times; those of one
/// time are taken in the order in which they came.
///
/// @tparam Filter  Has `predict(u, dt)`, `estimate()` and `restore(estimate)`, as ModelFilter does.
/// @tparam Measurement  A value that corrects: `measurement(filter)`; for several kinds of them a
///                 std::variant in a struct. It is called again at each replay: what counts
///                 measurements belongs to what is restored (of OutlierGuards, a GuardedFilter).
/// Run-time object: noexcept, allocation-free where the filter is. Cost: an input one prediction, a
/// measurement at most `Capacity` predictions and corrections, which is the bound; the number of
/// the samples since its time is what it usually is.
template <class Filter, class Measurement, std::size_t Capacity,
          class Input = typename Filter::InputVector>
class DelayedFilter {
  static_assert(Capacity >= 2);

 public:
  using Snapshot = std::remove_cvref_t<decltype(std::declval<const Filter&>().estimate())>;
  using Result = std::invoke_result_t<const Measurement&, Filter&>;

  /// What came of a measurement.
  struct Outcome {
    DelayStatus status = DelayStatus::not_finite;
    Result result{};           ///< What the measurement answered, if it was taken.
    std::size_t replayed = 0;  ///< How many later samples were gone through again.
  };

  /// @param filter  At the time `start`. @param start  s; cut to a finite number.
  DelayedFilter(const Filter& filter, double start) noexcept : filter_(filter) {
    entries_[0] = Entry{detail::cut(start), nothing(), std::nullopt, filter.estimate()};
    count_ = 1;
  }

  /// The time goes on. @param time  s, not before that of the last call. @param u  Held since then.
  DelayStatus advance(double time, const Input& u) noexcept {
    if (!is_signal(time)) {
      return DelayStatus::not_finite;
    }
    const double dt = time - now();
    if (dt < 0.0) {
      return DelayStatus::in_the_past;
    }
    filter_.predict(u, dt);
    make_room();
    entry(count_ - 1) = {time, u, std::nullopt, filter_.estimate()};
    return DelayStatus::taken;
  }

  /// A measurement of a time at or before now.
  /// @param time  s, when it was taken. @param measurement  It, by value.
  Outcome measure(double time, const Measurement& measurement) noexcept {
    Outcome outcome;
    if (!is_signal(time)) {
      return outcome;
    }
    if (time > now()) {
      outcome.status = DelayStatus::in_the_future;
      return outcome;
    }
    const std::size_t before = reached_by(time);
    if (before == 0) {
      outcome.status = DelayStatus::too_old;
      return outcome;
    }
    const Entry& base = entry(before - 1);
    filter_.restore(base.after);
    // The input of the interval that the measurement falls into.
    const Input u = before < count_ ? entry(before).u : base.u;
    if (time > base.time) {
      filter_.predict(u, time - base.time);
    }
    outcome.result = measurement(filter_);
    outcome.status = DelayStatus::taken;
    outcome.replayed = count_ - before;
    const std::size_t later = count_ - before;
    make_room();
    for (std::size_t k = 0; k < later; ++k) {
      entry(count_ - 1 - k) = std::move(entry(count_ - 2 - k));
    }
    std::size_t k = count_ - 1 - later;
    entry(k) = {time, u, measurement, filter_.estimate()};
    double reached = time;
    for (++k; k < count_; ++k) {
      Entry& next = entry(k);
      if (next.time > reached) {
        filter_.predict(next.u, next.time - reached);
        reached = next.time;
      }
      if (next.measurement) {
        (*next.measurement)(filter_);
      }
      next.after = filter_.estimate();
    }
    return outcome;
  }

  /// Up to now. @return  The filter; what is done to it by hand is undone by the next replay.
  [[nodiscard]] const Filter& filter() const noexcept { return filter_; }
  [[nodiscard]] double now() const noexcept { return entry(count_ - 1).time; }
  /// The oldest time at which a measurement is taken.
  [[nodiscard]] double oldest() const noexcept { return entry(0).time; }
  /// The estimate of a time, from the samples up to it; none before the oldest and after now.
  /// @param time  s. Cost: one prediction.
  [[nodiscard]] std::optional<Snapshot> at(double time) const noexcept {
    const std::size_t before = is_signal(time) && time <= now() ? reached_by(time) : 0;
    if (before == 0) {
      return std::nullopt;
    }
    const Entry& base = entry(before - 1);
    if (time == base.time) {
      return base.after;
    }
    Filter then = filter_;
    then.restore(base.after);
    then.predict(entry(before).u, time - base.time);
    return then.estimate();
  }
  /// Starts again, with nothing to go back to. @param start  s.
  void reset(const Snapshot& estimate, double start) noexcept {
    filter_.restore(estimate);
    begin_ = 0;
    count_ = 1;
    entries_[0] = Entry{detail::cut(start), nothing(), std::nullopt, estimate};
  }

 private:
  struct Entry {
    double time;
    Input u;  ///< Held from the entry before to this one.
    std::optional<Measurement> measurement;
    Snapshot after;
  };

  static Input nothing() noexcept {
    Input u;
    if constexpr (requires { u.setZero(); }) {
      u.setZero();
    } else {
      u = Input{};
    }
    return u;
  }
  /// How many entries are of a time or of before it.
  [[nodiscard]] std::size_t reached_by(double time) const noexcept {
    std::size_t before = count_;
    while (before > 0 && entry(before - 1).time > time) {
      --before;
    }
    return before;
  }
  [[nodiscard]] Entry& entry(std::size_t k) noexcept { return *entries_[(begin_ + k) % Capacity]; }
  [[nodiscard]] const Entry& entry(std::size_t k) const noexcept {
    return *entries_[(begin_ + k) % Capacity];
  }
  /// One more entry at the end, if need be for the oldest.
  void make_room() noexcept {
    if (count_ < Capacity) {
      ++count_;
      entries_[(begin_ + count_ - 1) % Capacity] = *entries_[begin_];
    } else {
      begin_ = (begin_ + 1) % Capacity;
    }
  }

  Filter filter_;
  std::array<std::optional<Entry>, Capacity> entries_{};
  std::size_t begin_ = 0;
  std::size_t count_ = 0;
};

}  // namespace flyball
