#include <flyball/planning/profiles/synchronized_motion.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <type_traits>

#include "planning/profiles/s_curve_problem.hpp"

namespace flyball {

namespace {

using detail::SCurveFamily;
using detail::SCurvePhases;
using detail::SCurvePlan;
using detail::SCurveProblem;
using detail::SCurveShape;

constexpr double jerks[7] = {1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0};

/// From an end's state to a velocity, without acceleration there, in the least time.
struct Half {
  double sign = 1.0;
  double ramp = 0.0;  ///< To the extreme of the acceleration.
  double hold = 0.0;
  double back = 0.0;  ///< From it to zero.
  double time = 0.0;
  double distance = 0.0;
  double slope = 0.0;  ///< Of distance - velocity·time by the velocity.
};

Half half_to(double velocity, double v, double a, double up, double down) {
  Half h;
  h.sign = velocity >= v + 0.5 * a * std::abs(a) ? 1.0 : -1.0;
  const double start = h.sign * a;
  const double limit = h.sign > 0.0 ? up : down;
  const double K = h.sign * v - 0.5 * a * a;
  const double rise = std::max(0.0, h.sign * velocity - K);
  h.back = limit;
  double both = 0.0;  // the time with the first ramp extended to zero
  double grows = 0.0;
  if (rise <= limit * limit) {
    h.back = std::sqrt(rise);
    both = 2.0 * h.back;
    grows = h.back;
  } else {
    h.hold = rise / limit - limit;
    both = 2.0 * limit + h.hold;
    grows = rise / limit;
  }
  h.ramp = std::max(0.0, h.back - start);
  h.time = both - start;
  h.distance = h.sign * (0.5 * (K + h.sign * velocity) * both - (K + a * a / 6.0) * start);
  h.slope = start - 0.5 * (both + grows);
  return h;
}

/// A motion with a cruise at some velocity.
struct Cruise {
  Half first;
  Half second;  ///< Backwards in time.
  double time = 0.0;
  double distance = 0.0;
  double slope = 0.0;  ///< Of the distance by the velocity.
};

Cruise cruise_at(const SCurveProblem& p, double velocity, double T) {
  Cruise c{half_to(velocity, p.v_0, p.a_0, p.up, p.down),
           half_to(velocity, p.v_f, -p.a_f, p.down, p.up)};
  c.time = T - c.first.time - c.second.time;
  c.distance = c.first.distance + c.second.distance + velocity * c.time;
  c.slope = T + c.first.slope + c.second.slope;
  return c;
}

/// The motion of duration T with a cruise; its distance grows with the cruise's velocity.
/// @return Whether there is one.
bool find_cruise(const SCurveProblem& p, double T, double low, double high, Cruise& c) {
  constexpr int max_iterations = 60;
  const double tolerance = p.slack + 1e-13 * (std::abs(p.distance) + (p.high + p.low) * T);
  double v = std::clamp(p.distance / T, low, high);
  for (int i = 0; i < max_iterations; ++i) {
    c = cruise_at(p, v, T);
    const double miss = p.distance - c.distance;
    if (std::abs(miss) <= tolerance) {
      break;
    }
    (miss > 0.0 ? low : high) = v;
    const double newton = c.slope > 0.0 ? v + miss / c.slope : low;
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (next == v) {
      break;
    }
    v = next;
  }
  return c.time >= -1e-12 * T && std::abs(p.distance - c.distance) <= 1e2 * tolerance;
}

SCurveShape member(const SCurveFamily& f, double T) {
  return shape_at(f, T + f.a_0 - f.a_f);
}

}  // namespace

/// Pieces of a motion of exactly the duration T.
class StretchedMotion {
 public:
  struct Piece {
    double duration = 0.0;
    double jerk = 0.0;
    bool cruises = false;
  };

