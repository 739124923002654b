#pragma once

#include <algorithm>
#include <cmath>

#include <flyball/planning/profiles/motion.hpp>

namespace bench {

/// A trapezoid as robots' libraries compute it today, to be compared with: equal limits, nothing
/// checked. A start that is too fast is brought to the limit first, the direction chosen by the
/// straight change, then come the times of three phases, and a sample adds them up.
class PlainTrapezoid {
 public:
  [[gnu::always_inline]] PlainTrapezoid(const flyball::MotionLimits& limits,
                                        const flyball::MotionState& start,
                                        const flyball::MotionState& goal) noexcept
      : start_(start), goal_(goal) {
    const double V = limits.velocity;
    const double A = limits.acceleration;
    goal_.velocity = std::clamp(goal.velocity, -V, V);
    double x = start.position;
    double v = start.velocity;
    double recovery = 0.0;
    if (const double over = std::abs(v) - V; over > 0.0) {
      recovery = over / A;
      const double brake = v > 0.0 ? -A : A;
      x += (v + 0.5 * brake * recovery) * recovery;
      v = std::copysign(V, v);
    }
    const double w = goal_.velocity;
    const double d = goal.position - x;
    const double straight = 0.5 * std::abs(w - v) * (w + v) / A;
    sign_ = std::copysign(1.0, d - straight);
    a_ = sign_ * A;
    const double peak = std::sqrt(0.5 * (v * v + w * w) + a_ * d);
    const double c = sign_ * std::min(peak, V);
    times_[0] = (c - v) / a_ + recovery;
    times_[1] = peak > V ? (d - (c * c - 0.5 * (v * v + w * w)) / a_) / c : 0.0;
    times_[2] = (c - w) / a_;
    brakes_ = recovery > 0.0 && start.velocity * sign_ > 0.0;
  }

  [[nodiscard]] [[gnu::always_inline]] flyball::MotionState sample(double t) const noexcept {
    flyball::MotionState s{start_.position, start_.velocity, 0.0};
    const double accelerations[] = {brakes_ ? -a_ : a_, 0.0, -a_};
    for (int i = 0; i < 3; ++i) {
      const double h = std::min(t, times_[i]);
      s.position += (s.velocity + 0.5 * accelerations[i] * h) * h;
      s.velocity += accelerations[i] * h;
      if (t <= times_[i]) {
        return s;
      }
      t -= times_[i];
    }
    return goal_;
  }

 private:
  flyball::MotionState start_;
  flyball::MotionState goal_;
  double a_ = 0.0;
  double sign_ = 1.0;
  double times_[3] = {0.0, 0.0, 0.0};
  bool brakes_ = false;
};

}  // namespace bench
