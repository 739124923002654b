#pragma once

#include <array>
#include <cstddef>

#include <flyball/planning/profiles/s_curve_profile.hpp>

namespace flyball {

/// How the axes of a motion belong together.
enum class Synchronization {
  time,   ///< All arrive at once.
  phase,  ///< They move along a straight line, if their states lie on one; else as `time`.
};

/// One axis of a motion of several: its own S-curve, or one that takes longer.
class AxisMotion : public JerkMotion {
 private:
  friend struct AxisMotions;
};

/// What synchronizes any number of axes; `SynchronizedMotion` is the object to use.
struct AxisMotions {
  const MotionLimits* limits;
  const MotionState* start;
  const MotionState* goal;
  detail::SCurvePlan* plans;  ///< Room for one an axis.
  AxisMotion* axes;
  int count;

  /// The axis that all wait for, along a line the one whose limits are its; -1 if none alone
  /// decides it.
  int slowest = 0;
  bool in_phase = false;  ///< Whether they move along a line.

  /// @return The common duration, s.
  double synchronize(Synchronization how, double least) noexcept;

 private:
  bool move_in_phase() noexcept;
};

/// The fastest motion of several axes from any states to any others, under limits of velocity,
/// acceleration and jerk of each, that ends for all at once.
///
/// The common duration is the least that every axis can have: for an axis that must end moving some
/// are blocked (too long for the short way, too short for the long one). An axis with time to spare
/// cruises slower; where no cruise has the duration it mixes its two extreme motions, which keeps
/// all limits, since they are convex. In phase, all axes are multiples of one S-curve, along the
/// straight line between the states; that is the fastest on this line and may be slower than
/// `time`. Run-time object as SCurveProfile: an axis whose numbers are unusable is at its goal from
/// the start.
/// @tparam Axes  Their number, >= 1.
/// Source: L. Berscheid, T. Kröger, Jerk-limited real-time trajectory generation with arbitrary
/// target states, RSS 2021 (blocked durations); docs/derivations/s_curve.md.
template <int Axes>
class SynchronizedMotion {
 public:
  using Limits = std::array<MotionLimits, static_cast<std::size_t>(Axes)>;
  using States = std::array<MotionState, static_cast<std::size_t>(Axes)>;

  /// @param least  s; it takes at least so long. Beyond 1e90, or no number: as zero.
  SynchronizedMotion(const Limits& limits, const States& start, const States& goal,
                     Synchronization how = Synchronization::time, double least = 0.0) noexcept;

  [[nodiscard]] double total_time() const noexcept { return total_; }
  /// s, from t to the end of all axes.
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return t > 0.0 ? (t < total_ ? total_ - t : 0.0) : total_;
  }
  /// @param t  s since the start.
  [[nodiscard]] States sample(double t) const noexcept {
    States all;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i] = axes_[i].sample(t);
    }
    return all;
  }
  /// The motion of one axis. @param i  Below the number of axes.
  [[nodiscard]] const JerkMotion& axis(int i) const noexcept {
    return axes_[static_cast<std::size_t>(i)];
  }
  /// The axis that the others wait for; along a line the one that has all of its limits. -1 if
  /// none alone decides: `least`, a blocked duration, limits of several axes.
  [[nodiscard]] int slowest_axis() const noexcept { return slowest_; }
  [[nodiscard]] bool in_phase() const noexcept { return in_phase_; }

 private:
  std::array<AxisMotion, static_cast<std::size_t>(Axes)> axes_;
  double total_ = 0.0;
  int slowest_ = 0;
  bool in_phase_ = false;
};

namespace detail {
/// Calls `motions.synchronize` with room for the plans, which this header does not know.
double synchronize(AxisMotions& motions, Synchronization how, double least) noexcept;
}  // namespace detail

template <int Axes>
SynchronizedMotion<Axes>::SynchronizedMotion(const Limits& limits, const States& start,
                                             const States& goal, Synchronization how,
                                             double least) noexcept {
  static_assert(Axes >= 1 && Axes <= 16);
  AxisMotions motions{limits.data(), start.data(), goal.data(), nullptr, axes_.data(), Axes};
  total_ = detail::synchronize(motions, how, least);
  slowest_ = motions.slowest;
  in_phase_ = motions.in_phase;
}

}  // namespace flyball
