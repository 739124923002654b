#pragma once

namespace flyball::detail {

/// A jerk-limited problem with the jerk limit divided out of all lengths (so the jerk is ±1 and
/// accelerations are times): from (0, v_0, a_0) to (distance, v_f, a_f).
struct SCurveProblem {
  double distance = 0.0;
  double v_0 = 0.0;
  double a_0 = 0.0;
  double v_f = 0.0;
  double a_f = 0.0;
  double up = 0.0;     ///< Largest acceleration.
  double down = 0.0;   ///< Largest of accelerations below zero, as a size.
  double high = 0.0;   ///< Largest velocity.
  double low = 0.0;    ///< Largest of velocities below zero, as a size.
  double slack = 0.0;  ///< What the distance is uncertain by.
};

/// Durations of the seven phases with jerks sign·(+1, 0, -1, 0, -1, 0, +1).
struct SCurvePhases {
  double t[7] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  double sign = 1.0;

  [[nodiscard]] double duration() const noexcept {
    return t[0] + t[1] + t[2] + t[3] + t[4] + t[5] + t[6];
  }
};

/// The extreme motions of one sign: of all motions that take a time T from (v_0, a_0) to
/// (v_f, a_f), the one that goes farthest. Pontryagin's principle makes its jerk +, -, + with arcs
/// at the limits between.
///
/// A ramp of acceleration that is extended to zero acceleration on either side removes a_0 and a_f:
/// it starts at the velocity K_0 = v_0 - a_0²/2, ends at K = v_f - a_f²/2, and the distance between
/// is X. Let a_1 be the first extreme of the acceleration and b the second, with holds t_2 and t_6
/// at the limits, and v_p = K_0 + a_1 (a_1 + t_2) = K - b (t_6 - b) the velocity where the
/// acceleration falls through zero. Then, with both ramps symmetric,
///
///   T = 2 a_1 + t_2 + t_4 - 2 b + t_6
///   X = (K_0 + v_p)/2 (2 a_1 + t_2) + v_p t_4 + (v_p + K)/2 (t_6 - 2 b)
///   dX/dT = v_p - a_1 b/2 before, v_p during a cruise t_4
///
/// which hold as they stand if the acceleration does not cross zero (b > 0 or a_1 < 0). Everything
/// is a function of T alone: X(T) is concave, if at all, only where the acceleration keeps its
/// sign, then convex, and a straight line at the velocity limit.
struct SCurveFamily {
  double K_0 = 0.0;
  double K = 0.0;
  double a_0 = 0.0;
  double a_f = 0.0;
  double up = 0.0;
  double down = 0.0;
  double v_max = 0.0;
  double v_min = 0.0;  ///< As a size.
  double E = 0.0;      ///< K - K_0 = a_1² - b² without holds.
  double X = 0.0;
  double slack = 0.0;
  bool mirrored = false;
  bool reversed = false;
};

/// What is free in a motion of a family.
struct SCurveShape {
  double a_1 = 0.0;
  double hold_1 = 0.0;
  double cruise = 0.0;
  double b = 0.0;
  double hold_2 = 0.0;
  double v_p = 0.0;

  [[nodiscard]] double time() const noexcept { return 2.0 * (a_1 - b) + hold_1 + hold_2 + cruise; }
};

[[nodiscard]] SCurveFamily family_of(const SCurveProblem& problem, bool mirrored) noexcept;

/// The same family backwards in time and mirrored, which exchanges its ends and keeps X and T.
[[nodiscard]] SCurveFamily reversed(const SCurveFamily& family) noexcept;

/// The family of the other sign.
[[nodiscard]] SCurveFamily mirrored(const SCurveFamily& family) noexcept;

/// The member with a time T (with its ramps extended). Source of the cases: which hold is not zero.
[[nodiscard]] SCurveShape shape_at(const SCurveFamily& family, double T) noexcept;

/// The member without cruise with a given v_p >= K_0, K.
[[nodiscard]] SCurveShape shape_of_peak(const SCurveFamily& family, double v_p) noexcept;

/// X of a member.
[[nodiscard]] double distance_of(const SCurveFamily& family, const SCurveShape& shape) noexcept;

[[nodiscard]] SCurvePhases phases_of(const SCurveFamily& family, const SCurveShape& shape) noexcept;

/// The fastest motion, wherever it ends: one extreme of the acceleration.
[[nodiscard]] SCurvePhases fastest_velocity_change(const SCurveProblem& problem) noexcept;

/// The fastest motion. The problem's ends keep its limits and can do so further on.
[[nodiscard]] SCurvePhases fastest_motion(const SCurveProblem& problem) noexcept;

/// Whether a motion of exactly the duration T exists.
[[nodiscard]] bool has_duration(const SCurveProblem& problem, double T) noexcept;

/// The shortest duration of at least T that a motion can take.
[[nodiscard]] double next_duration(const SCurveProblem& problem, double T) noexcept;

}  // namespace flyball::detail