  StretchedMotion(const SCurveProblem& p, double T) {
    SCurveFamily up = family_of(p, false);
    SCurveFamily down = family_of(p, true);
    up = up.E >= 0.0 ? up : reversed(up);
    down = down.E >= 0.0 ? down : reversed(down);
    const SCurveShape most = member(up, T);
    const SCurveShape least = member(down, T);
    const bool crosses = most.a_1 >= 0.0 && most.b <= 0.0;
    const bool crosses_down = least.a_1 >= 0.0 && least.b <= 0.0;
    Cruise c;
    if (find_cruise(p, T, crosses_down ? -least.v_p : -p.low, crosses ? most.v_p : p.high, c)) {
      add(c.first.ramp, c.first.sign);
      add(c.first.hold, 0.0);
      add(c.first.back, -c.first.sign);
      add(c.time, 0.0, true);
      add(c.second.back, -c.second.sign);
      add(c.second.hold, 0.0);
      add(c.second.ramp, c.second.sign);
      return;
    }
    mix(up, most, down, least);
  }

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] const Piece& operator[](int i) const { return pieces_[i]; }

 private:
  void add(double duration, double jerk, bool cruises = false) {
    if (duration > 0.0 && size_ < capacity) {
      pieces_[size_++] = {duration, jerk, cruises};
    }
  }

  /// theta of the one and 1 - theta of the other, so that the goal is met.
  void mix(const SCurveFamily& up, const SCurveShape& most, const SCurveFamily& down,
           const SCurveShape& least) {
    // Beyond, and short of the goal.
    const double beyond = std::max(0.0, distance_of(up, most) - up.X);
    const double behind = std::max(0.0, distance_of(down, least) - down.X);
    const double theta = beyond + behind > 0.0 ? behind / (beyond + behind) : 1.0;
    const SCurvePhases a = phases_of(up, most);
    const SCurvePhases b = phases_of(down, least);
    int i = 0;
    int k = 0;
    double left_a = a.t[0];
    double left_b = b.t[0];
    while (i < 7 && k < 7) {
      const double h = std::min(left_a, left_b);
      add(h, theta * a.sign * jerks[i] + (1.0 - theta) * b.sign * jerks[k]);
      left_a -= h;
      left_b -= h;
      while (i < 7 && left_a <= 0.0) {
        left_a = ++i < 7 ? a.t[i] : 0.0;
      }
      while (k < 7 && left_b <= 0.0) {
        left_b = ++k < 7 ? b.t[k] : 0.0;
      }
    }
  }

  static constexpr int capacity = 14;
  Piece pieces_[capacity];
  int size_ = 0;
};

namespace {

/// The least duration from T on of a plan's motion.
double allowed_duration(const SCurvePlan& plan, double T) {
  const double own = plan.duration();
  if (T <= own) {
    return own;
  }
  const SCurveProblem& p = plan.problem;
  // A goal at rest can be come to at any time.
  if (p.v_f == 0.0 && p.a_f == 0.0) {
    return T;
  }
  const double t = T - plan.brake_time;
  return detail::has_duration(p, t) ? T : plan.brake_time + detail::next_duration(p, t);
}

}  // namespace

double AxisMotions::synchronize(Synchronization how, double least) noexcept {
  if (how == Synchronization::phase && move_in_phase() && axes[0].total_time() >= least) {
    return axes[0].total_time();
  }
  in_phase = false;
  double T = least <= detail::longest_motion ? std::max(0.0, least) : 0.0;
  slowest = -1;
  for (int i = 0; i < count; ++i) {
    plans[i] = detail::plan_motion(limits[i], start[i], goal[i]);
    if (plans[i].usable && plans[i].duration() > T) {
      T = plans[i].duration();
      slowest = i;
    }
  }
  // Each round at least one axis moves on to another of its few intervals.
  bool settled = false;
  for (int round = 0; round < 4 * count && !settled; ++round) {
    settled = true;
    for (int i = 0; i < count; ++i) {
      if (plans[i].usable && i != slowest) {
        if (plans[i].straight && T > plans[i].duration()) {
          plans[i] = detail::plan_motion(limits[i], start[i], goal[i], true);
        }
        const double next = allowed_duration(plans[i], T);
        plans[i].usable = next <= detail::longest_motion;
        if (plans[i].usable && next > T * (1.0 + 1e-12)) {
          T = next;
          slowest = -1;
          settled = false;
        }
      }
    }
  }
  for (int i = 0; i < count; ++i) {
    AxisMotion& axis = axes[i];
    const SCurvePlan& plan = plans[i];
    if (!plan.usable) {
      const double place = std::isfinite(goal[i].position) ? goal[i].position : 0.0;
      axis.begin({place, 0.0, 0.0});
      continue;
    }
    axis.begin(start[i]);
    if (T <= plan.duration() * (1.0 + 1e-12)) {
      axis.add_plan(plan);
    } else {
      for (int k = 0; k < plan.brakes; ++k) {
        axis.add(plan.brake[k].duration, plan.brake[k].jerk * plan.jerk);
      }
      const StretchedMotion rest(plan.problem, T - plan.brake_time);
      for (int k = 0; k < rest.size(); ++k) {
        if (rest[k].cruises) {
          axis.goal_.acceleration = 0.0;  // over a long wait its rounding would add up
        }
        axis.add(rest[k].duration, rest[k].jerk * plan.jerk);
      }
    }
    axis.finish(plan.goal);
  }
  return T;
}

