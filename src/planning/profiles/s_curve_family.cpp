#include <algorithm>
#include <cmath>

#include "planning/profiles/s_curve_family.hpp"

namespace flyball::detail {

namespace {

constexpr int max_iterations = 60;

double square(double x) {
  return x * x;
}

}  // namespace

SCurveFamily family_of(const SCurveProblem& p, bool mirrored) noexcept {
  const double sign = mirrored ? -1.0 : 1.0;
  SCurveFamily f;
  f.a_0 = sign * p.a_0;
  f.a_f = sign * p.a_f;
  f.K_0 = sign * p.v_0 - 0.5 * f.a_0 * f.a_0;
  f.K = sign * p.v_f - 0.5 * f.a_f * f.a_f;
  f.E = f.K - f.K_0;
  // A ramp from zero acceleration at K_0 has come K_0 a + a³/6 far at the acceleration a.
  f.X = sign * p.distance + (f.K_0 + f.a_0 * f.a_0 / 6.0) * f.a_0 -
        (f.K + f.a_f * f.a_f / 6.0) * f.a_f;
  f.up = mirrored ? p.down : p.up;
  f.down = mirrored ? p.up : p.down;
  f.v_max = mirrored ? p.low : p.high;
  f.v_min = mirrored ? p.high : p.low;
  f.slack = p.slack;
  f.mirrored = mirrored;
  return f;
}

SCurveFamily reversed(const SCurveFamily& f) noexcept {
  SCurveFamily r = f;
  std::swap(r.K_0, r.K);
  r.a_0 = -f.a_f;
  r.a_f = -f.a_0;
  std::swap(r.up, r.down);
  r.E = -f.E;
  r.reversed = !f.reversed;
  return r;
}

SCurveFamily mirrored(const SCurveFamily& f) noexcept {
  SCurveFamily m = f;
  m.a_0 = -f.a_0;
  m.a_f = -f.a_f;
  m.K_0 = -f.K_0 - f.a_0 * f.a_0;
  m.K = -f.K - f.a_f * f.a_f;
  m.E = m.K - m.K_0;
  m.X = -f.X + f.a_0 * (2.0 * f.K_0 + f.a_0 * f.a_0) - f.a_f * (2.0 * f.K + f.a_f * f.a_f);
  std::swap(m.up, m.down);
  std::swap(m.v_max, m.v_min);
  m.mirrored = !f.mirrored;
  return m;
}

SCurveShape shape_of_peak(const SCurveFamily& f, double v_p) noexcept {
  SCurveShape s;
  s.v_p = v_p;
  const double rise = std::max(0.0, v_p - f.K_0);
  const double fall = std::max(0.0, v_p - f.K);
  s.a_1 = f.up;
  if (rise <= f.up * f.up) {
    s.a_1 = std::sqrt(rise);
  } else {
    s.hold_1 = rise / f.up - f.up;
  }
  s.b = -f.down;
  if (fall <= f.down * f.down) {
    s.b = -std::sqrt(fall);
  } else {
    s.hold_2 = fall / f.down - f.down;
  }
  return s;
}

double distance_of(const SCurveFamily& f, const SCurveShape& s) noexcept {
  return 0.5 * (f.K_0 + s.v_p) * (2.0 * s.a_1 + s.hold_1) + s.v_p * s.cruise +
         0.5 * (s.v_p + f.K) * (s.hold_2 - 2.0 * s.b);
}

SCurveShape shape_at(const SCurveFamily& f, double T) noexcept {
  const double A = f.up;
  const double D = f.down;
  SCurveShape s;
  // No hold: a_1 - b = T/2, a_1² - b² = E.
  const double tau = 0.5 * T;
  const double sum = tau > 0.0 ? f.E / tau : 0.0;
  s.a_1 = 0.5 * (sum + tau);
  s.b = 0.5 * (sum - tau);
  const bool too_high = s.a_1 > A;
  const bool too_low = s.b < -D;
  bool both = too_high && too_low;
  if (too_high) {
    // t_2 = (E + b²)/A - A, so b² - 2 A b + A² + E - A T = 0.
    const double b = A - std::sqrt(std::max(0.0, A * T - f.E));
    if (b >= -D) {
      s.a_1 = A;
      s.b = b;
      s.hold_1 = std::max(0.0, (f.E + b * b) / A - A);
      both = false;
    } else {
      both = true;
    }
  }
  if (too_low && (both || !too_high)) {
    const double a_1 = std::sqrt(std::max(0.0, D * T + f.E)) - D;
    if (a_1 <= A) {
      s.a_1 = a_1;
      s.b = -D;
      s.hold_2 = std::max(0.0, (a_1 * a_1 - f.E) / D - D);
      both = false;
    } else {
      both = true;
    }
  }
  if (both) {
    // T = A + (v_p - K_0)/A + D + (v_p - K)/D.
    const double v_p = (A * D * (T - A - D) + D * f.K_0 + A * f.K) / (A + D);
    s.a_1 = A;
    s.b = -D;
    s.hold_1 = std::max(0.0, (v_p - f.K_0) / A - A);
    s.hold_2 = std::max(0.0, (v_p - f.K) / D - D);
  }
  s.v_p = f.E >= 0.0 ? f.K + s.b * s.b - s.b * s.hold_2 : f.K_0 + s.a_1 * (s.a_1 + s.hold_1);
  if (s.v_p > f.v_max && s.a_1 > 0.0 && s.b < 0.0) {
    s = shape_of_peak(f, f.v_max);
    s.cruise = std::max(0.0, T - s.time());
  }
  return s;
}

SCurvePhases phases_of(const SCurveFamily& f, const SCurveShape& s) noexcept {
  SCurvePhases p;
  p.t[0] = std::max(0.0, s.a_1 - f.a_0);
  p.t[1] = s.hold_1;
  if (s.a_1 >= 0.0 && s.b <= 0.0) {
    p.t[2] = s.a_1;
    p.t[3] = s.cruise;
    p.t[4] = -s.b;
  } else {
    p.t[2] = std::max(0.0, s.a_1 - s.b);
  }
  p.t[5] = s.hold_2;
  p.t[6] = std::max(0.0, f.a_f - s.b);
  p.sign = f.mirrored ? -1.0 : 1.0;
  if (f.reversed) {
    std::swap(p.t[0], p.t[6]);
    std::swap(p.t[1], p.t[5]);
    std::swap(p.t[2], p.t[4]);
  }
  return p;
}

namespace {

/// Whether going straight from one end's velocity and acceleration to the other's rises first.
bool rises_first(const SCurveProblem& p) {
  const double ramp = 0.5 * (p.a_f + p.a_0) * std::abs(p.a_f - p.a_0);
  return p.v_f - p.v_0 >= ramp;
}

/// The member whose last ramp has no length, b = a_f: the fastest change of the velocity.
SCurveShape direct(const SCurveFamily& f) {
  SCurveShape s;
  s.b = f.a_f;
  s.v_p = f.K + f.a_f * f.a_f;
  const double rise = std::max(0.0, s.v_p - f.K_0);
  s.a_1 = f.up;
  if (rise <= f.up * f.up) {
    s.a_1 = std::sqrt(rise);
  } else {
    s.hold_1 = rise / f.up - f.up;
  }
  return s;
}

/// a_1 = up and no hold at b: X(b) = (K_0 + K + b²)/2 (A + (E + b²)/A) - (2 K + b²) b, by Newton's
/// method in T = A + (E + b²)/A - 2 b from above, where X(T) is convex. Returns b.
double solve_first_hold(double K_0, double K, double A, double X, double b) {
  const double E = K - K_0;
  double T = A + (E + b * b) / A - 2.0 * b;
  for (int i = 0; i < max_iterations; ++i) {
    const double v_p = K + b * b;
    const double too_far = 0.5 * (K_0 + v_p) * (A + (E + b * b) / A) - (K + v_p) * b - X;
    const double step = too_far / (v_p - 0.5 * A * b);
    if (!(step > 0.0)) {
      break;
    }
    T -= step;
    b = A - std::sqrt(std::max(0.0, A * T - E));
    if (step <= 1e-9 * T) {  // the next would be its square
      break;
    }
  }
  // Once more, wherever it is.
  const double v_p = K + b * b;
  const double too_far = 0.5 * (K_0 + v_p) * (A + (E + b * b) / A) - (K + v_p) * b - X;
  const double slope = 2.0 * (b / A - 1.0) * (v_p - 0.5 * A * b);
  return slope != 0.0 ? b - too_far / slope : b;
}

/// The member that comes as far as X, of those that cross zero acceleration from one with the peak
/// `v_start` on, which does not come farther: X(T) is convex from there to the velocity limit.
SCurveShape solve_crossing(const SCurveFamily& f, double v_start) {
  const double A = f.up;
  const double D = f.down;
  SCurveShape top = shape_of_peak(f, f.v_max);
  const double at_top = distance_of(f, top);
  if (f.X >= at_top) {
    top.cruise = (f.X - at_top) / f.v_max;
    return top;
  }
  const double first = f.K_0 + A * A;  // where a_1 reaches its limit
  const double second = f.K + D * D;   // where b does
  const double both = std::max(first, second);
  if (both < f.v_max) {
    // (1/A + 1/D) v² + (A + D) v + A K_0 + D K - K_0²/A - K²/D = 2 X, times A D.
    const auto twice = [&](double v) {
      return D * (v - f.K_0) * (v + f.K_0) + A * (v - f.K) * (v + f.K) +
             A * D * (A * (f.K_0 + v) + D * (f.K + v));
    };
    const double target = 2.0 * A * D * f.X;
    if (both <= v_start || target >= twice(both)) {
      const double half = 0.5 * A * D;
      const double c = A * D * (A * f.K_0 + D * f.K) - D * f.K_0 * f.K_0 - A * f.K * f.K - target;
      const double root = std::sqrt(std::max(0.0, square(half * (A + D)) - (A + D) * c));
      double v = (root - half * (A + D)) / (A + D);
      // The constant is a difference of large numbers: one step makes up for it.
      const double slope = 2.0 * (A + D) * v + A * D * (A + D);
      v -= slope > 0.0 ? (twice(v) - target) / slope : 0.0;
      return shape_of_peak(f, std::clamp(v, both, f.v_max));
    }
  }
  const double one = std::min(first, second);
  SCurveShape knot;
  bool without_hold = true;
  if (one < f.v_max) {
    without_hold = false;
    if (one > v_start) {
      knot = shape_of_peak(f, one);
      without_hold = f.X <= distance_of(f, knot);
    }
  } else {
    knot = top;
  }
  if (without_hold) {
    // X = 2 C tau + tau³/4 - E²/(4 tau) with tau = a_1 - b and C = (K_0 + K)/2, from above.
    const double C = 0.5 * (f.K_0 + f.K);
    const double E2 = 0.25 * f.E * f.E;
    double tau = knot.a_1 - knot.b;
    // tau² >= |E| here, so tau³ + 8 C tau <= 4 X + |E| tau_0.
    const double right = std::max(0.0, 4.0 * f.X + std::abs(f.E) * std::sqrt(std::abs(f.E)));
    double bound = std::cbrt(right);
    if (C > 0.0) {
      bound = std::min(bound, right / (8.0 * C));
    } else {
      bound += std::sqrt(-8.0 * C);
    }
    tau = std::min(tau, std::max(bound, std::sqrt(std::abs(f.E))));
    for (int i = 0; i < max_iterations && tau > 0.0; ++i) {
      const double per = 1.0 / tau;
      const double too_far = (2.0 * C + 0.25 * tau * tau) * tau - E2 * per - f.X;
      const double slope = 2.0 * C + 0.75 * tau * tau + E2 * per * per;
      const double step = too_far / slope;
      if (!(std::abs(step) > 1e-16 * tau)) {
        break;
      }
      tau -= step;
      if (std::abs(step) < 1e-8 * tau) {
        break;
      }
    }
    SCurveShape s;
    const double sum = tau > 0.0 ? f.E / tau : 0.0;
    s.a_1 = 0.5 * (sum + tau);
    s.b = 0.5 * (sum - tau);
    s.v_p = f.E >= 0.0 ? f.K + s.b * s.b : f.K_0 + s.a_1 * s.a_1;
    return s;
  }
  SCurveShape s;
  const double end = std::min(both, f.v_max);
  if (first <= second) {
    s.a_1 = A;
    s.b = solve_first_hold(f.K_0, f.K, A, f.X, -std::sqrt(std::max(0.0, end - f.K)));
    s.hold_1 = std::max(0.0, (f.E + s.b * s.b) / A - A);
    s.v_p = f.K + s.b * s.b;
  } else {
    s.b = -D;
    s.a_1 = -solve_first_hold(f.K, f.K_0, D, f.X, -std::sqrt(std::max(0.0, end - f.K_0)));
    s.hold_2 = std::max(0.0, (s.a_1 * s.a_1 - f.E) / D - D);
    s.v_p = f.K_0 + s.a_1 * s.a_1;
  }
  return s;
}

double slope_of(const SCurveShape& s) {
  return s.v_p - 0.5 * s.a_1 * s.b;
}

/// Where X(T) turns from concave to convex among the members with b > 0 (E >= 0).
double inflexion(const SCurveFamily& f) {
  const double A = f.up;
  constexpr double ratio = 0.26794919243112270647;  // b/a_1 = 2 - √3 without a hold
  const double b_join = A * A > f.E ? std::sqrt(A * A - f.E) : 0.0;
  if (b_join >= ratio * A) {
    return 2.0 * std::sqrt(f.E / std::sqrt(3.0));
  }
  const double b = std::max(b_join, 0.25 * A);
  return A + (f.E + b * b) / A - 2.0 * b;
}

/// The first T in [from, to], members with b > 0, where X(T) comes up to X; X(from) <= X.
/// @return Whether there is one.
bool solve_one_sign(const SCurveFamily& f, double from, double to, SCurveShape& s) {
  const double turn = std::clamp(inflexion(f), from, to);
  double T = from;
  for (int i = 0; i < max_iterations && T < turn; ++i) {
    s = shape_at(f, T);
    const double missing = f.X - distance_of(f, s);
    const double slope = slope_of(s);
    if (missing <= 0.0) {
      return true;
    }
    if (!(slope > 0.0)) {
      break;  // the highest place before the turn is lower
    }
    const double step = missing / slope;
    if (step <= 4e-16 * T) {
      return true;
    }
    T += step;
  }
  if (T <= turn && T > from) {
    s = shape_at(f, T);
    if (std::abs(f.X - distance_of(f, s)) <= f.slack) {
      return true;
    }
  }
  // Convex: at most one, and Newton's method comes down to it.
  T = to;
  s = shape_at(f, T);
  double too_far = distance_of(f, s) - f.X;
  if (too_far < -f.slack) {
    return false;
  }
  for (int i = 0; i < max_iterations && too_far > 0.0; ++i) {
    const double step = too_far / slope_of(s);
    if (!(step > 4e-16 * T) || T - step < turn) {
      break;
    }
    T -= step;
    s = shape_at(f, T);
    too_far = distance_of(f, s) - f.X;
  }
  return true;
}

/// What rounding of the ends makes of the distance of a member.
double slack_of(const SCurveFamily& f, const SCurveShape& s) {
  return f.slack + 4e-14 * (std::abs(f.K_0) + std::abs(s.v_p) + std::abs(f.K)) *
                       (2.0 * std::abs(s.a_1) + 2.0 * std::abs(s.b) + s.hold_1 + s.hold_2);
}

/// The same where an extreme of the acceleration, `root`, is the root of a difference of
/// velocities.
double root_slack(const SCurveFamily& f, const SCurveShape& s, double root) {
  const double rounding = 4e-15 * (square(f.a_0) + square(f.a_f) + std::abs(f.K_0) + std::abs(f.K));
  return 2.0 * std::abs(slope_of(s)) * rounding / std::max(std::abs(root), std::sqrt(rounding));
}

/// A single ramp from the one acceleration to the other, if that makes the whole change of the
/// velocity; else a duration below zero. Rounding of the velocity would have made two more phases
/// of it, as long as its root.
double single_ramp(const SCurveProblem& p) {
  const double t = std::abs(p.a_f - p.a_0);
  const double miss = p.v_f - p.v_0 - 0.5 * (p.a_f + p.a_0) * t;
  const double size = std::abs(p.v_f) + std::abs(p.v_0) + square(p.a_f) + square(p.a_0);
  return std::abs(miss) <= 4e-15 * size ? t : -1.0;
}

SCurvePhases ramp_phases(const SCurveProblem& p, double t) {
  SCurvePhases phases;
  phases.t[0] = t;
  phases.sign = p.a_f >= p.a_0 ? 1.0 : -1.0;
  return phases;
}

/// The first member, from the direct one on, that comes as far as X. The direct one does not.
SCurvePhases first_reaching(const SCurveFamily& f, const SCurveShape& start) {
  if (f.a_f <= 0.0) {
    return phases_of(f, solve_crossing(f, start.v_p));
  }
  // The acceleration need not cross zero: b from a_f down to zero, or to where a_1 = a_0, behind
  // which there is a gap: shorter than the next motion, too long to keep the acceleration's sign.
  const double a_0 = f.a_0;
  const bool gap = a_0 > 0.0 && a_0 * a_0 > f.E;
  const double b_end = gap ? std::sqrt(a_0 * a_0 - f.E) : 0.0;
  SCurveShape last;
  if (b_end < f.a_f) {
    last.b = b_end;
    const double rise = f.E + b_end * b_end;
    last.a_1 = std::min(f.up, std::sqrt(std::max(0.0, rise)));
    last.hold_1 = rise > f.up * f.up ? rise / f.up - f.up : 0.0;
    last.v_p = f.K + b_end * b_end;
    SCurveShape s;
    if (solve_one_sign(f, start.time(), last.time(), s)) {
      return phases_of(f, s);
    }
    if (gap &&
        std::abs(f.X - distance_of(f, last)) <= slack_of(f, last) + root_slack(f, last, last.b)) {
      return phases_of(f, last);
    }
  }
  if (!gap) {
    return phases_of(f, solve_crossing(f, f.K));
  }
  const SCurveShape again = shape_of_peak(f, f.K_0 + a_0 * a_0);
  const double beyond = f.X - distance_of(f, again);
  if (std::abs(beyond) <= slack_of(f, again) + root_slack(f, again, again.b)) {
    return phases_of(f, again);
  }
  if (beyond > 0.0) {
    return phases_of(f, solve_crossing(f, again.v_p));
  }
  // Behind the gap it is too far: the mirrored family, which crosses zero there.
  const SCurveFamily other = mirrored(f);
  return phases_of(other, solve_crossing(other, other.K + other.a_f * other.a_f));
}

/// The family in which K >= K_0: the acceleration keeps its sign in none but members with b > 0.
SCurveFamily rising(const SCurveFamily& f) {
  return f.E >= 0.0 ? f : reversed(f);
}

/// Between T_v, the fastest change of the velocity, and T = infinity there may be a gap.
bool velocity_fits(const SCurveFamily& f, const SCurveShape& s) {
  const double tolerance = 1e-14 * (f.up + f.down);
  return s.a_1 >= f.a_0 - tolerance && s.b <= f.a_f + tolerance;
}

/// The next T (of the family's time) at which X(T) comes up to X; now it is below.
double next_reaching(const SCurveFamily& f, double T) {
  const SCurveShape now = shape_at(f, T);
  if (now.b > 0.0) {
    const double a_0 = f.a_0;
    const bool gap = a_0 > 0.0 && a_0 * a_0 > f.E;
    SCurveShape last;
    last.b = gap ? std::sqrt(a_0 * a_0 - f.E) : 0.0;
    last.v_p = f.K + last.b * last.b;
    const double rise = last.v_p - f.K_0;
    last.a_1 = std::min(f.up, std::sqrt(std::max(0.0, rise)));
    last.hold_1 = std::max(0.0, rise / f.up - f.up);
    SCurveShape s;
    if (last.b < now.b && solve_one_sign(f, T, last.time(), s)) {
      return s.time();
    }
    if (gap) {
      return shape_of_peak(f, f.K_0 + a_0 * a_0).time();
    }
  }
  return solve_crossing(f, now.b > 0.0 ? f.K : now.v_p).time();
}

}  // namespace

SCurvePhases fastest_velocity_change(const SCurveProblem& p) noexcept {
  if (const double t = single_ramp(p); t >= 0.0) {
    return ramp_phases(p, t);
  }
  const SCurveFamily f = family_of(p, !rises_first(p));
  return phases_of(f, direct(f));
}

SCurvePhases fastest_motion(const SCurveProblem& p) noexcept {
  if (const double t = single_ramp(p); t >= 0.0) {
    const double covered = (p.v_0 + (p.a_0 / 3.0 + p.a_f / 6.0) * t) * t;
    const double size = (std::abs(p.v_0) + std::abs(p.v_f)) * t;
    if (std::abs(p.distance - covered) <= p.slack + 4e-15 * size) {
      return ramp_phases(p, t);
    }
  }
  const SCurveFamily f = family_of(p, !rises_first(p));
  const SCurveShape start = direct(f);
  const double beyond = f.X - distance_of(f, start);
  // Seldom so near that it is worth to say how near is near.
  const double size =
      (std::abs(f.K_0) + std::abs(start.v_p) + std::abs(f.K)) * (start.time() + f.up);
  if (std::abs(beyond) <= 1e-5 * (std::abs(f.X) + size) + f.slack &&
      std::abs(beyond) <= slack_of(f, start) + root_slack(f, start, start.a_1)) [[unlikely]] {
    return phases_of(f, start);
  }
  if (beyond > 0.0) {
    return first_reaching(f, start);
  }
  // The other sign's family begins with the same motion, whose first ramp has no length there.
  const SCurveFamily other = reversed(mirrored(f));
  return first_reaching(other, direct(other));
}

double next_duration(const SCurveProblem& p, double T) noexcept {
  T = std::max(T, fastest_velocity_change(p).duration());
  constexpr int most_intervals = 8;
  for (int i = 0; i < most_intervals; ++i) {
    bool fits = true;
    for (const bool mirror : {false, true}) {
      const SCurveFamily f = rising(family_of(p, mirror));
      const double extended = T + f.a_0 - f.a_f;
      const SCurveShape s = shape_at(f, extended);
      double next = extended;
      if (!velocity_fits(f, s)) {
        if (!(f.a_0 > 0.0 && f.a_f > 0.0)) {
          continue;  // the other sign's family tells where the gap ends
        }
        next = shape_of_peak(f, f.K_0 + f.a_0 * f.a_0).time();
      } else if (f.X - distance_of(f, s) > f.slack) {
        next = next_reaching(f, extended);
      }
      if (next > extended) {
        T += next - extended;
        fits = false;
      }
    }
    if (fits) {
      break;
    }
  }
  return T;
}

bool has_duration(const SCurveProblem& p, double T) noexcept {
  for (const bool mirror : {false, true}) {
    const SCurveFamily f = rising(family_of(p, mirror));
    const double extended = T + f.a_0 - f.a_f;
    const SCurveShape s = shape_at(f, extended);
    if (!(extended >= 0.0) || !velocity_fits(f, s) || f.X - distance_of(f, s) > f.slack) {
      return false;
    }
  }
  return true;
}

}  // namespace flyball::detail
