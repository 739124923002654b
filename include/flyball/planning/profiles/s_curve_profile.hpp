#pragma once

#include <flyball/planning/profiles/motion.hpp>

namespace flyball {

namespace detail {
struct SCurvePlan;
}

/// A motion of pieces of constant jerk.
class JerkMotion {
 public:
  /// A part of constant jerk.
  struct Piece {
    double begin = 0.0;  ///< s
    MotionState at{};    ///< At its begin.
    double jerk = 0.0;
  };
  static constexpr int capacity = 16;

  [[nodiscard]] double total_time() const noexcept { return end_; }
  /// s, from t to the end.
  [[nodiscard]] double remaining_time(double t) const noexcept {
    return t > 0.0 ? (t < end_ ? end_ - t : 0.0) : end_;
  }
  /// @param t  s since the start; before it the start, after the end the goal, moving on with its
  ///           velocity.
  [[nodiscard]] MotionState sample(double t) const noexcept;
  /// The jerk of the piece that begins at or before t; zero outside.
  [[nodiscard]] double jerk(double t) const noexcept;
  [[nodiscard]] int pieces() const noexcept { return count_; }
  /// @param i  0..pieces()-1.
  [[nodiscard]] Piece piece(int i) const noexcept {
    return {begin_[i], {position_[i], velocity_[i], acceleration_[i]}, jerk_[i]};
  }
  [[nodiscard]] const MotionState& goal() const noexcept { return goal_; }

 protected:
  /// Starts anew, without pieces.
  void begin(const MotionState& start) noexcept {
    position_[0] = start.position;
    velocity_[0] = start.velocity;
    acceleration_[0] = start.acceleration;
    jerk_[0] = 0.0;
    begin_[0] = 0.0;
    goal_ = start;
    count_ = 0;
    end_ = 0.0;
  }
  /// Nothing is added for no duration. Beyond the capacity nothing is either.
  void add(double duration, double jerk) noexcept;
  void finish(const MotionState& goal) noexcept { goal_ = goal; }
  /// Appends the pieces of a plan.
  void add_plan(const detail::SCurvePlan& plan) noexcept;
  /// Appends the pieces of a trapezoid.
  void add_trapezoid(const MotionLimits& limits, const MotionState& start,
                     const MotionState& goal) noexcept;

  MotionState goal_{};  ///< While a motion is built: where it has come to.

 private:
  [[nodiscard]] int index_at(double t) const noexcept {
    int i = count_ > 0 ? count_ - 1 : 0;  // without pieces: the start
    while (i > 0 && t < begin_[i]) {
      --i;
    }
    return i;
  }

  int count_ = 0;
  double end_ = 0.0;
  // Of the pieces; what is beyond the count is not written, which takes longer than the rest.
  double begin_[capacity];
  double position_[capacity];
  double velocity_[capacity];
  double acceleration_[capacity];
  double jerk_[capacity];
};

/// The fastest motion between two states under limits of velocity, acceleration and jerk: seven
/// phases, of which some may be empty.
///
/// Any velocities and accelerations at the ends, other limits up than down, an acceleration that
/// does not cross zero, and any number of solutions: the first is taken. A start outside of the
/// limits, or one that cannot but leave them, is first brought back inside: either as fast as the
/// velocity can, or with an acceleration of zero at the limit, whichever arrives first. A goal that
/// could not be come to within the limits (its velocity or acceleration is beyond them, or would
/// have been before) has its acceleration, then its velocity, cut. Without a jerk limit it is the
/// trapezoid. Run-time object: noexcept, allocation-free, bounded and finite for whatever it is
/// given: limits outside of 1e-30 to infinity, or states that are not finite or beyond 1e30, or a
/// motion of more than 1e90 s, give a profile that is at the goal from the start.
///
/// Source: book, section 15.1.3 (the seven phases between states of rest). The duration is the
/// least at which the goal lies between the two extreme motions of Pontryagin's principle,
/// docs/derivations/s_curve.md; L. Berscheid, T. Kröger, Jerk-limited real-time trajectory
/// generation with arbitrary target states, RSS 2021, states the problem.
class SCurveProfile : public JerkMotion {
 public:
  SCurveProfile(const MotionLimits& limits, const MotionState& start,
                const MotionState& goal) noexcept;

  /// The fastest change to a velocity (and acceleration), wherever it ends.
  [[nodiscard]] static SCurveProfile to_velocity(const MotionLimits& limits,
                                                 const MotionState& start, double velocity,
                                                 double acceleration = 0.0) noexcept;

  [[nodiscard]] MotionLimits limits() const noexcept { return limits_.both_ways(); }
  /// Backwards the same accelerations and jerks go with opposite velocities.
  [[nodiscard]] bool reversible() const noexcept;
  [[nodiscard]] SCurveProfile replanned(const MotionState& state,
                                        const MotionState& goal) const noexcept {
    return {limits_, state, goal};
  }

 private:
  explicit SCurveProfile(const MotionLimits& limits) noexcept : limits_(limits) {}

  MotionLimits limits_;
};

static_assert(MotionProfile<SCurveProfile>);

}  // namespace flyball
