#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>

#include "planning/profiles/profile_laws.hpp"

namespace flyball::test {

/// Time and way of a change of velocity at full effort.
struct FullEffort {
  long double time = 0.0L;
  long double way = 0.0L;

  FullEffort& operator+=(const FullEffort& more) {
    time += more.time;
    way += more.way;
    return *this;
  }
};

/// x'' = up or -down.
struct ConstantEffort {
  long double up;
  long double down;

  [[nodiscard]] FullEffort change(long double v, long double w) const {
    const long double a = w >= v ? up : -down;
    return {(w - v) / a, (w * w - v * v) / (2.0L * a)};
  }
};

/// |x''| = A √(1 - |v|/V), and A beyond V. With s = √(1 - |v|/V) time is 2 V s/A and the way
/// 2 V²/A (s - s³/3) from the speed V.
struct ParabolicEffort {
  long double V;
  long double A;

  [[nodiscard]] FullEffort change(long double v, long double w) const {
    if (v * w < 0.0L) {
      FullEffort both = change(v, 0.0L);
      return both += change(0.0L, w);
    }
    const long double sign = v + w < 0.0L ? -1.0L : 1.0L;
    long double fast = std::max(std::abs(v), std::abs(w));
    const long double slow = std::min(std::abs(v), std::abs(w));
    FullEffort sum;
    if (fast > V) {
      sum = {(fast - V) / A, sign * (fast * fast - V * V) / (2.0L * A)};
      fast = V;
    }
    const long double s = std::sqrt(1.0L - slow / V);
    const long double t = std::sqrt(1.0L - fast / V);
    return sum += {2.0L * V / A * (s - t),
                   sign * 2.0L * V * V / A * (s - t - (s * s * s - t * t * t) / 3.0L)};
  }
};

/// x'' = (u - kS sgn v - kG - kV v)/kA with |u| <= U and |u - kV v| <= U_I.
struct MotorEffort {
  MotorMotionLimits motor;

  [[nodiscard]] FullEffort change(long double v, long double w) const {
    const long double up = w >= v ? 1.0L : -1.0L;
    const long double corner =
        up * (static_cast<long double>(motor.voltage) - motor.current_voltage) / motor.kV;
    // Between these the law is one formula.
    long double edges[] = {0.0L, corner};
    if (up * edges[0] > up * edges[1]) {
      std::swap(edges[0], edges[1]);
    }
    FullEffort sum;
    long double from = v;
    for (int i = 0; i < 3 && from != w; ++i) {
      const long double edge = i < 2 ? edges[i] : w;
      const long double to = up * edge < up * w ? edge : w;
      if (up * to > up * from) {
        sum += smooth(from, to, up);
        from = to;
      }
    }
    return sum;
  }

