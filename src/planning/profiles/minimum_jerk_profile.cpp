#include <flyball/planning/profiles/minimum_jerk_profile.hpp>

#include <algorithm>
#include <cmath>

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

}  // namespace

void MinimumJerkProfile::set(double duration, const MotionState& start,
                             const MotionState& goal) noexcept {
  end_ = duration;
  const double T = duration;
  c_[0] = start.position;
  c_[1] = start.velocity;
  c_[2] = 0.5 * start.acceleration;
  // What is left over the parabola of the start.
  const double x = goal.position - (c_[0] + (c_[1] + c_[2] * T) * T);
  const double v = (goal.velocity - (c_[1] + 2.0 * c_[2] * T)) * T;
  const double a = (goal.acceleration - 2.0 * c_[2]) * T * T;
  const double per = 1.0 / (T * T * T);
  c_[3] = (10.0 * x - 4.0 * v + 0.5 * a) * per;
  c_[4] = (-15.0 * x + 7.0 * v - a) * per / T;
  c_[5] = (6.0 * x - 3.0 * v + 0.5 * a) * per / (T * T);
}

double MinimumJerkProfile::excess() const noexcept {
  const MotionLimits all = limits_.both_ways();
  double v[5];
  double a[4];
  double j[3];
  double s[2];
  differentiate(c_, 5, v);
  differentiate(v, 4, a);
  differentiate(a, 3, j);
  differentiate(j, 2, s);
  double worst = 0.0;
  const auto look = [&](const double* c, int n, double t, double high, double low) {
    const double y = value(c, n, t);
    worst = std::max(worst, y > 0.0 ? y / high : -y / low);
  };
  double at[4];
  for (const double t : {0.0, end_}) {
    look(v, 4, t, all.velocity, all.reverse_velocity);
    look(a, 3, t, all.acceleration, all.deceleration);
    look(j, 2, t, all.jerk, all.jerk);
  }
  for (int i = roots(a, 3, end_, at); i-- > 0;) {
    look(v, 4, at[i], all.velocity, all.reverse_velocity);
  }
  for (int i = roots(j, 2, end_, at); i-- > 0;) {
    look(a, 3, at[i], all.acceleration, all.deceleration);
  }
  for (int i = roots(s, 1, end_, at); i-- > 0;) {
    look(j, 2, at[i], all.jerk, all.jerk);
  }
  return worst;
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
  if (d == 0.0 && start.velocity == 0.0 && goal.velocity == 0.0 && start.acceleration == 0.0 &&
      goal.acceleration == 0.0) {
    return;
  }
  // No motion is faster than these, and none at rest needs more than the sum of its three.
  const double v_most = std::max(all.velocity, all.reverse_velocity);
  const double a_most = std::max(all.acceleration, all.deceleration);
  const double least = std::max({d / v_most, std::abs(goal.velocity - start.velocity) / a_most,
                                 std::abs(goal.acceleration - start.acceleration) / all.jerk,
                                 1e-9 * (v_most / a_most)});
  constexpr double within = 1.0 + 1e-9;
  constexpr double growth = 1.15;
  constexpr int most_growths = 90;
  double bad = least;
  double best = least;
  double best_excess = std::numeric_limits<double>::infinity();
  double T = least;
  bool found = false;
  for (int i = 0; i < most_growths && !found; ++i, T *= growth) {
    set(T, start, goal);
    const double now = excess();
    found = now <= within;
    if (now < best_excess) {
      best_excess = now;
      best = T;
    }
    if (found) {
      best = T;
    } else {
      bad = T;
    }
  }
  // The border between the last that does not and the first that does.
  for (int i = 0; found && i < 60 && bad < best * (1.0 - 1e-15); ++i) {
    const double middle = 0.5 * (bad + best);
    set(middle, start, goal);
    (excess() <= within ? best : bad) = middle;
  }
  keeps_limits_ = found;
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
  const double infinity = std::numeric_limits<double>::infinity();
  profile.limits_ = {infinity, infinity, infinity, infinity, infinity};
  profile.goal_ = goal;
  profile.c_[0] = goal.position;
  if (duration > 0.0 && detail::is_usable(profile.limits_, start, goal) &&
      duration <= detail::largest_motion && duration >= 1.0 / detail::largest_motion) {
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