bool AxisMotions::move_in_phase() noexcept {
  // The longest way sets the scale; where nothing moves away, the velocities do.
  int r = 0;
  const auto way = [&](int i) { return goal[i].position - start[i].position; };
  for (int i = 1; i < count; ++i) {
    r = std::abs(way(i)) > std::abs(way(r)) ? i : r;
  }
  const double length = way(r);
  if (!(std::abs(length) > 0.0)) {
    return false;
  }
  MotionLimits line = limits[r].both_ways();
  const auto close = [](double a, double b, double scale) {
    return std::abs(a - b) <= 1e-9 * scale;
  };
  const double speed = std::abs(start[r].velocity) + std::abs(goal[r].velocity);
  const double bend = std::abs(start[r].acceleration) + std::abs(goal[r].acceleration);
  // An axis's limits along the line.
  const auto own_limits = [&](int i, double k) {
    MotionLimits own = k > 0.0 ? limits[i].both_ways() : limits[i].mirrored();
    const double per = 1.0 / std::abs(k);
    own.velocity *= per;
    own.reverse_velocity *= per;
    own.acceleration *= per;
    own.deceleration *= per;
    own.jerk *= per;
    return own;
  };
  for (int i = 0; i < count; ++i) {
    const double k = way(i) / length;
    if (!close(start[i].velocity, k * start[r].velocity, speed + line.velocity) ||
        !close(goal[i].velocity, k * goal[r].velocity, speed + line.velocity) ||
        !close(start[i].acceleration, k * start[r].acceleration, bend + line.acceleration) ||
        !close(goal[i].acceleration, k * goal[r].acceleration, bend + line.acceleration)) {
      return false;
    }
    if (k == 0.0) {
      continue;
    }
    const MotionLimits own = own_limits(i, k);
    line.velocity = std::min(line.velocity, own.velocity);
    line.reverse_velocity = std::min(line.reverse_velocity, own.reverse_velocity);
    line.acceleration = std::min(line.acceleration, own.acceleration);
    line.deceleration = std::min(line.deceleration, own.deceleration);
    line.jerk = std::min(line.jerk, own.jerk);
  }
  SCurvePlan plan = detail::plan_motion(line, start[r], goal[r]);
  if (!plan.usable) {
    return false;
  }
  const double jerk = plan.jerk;
  for (int i = 0; i < count; ++i) {
    const double k = way(i) / length;
    axes[i].begin(start[i]);
    plan.jerk = k * jerk;
    axes[i].add_plan(plan);
    axes[i].finish({goal[i].position, k * plan.goal.velocity, k * plan.goal.acceleration});
  }
  slowest = -1;
  for (int i = 0; i < count && slowest < 0; ++i) {
    const double k = way(i) / length;
    const MotionLimits own = k == 0.0 ? MotionLimits{} : own_limits(i, k);
    if (own.velocity == line.velocity && own.reverse_velocity == line.reverse_velocity &&
        own.acceleration == line.acceleration && own.deceleration == line.deceleration &&
        own.jerk == line.jerk) {
      slowest = i;
    }
  }
  in_phase = true;
  return true;
}

double detail::synchronize(AxisMotions& motions, Synchronization how, double least) noexcept {
  constexpr std::size_t most_axes = 16;
  // As many as there are, rather than sixteen to be cleared.
  alignas(SCurvePlan) std::byte room[most_axes * sizeof(SCurvePlan)];
  static_assert(std::is_trivially_destructible_v<SCurvePlan>);
  motions.plans = reinterpret_cast<SCurvePlan*>(room);
  std::uninitialized_default_construct_n(motions.plans, motions.count);
  return motions.synchronize(how, least);
}

}  // namespace flyball