 private:
  [[nodiscard]] FullEffort smooth(long double v, long double w, long double up) const {
    const long double middle = 0.5L * (v + w);
    const long double held = motor.kG + (middle > 0.0L ? motor.kS : -motor.kS);
    if (motor.current_voltage + up * motor.kV * middle < motor.voltage) {
      const long double a = (up * motor.current_voltage - held) / motor.kA;
      return {(w - v) / a, (w * w - v * v) / (2.0L * a)};
    }
    const long double end = (up * motor.voltage - held) / motor.kV;  // where the velocity goes
    const long double tau = static_cast<long double>(motor.kA) / motor.kV;
    const long double time = tau * std::log1p((w - v) / (end - w));
    return {time, end * time - tau * (w - v)};
  }
};

/// The least time in which full effort up and down, with a cruise at the limit between, goes over
/// `d`: by bisection over the velocity between the two, of both signs and all branches. That one of
/// these is the fastest motion is the maximum principle's (one switch, a boundary arc between).
/// Infinite: none does.
/// @param high, low  Limits of the velocity, as sizes.
template <class Effort>
long double fastest_duration(const Effort& effort, long double high, long double low, long double d,
                             long double v_0, long double v_f) {
  long double best = std::numeric_limits<long double>::infinity();
  for (const long double sign : {1.0L, -1.0L}) {
    const long double most = sign > 0.0L ? high : low;
    const auto by = [&](long double peak) {
      FullEffort sum = effort.change(v_0, sign * peak);
      sum += effort.change(sign * peak, v_f);
      return FullEffort{sum.time, sign * sum.way};
    };
    const long double way = sign * d;
    const FullEffort top = by(most);
    const long double exact =
        1e-18L * (std::abs(d) + std::abs(effort.change(v_0, v_f).way) + 1e-30L);
    if (way >= top.way) {
      best = std::min(best, top.time + (way - top.way) / most);
    }
    // The way grows with a positive peak and falls with a negative one.
    const long double least = std::max(std::min(sign * v_0, most), sign * v_f);
    for (const bool rises : {true, false}) {
      long double near = rises ? std::max(0.0L, least) : std::min(0.0L, least);
      long double far = rises ? most : 0.0L;
      if (!rises) {
        std::swap(near, far);
      }
      if (!rises && least >= 0.0L) {
        continue;
      }
      long double below = by(near).way - way;
      long double above = by(far).way - way;
      if (below > 0.0L || above < 0.0L) {
        continue;
      }
      // Regula falsi, halved where it holds on to an end (the Illinois algorithm).
      for (int i = 0; i < 200 && near != far; ++i) {
        long double middle = (near * above - far * below) / (above - below);
        if (i % 8 == 7 || !(middle >= std::min(near, far) && middle <= std::max(near, far))) {
          middle = 0.5L * (near + far);
        }
        const long double miss = by(middle).way - way;
        if (std::abs(miss) <= exact || middle == near || middle == far) {
          near = far = middle;
        } else if (miss < 0.0L) {
          above *= (near != middle && i > 0) ? 0.5L : 1.0L;
          near = middle;
          below = miss;
        } else {
          below *= (far != middle && i > 0) ? 0.5L : 1.0L;
          far = middle;
          above = miss;
        }
      }
      // Where the peak has too few digits for its way, the rest is cruised: dT = dx/c.
      const FullEffort found = by(near);
      const long double rest = way - found.way;
      best = std::min(best, found.time + (std::abs(rest) > exact ? rest / near : 0.0L));
    }
  }
  return best;
}

/// Whether a duration is the fastest, within 1e-9 and what the rounding of places makes of it; in
/// words if it is not.
template <class Effort>
std::string broken_optimality(double duration, const Effort& effort, double high, double low,
                              const MotionState& start, const MotionState& goal) {
  const long double d =
      static_cast<long double>(goal.position) - static_cast<long double>(start.position);
  const auto fastest = [&](long double way) {
    return static_cast<double>(
        fastest_duration(effort, high, low, way, start.velocity, goal.velocity));
  };
  constexpr double rel = 1e-9;
  const double best = fastest(d);
  if (std::abs(duration - best) <= rel * best) {
    return {};
  }
  // Of a place that is known to some ulps: the times of those around it. They jump where a goal
  // that moves is just missed.
  const double v_size = std::max(std::abs(start.velocity), std::abs(goal.velocity));
  const long double ulps = 8e-15L * (std::abs(start.position) + std::abs(goal.position)) +
                           4e-15L * std::abs(effort.change(start.velocity, goal.velocity).way) +
                           4e-15L * v_size * best;
  double least = best;
  double most = best;
  for (const long double by : {-ulps, -0.5L * ulps, 0.5L * ulps, ulps}) {
    const double other = fastest(d + by);
    least = std::min(least, other);
    most = std::max(most, other);
  }
  if (duration >= least * (1.0 - rel) && duration <= most * (1.0 + rel)) {
    return {};
  }
  char text[200];
  std::snprintf(text, sizeof text, "fastest: %.17g s, taken %.17g (rounding: %.17g to %.17g)", best,
                duration, least, most);
  return text;
}

/// A shorter fifth-degree polynomial that keeps the limits, in words; looked for by samples alone,
/// at `tries` shorter durations.
inline std::string shorter_polynomial(const MinimumJerkProfile& profile,
                                      const ProfileDemand& demand, int tries) {
  const MotionLimits all = demand.limits.both_ways();
  const double end = profile.total_time();
  for (int k = 0; k < tries; ++k) {
    // Near the duration that was found, and down to nothing.
    const double T = end * (1.0 - std::pow(1e-3, 1.0 - (k + 0.5) / tries));
    const MinimumJerkProfile other =
        MinimumJerkProfile::with_duration(T, demand.start, demand.goal);
    double excess = 0.0;
    constexpr int samples = 200;
    for (int i = 0; i <= samples && excess < 1.0 - 1e-3; ++i) {
      const double t = T * (1.0 - 1e-15) * i / samples;
      const MotionState at = other.sample(t);
      excess = std::max({excess, at.velocity / all.velocity, -at.velocity / all.reverse_velocity,
                         at.acceleration / all.acceleration, -at.acceleration / all.deceleration,
                         std::abs(other.jerk(t)) / all.jerk});
    }
    if (excess < 1.0 - 1e-3) {
      char text[160];
      std::snprintf(text, sizeof text, "%.17g s keep the limits (%.6g of them), taken %.17g", T,
                    excess, end);
      return text;
    }
  }
  return {};
}

}  // namespace flyball::test
