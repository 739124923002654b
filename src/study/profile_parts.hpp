#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <flyball/planning/profiles/exponential_profile.hpp>
#include <flyball/planning/profiles/minimum_jerk_profile.hpp>
#include <flyball/planning/profiles/parabolic_profile.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

namespace flyball::study {

/// From no to full acceleration, s, where nothing is said of it.
inline double default_ramp(const MotionLimits& limits) {
  return 0.25 * limits.velocity / limits.acceleration;
}

inline std::vector<double> changes_of(const TrapezoidProfile& profile) {
  return {0.0, profile.phase_ends()[0], profile.phase_ends()[1]};
}
inline std::vector<double> changes_of(const StepperProfile& profile) {
  return {0.0, profile.phase_ends()[0], profile.phase_ends()[1]};
}
inline std::vector<double> changes_of(const MinimumJerkProfile& /*profile*/) {
  return {0.0};
}
inline std::vector<double> changes_of(const JerkMotion& motion) {
  std::vector<double> all;
  for (int i = 0; i < motion.pieces(); ++i) {
    all.push_back(motion.piece(i).begin);
  }
  return all;
}
inline std::vector<double> changes_of(const ExponentialProfile& profile) {
  // Near the top speed a peak has too few digits for its way, and some 1e-14 s are cruised.
  const double rounding = 1e-12 * profile.total_time();
  std::vector<double> all;
  for (int i = 0; i < profile.pieces(); ++i) {
    const double end = i + 1 < profile.pieces() ? profile.piece_begin(i + 1) : profile.total_time();
    if (end - profile.piece_begin(i) > rounding) {
      all.push_back(profile.piece_begin(i));
    }
  }
  return all;
}

/// Where to look at a motion to draw it: a few hundred times, and both sides of each change.
/// @param changes  s. @param end  s, its duration.
inline std::vector<double> drawn_times(std::vector<double> changes, double end) {
  constexpr double points = 300.0;
  const double before = 1e-9 * end;
  changes.push_back(0.0);
  changes.push_back(end);
  std::sort(changes.begin(), changes.end());
  std::vector<double> times;
  double from = 0.0;
  for (const double to : changes) {
    if (!(to > from + 2.0 * before)) {
      continue;
    }
    const double count = std::ceil((to - from) / end * points) + 1.0;
    for (double k = 0.0; k < count; ++k) {
      times.push_back(from + (to - before - from) * k / count);
    }
    times.push_back(to - before);
    from = to;
  }
  times.push_back(end);
  return times;
}

}  // namespace flyball::study
