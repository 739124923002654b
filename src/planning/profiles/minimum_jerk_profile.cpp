#include <flyball/planning/profiles/minimum_jerk_profile.hpp>

#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "planning/profiles/s_curve_problem.hpp"

namespace flyball {

namespace {

/// Σ c_k t^k of degree n.
double value(const double* c, int n, double t) {
  double y = c[n];
  for (int k = n - 1; k >= 0; --k) {
    y = y * t + c[k];
  }
  return y;
}

void differentiate(const double* c, int n, double* d) {
  for (int k = 1; k <= n; ++k) {
    d[k - 1] = k * c[k];
  }
}

/// Where a polynomial of degree n is zero in (0, T), between the places where its derivative is.
int roots(const double* c, int n, double T, double* at) {
  if (n == 1) {
    const double t = -c[0] / c[1];
    at[0] = t;
    return t > 0.0 && t < T ? 1 : 0;
  }
  double d[5];
  double turns[5];
  differentiate(c, n, d);
  const int count = roots(d, n - 1, T, turns);
  turns[count] = T;
  int found = 0;
  double from = 0.0;
  for (int i = 0; i <= count; ++i) {
    double low = from;
    double high = turns[i];
    const bool rises = value(c, n, high) > value(c, n, low);
    from = high;
    if ((value(c, n, low) > 0.0) == (value(c, n, high) > 0.0)) {
      continue;
    }
    // Newton's method, and halves where it leaves the interval.
    double t = 0.5 * (low + high);
    for (int k = 0; k < 60; ++k) {
      const double y = value(c, n, t);
      ((y > 0.0) == rises ? high : low) = t;
      const double next = t - y / value(d, n - 1, t);
      const double last = t;
      t = next > low && next < high ? next : 0.5 * (low + high);
      if (std::abs(t - last) <= 1e-14 * T) {
        break;
      }
    }
    at[found++] = t;
  }
  return found;
}

/// All minimum-jerk motions from one state to another: at s = t/T the place is
/// (P_0 + T P_1 + T² P_2)(s), of which the nth derivative by t is that by s over T^n.
struct Family {
  double part[3][4][6];  ///< Of P_i the nth derivative's coefficients, of degree 5 - n.
};

Family family_of(const MotionState& start, const MotionState& goal) {
  const double d = goal.position - start.position;
  const double v_0 = start.velocity;
  const double v_f = goal.velocity;
  const double a_0 = start.acceleration;
  const double a_f = goal.acceleration;
  Family f{{{{0.0, 0.0, 0.0, 10.0 * d, -15.0 * d, 6.0 * d}},
            {{0.0, v_0, 0.0, -6.0 * v_0 - 4.0 * v_f, 8.0 * v_0 + 7.0 * v_f, -3.0 * (v_0 + v_f)}},
            {{0.0, 0.0, 0.5 * a_0, 0.5 * a_f - 1.5 * a_0, 1.5 * a_0 - a_f, 0.5 * (a_f - a_0)}}}};
  for (auto& part : f.part) {
    for (int n = 1; n < 4; ++n) {
      differentiate(part[n - 1], 6 - n, part[n]);
    }
  }
  return f;
}

constexpr double within = 1.0 + 1e-9;
constexpr double aim = 1.0 + 0.99e-9;  // what the search comes up to, from beyond

/// By how much a duration breaks the limits at worst (1 keeps them just so), and up to which one
/// they are sure to stay broken; infinite: there is none that keeps them.
struct Look {
  double excess = 0.0;
  double next = 0.0;
};

/// The first u > 0 at which c_0 + c_1 u + c_2 u² falls to zero, c_0 > 0; infinite if it does not.
double first_root(double c_0, double c_1, double c_2) {
  const double discriminant = c_1 * c_1 - 4.0 * c_0 * c_2;
  if (!(c_2 < 0.0) && !(c_1 < 0.0 && discriminant >= 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  const double root = std::sqrt(discriminant);
  return c_1 <= 0.0 ? 2.0 * c_0 / (root - c_1) : (c_1 + root) / (-2.0 * c_2);
}

/// A u > 0 up to which c_0 + c_1 u + c_2 u² - c_3 u³ has not fallen to zero, c_0, c_3 > 0: the root
/// without the terms that rise, by Newton's method from above, where that is concave.
double before_root(double c_0, double c_1, double c_2, double c_3) {
  const double b = std::min(c_1, 0.0);
  const double c = std::min(c_2, 0.0);
  double u = std::cbrt(c_0 / c_3);
  u = b < 0.0 ? std::min(u, -c_0 / b) : u;
  u = c < 0.0 ? std::min(u, std::sqrt(-c_0 / c)) : u;
  for (int i = 0; i < 8; ++i) {
    const double y = c_0 + (b + (c - c_3 * u) * u) * u;
    const double step = y / (b + (2.0 * c - 3.0 * c_3 * u) * u);
    u -= step;
    if (!(step > 1e-9 * u)) {
      break;
    }
  }
  return u;
}

/// A limit that is broken at a place s = t/T stays broken there until a polynomial of T says
/// otherwise; so the durations up to the last of these cannot keep them all. The largest excess of
/// a family by T has the slope of that at its place, so going from one to the next converges like
/// Newton's method, to the shortest duration that keeps the limits, never past it.
Look look_at(const Family& f, const MotionLimits& all, double T) {
  double sum[5][6];
  for (int k = 0; k < 6; ++k) {
    sum[0][k] = f.part[0][0][k] + T * (f.part[1][0][k] + T * f.part[2][0][k]);
  }
  for (int n = 1; n < 5; ++n) {
    differentiate(sum[n - 1], 6 - n, sum[n]);
  }
  const double high[] = {0.0, all.velocity, all.acceleration, all.jerk};
  const double low[] = {0.0, all.reverse_velocity, all.deceleration, all.jerk};
  const double power[] = {1.0, T, T * T, T * T * T};
  Look look{0.0, T};
  const auto see = [&](int n, double s) {
    const double y = value(sum[n], 5 - n, s);
    const double sign = y > 0.0 ? 1.0 : -1.0;
    double limit = y > 0.0 ? high[n] : low[n];
    const double excess = std::abs(y) / (limit * power[n]);
    look.excess = std::max(look.excess, excess);
    if (!(excess > within)) {
      return;
    }
    // ±(P_0 + T P_1 + T² P_2) - L T^n by what T grows.
    limit *= aim;
    const double c_0 = std::abs(y) - limit * power[n];
    const double c_2 = sign * value(f.part[2][n], 5 - n, s);
    const double c_1 = sign * value(f.part[1][n], 5 - n, s) + 2.0 * T * c_2;
    const double u =
        n == 1   ? first_root(c_0, c_1 - limit, c_2)
        : n == 2 ? first_root(c_0, c_1 - 2.0 * limit * T, c_2 - limit)
                 : before_root(c_0, c_1 - 3.0 * limit * T * T, c_2 - 3.0 * limit * T, limit);
    look.next = std::max(look.next, T + u);
  };
  for (int n = 1; n < 4; ++n) {
    if (std::isinf(high[n]) && std::isinf(low[n])) {
      continue;
    }
    see(n, 0.0);
    see(n, 1.0);
    double at[4];
    for (int i = roots(sum[n + 1], 4 - n, 1.0, at); i-- > 0;) {
      see(n, at[i]);
    }
  }
  return look;
}

}  // namespace

void MinimumJerkProfile::set(double duration, const MotionState& start,
                             const MotionState& goal) noexcept {
  end_ = duration;
  const double T = duration;
  c_[0] = start.position;
  c_[1] = start.velocity;
  c_[2] = 0.5 * start.acceleration;
  // What is left over the parabola of the start; places differ by what has all of its digits.
  const double x = (goal.position - start.position) - (c_[1] + c_[2] * T) * T;
  const double v = (goal.velocity - (c_[1] + 2.0 * c_[2] * T)) * T;
  const double a = (goal.acceleration - 2.0 * c_[2]) * T * T;
  const double per = 1.0 / (T * T * T);
  c_[3] = (10.0 * x - 4.0 * v + 0.5 * a) * per;
  c_[4] = (-15.0 * x + 7.0 * v - a) * per / T;
  c_[5] = (6.0 * x - 3.0 * v + 0.5 * a) * per / (T * T);
}

MinimumJerkProfile::MinimumJerkProfile(const MotionLimits& limits, const MotionState& start,
                                       const MotionState& goal) noexcept
    : limits_(limits), goal_(goal) {
  if (!detail::is_usable(limits, start, goal)) {
    goal_ = {std::isfinite(goal.position) ? goal.position : 0.0, 0.0, 0.0};
    c_[0] = goal_.position;
    keeps_limits_ = false;
    return;
  }
  const MotionLimits all = limits.both_ways();
  const double d = std::abs(goal.position - start.position);
  c_[0] = start.position;
  c_[1] = start.velocity;
  c_[2] = 0.5 * start.acceleration;
  if (d == 0.0 && start.velocity == goal.velocity && start.acceleration == goal.acceleration) {
    return;  // it is there
  }
  // No motion is faster than these.
  const double v_most = std::max(all.velocity, all.reverse_velocity);
  const double a_most = std::max(all.acceleration, all.deceleration);
  double least = std::max({d / v_most, std::abs(goal.velocity - start.velocity) / a_most,
                           std::abs(goal.acceleration - start.acceleration) / all.jerk});
  // Where they say nothing, or little: a fraction of the times in which the limits turn it round.
  double turn =
      std::max({std::sqrt(d / a_most), std::cbrt(d / all.jerk),
                std::max(std::abs(start.velocity), std::abs(goal.velocity)) / a_most,
                std::max(std::abs(start.acceleration), std::abs(goal.acceleration)) / all.jerk});
  turn = turn > 0.0 ? turn : 1.0;
  least = std::max(least, 1e-9 * turn);
  const Family family = family_of(start, goal);
  double best = least;
  Look look = look_at(family, all, best);
  constexpr int most_steps = 200;
  for (int i = 0; i < most_steps && look.excess > within && std::isfinite(look.next); ++i) {
    best = std::max(look.next, best * (1.0 + 1e-15));
    look = look_at(family, all, best);
  }
  keeps_limits_ = look.excess <= within;
  if (!keeps_limits_) {
    constexpr double growth = 1.3;
    constexpr int most_growths = 60;
    double least_excess = std::numeric_limits<double>::infinity();
    double T = std::max(least, 1e-3 * turn);
    for (int i = 0; i < most_growths; ++i, T *= growth) {
      const double excess = look_at(family, all, T).excess;
      if (excess < least_excess) {
        least_excess = excess;
        best = T;
      }
    }
  }
  set(best, start, goal);
  bool finite = std::isfinite(best);
  for (const double c : c_) {
    finite = finite && std::isfinite(c);
  }
  if (!finite) {
    *this = with_duration(0.0, goal, goal);
    limits_ = limits;
    keeps_limits_ = false;
  }
}

MinimumJerkProfile MinimumJerkProfile::with_duration(double duration, const MotionState& start,
                                                     const MotionState& goal) noexcept {
  MinimumJerkProfile profile;
  profile.limits_ = {infinity, infinity, infinity, infinity, infinity};
  if (!detail::is_usable(profile.limits_, start, goal)) {
    profile.goal_ = {std::isfinite(goal.position) ? goal.position : 0.0, 0.0, 0.0};
    profile.c_[0] = profile.goal_.position;
    return profile;
  }
  profile.goal_ = goal;
  profile.c_[0] = goal.position;
  if (duration > 0.0 && duration <= detail::largest_motion &&
      duration >= 1.0 / detail::largest_motion) {
    profile.set(duration, start, goal);
  }
  return profile;
}

MotionState MinimumJerkProfile::sample(double t) const noexcept {
  if (t >= end_) {
    const double past = std::isfinite(t) ? t - end_ : 0.0;
    const double position = goal_.position + goal_.velocity * past;
    return {std::isfinite(position) ? position : goal_.position, goal_.velocity,
            past > 0.0 ? 0.0 : goal_.acceleration};
  }
  const double s = t > 0.0 ? t : 0.0;
  return {value(c_, 5, s),
          c_[1] + s * (2.0 * c_[2] + s * (3.0 * c_[3] + s * (4.0 * c_[4] + s * 5.0 * c_[5]))),
          2.0 * c_[2] + s * (6.0 * c_[3] + s * (12.0 * c_[4] + s * 20.0 * c_[5]))};
}

double MinimumJerkProfile::jerk(double t) const noexcept {
  return t >= 0.0 && t < end_ ? 6.0 * c_[3] + t * (24.0 * c_[4] + t * 60.0 * c_[5]) : 0.0;
}

bool MinimumJerkProfile::reversible() const noexcept {
  const MotionLimits all = limits_.both_ways();
  return keeps_limits_ && all.velocity == all.reverse_velocity;
}

}  // namespace flyball
