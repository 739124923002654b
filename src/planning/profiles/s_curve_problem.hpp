#pragma once

#include <flyball/planning/profiles/motion.hpp>

#include "planning/profiles/s_curve_family.hpp"

namespace flyball::detail {

/// A jerk-limited motion that begins with what brings its start inside the limits.
struct SCurvePlan {
  struct Step {
    double duration = 0.0;
    double jerk = 0.0;  ///< -1, 0 or 1.
  };
  Step brake[4];
  int brakes = 0;
  double brake_time = 0.0;
  SCurveProblem problem{};  ///< What remains.
  SCurvePhases phases{};    ///< Its solution.
  MotionState goal{};       ///< In the limits.
  double jerk = 0.0;        ///< What lengths and velocities of the problem are to be multiplied by.
  bool usable = false;
  bool straight = false;  ///< Its start is outside of the limits, and it comes inside on its way.

  [[nodiscard]] double duration() const noexcept { return brake_time + phases.duration(); }
};

/// The numbers that a jerk-limited profile takes: limits in 1e-30..1e30, or more than that; states
/// up to 1e30. A jerk beyond is none (`trapezoid`).
inline constexpr double largest_motion = 1e30;
/// s; within it no place on the way is beyond the range of doubles.
inline constexpr double longest_motion = 1e90;

[[nodiscard]] bool is_usable(const MotionLimits& limits, const MotionState& start,
                             const MotionState& goal) noexcept;

/// The fastest motion from state to state.
/// @param inside_first  No `straight` plan: what remains then has a start within the limits.
[[nodiscard]] SCurvePlan plan_motion(const MotionLimits& limits, const MotionState& start,
                                     const MotionState& goal, bool inside_first = false) noexcept;

/// The fastest change to the goal's velocity and acceleration.
[[nodiscard]] SCurvePlan plan_velocity(const MotionLimits& limits, const MotionState& start,
                                       const MotionState& goal) noexcept;

}  // namespace flyball::detail
