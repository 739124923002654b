#include <flyball/planning/profiles/exponential_profile.hpp>

#include <algorithm>
#include <cmath>

namespace flyball {

namespace {

constexpr double largest = 1e30;

/// An acceleration that is constant, or falls with the velocity: a = rate (target - v), or target.
struct Law {
  double rate = 0.0;
  double target = 0.0;

  [[nodiscard]] double at(double v) const { return rate > 0.0 ? rate * (target - v) : target; }
};

/// The law of full effort of one sign at a velocity, and where it ends in that direction.
struct Stretch {
  Law law;
  double until = 0.0;
};

Stretch stretch(const MotorMotionLimits& m, double v, double sign) {
  // Mirrored so that the effort is upwards: at v the volts left are min(U - kV v, U_I).
  const double w = sign * v;
  const double friction = w >= 0.0 ? m.kS : -m.kS;
  const double held = sign * m.kG + friction;
  const double corner = (m.voltage - m.current_voltage) / m.kV;  // the current limit binds below
  Stretch s;
  s.until = w < 0.0 ? 0.0 : largest;
  if (w < corner) {
    s.law = {0.0, sign * (m.current_voltage - held) / m.kA};
    s.until = std::min(s.until, corner);
  } else {
    s.law = {m.kV / m.kA, sign * (m.voltage - held) / m.kV};
  }
  s.until *= sign;
  return s;
}

double time_of(const Law& law, double from, double to) {
  return law.rate > 0.0 ? std::log1p((to - from) / (law.target - to)) / law.rate
                        : (to - from) / law.target;
}

/// Time and way from one velocity to another at full effort.
struct Change {
  double time = 0.0;
  double distance = 0.0;
};

Change change(const MotorMotionLimits& m, double from, double to) {
  Change c;
  const double sign = to >= from ? 1.0 : -1.0;
  for (int i = 0; i < 4 && sign * (to - from) > 0.0; ++i) {
    const Stretch s = stretch(m, from, sign);
    const double next = sign * std::min(sign * s.until, sign * to);
    const double t = time_of(s.law, from, next);
    c.time += t;
    c.distance +=
        s.law.rate > 0.0 ? s.law.target * t - (next - from) / s.law.rate : 0.5 * (from + next) * t;
    from = next;
  }
  return c;
}

/// The speed at which the voltage is used up.
double top_speed(const MotorMotionLimits& m, double sign) {
  return (m.voltage - m.kS - sign * m.kG) / m.kV;
}

bool is_usable(const MotorMotionLimits& m, const MotionState& start, const MotionState& goal) {
  // What is left of the voltage and of the current's is no smaller than they may be: with
  // 1e-300 V a motion takes more seconds than a double holds.
  constexpr double smallest = 1.0 / largest;
  const auto positive = [](double x) { return x >= smallest && x <= largest; };
  const double held = std::abs(m.kG) + m.kS;
  return positive(m.kV) && positive(m.kA) && positive(m.voltage) && m.kS >= 0.0 &&
         positive(m.voltage - held) && m.current_voltage - held >= smallest &&
         m.velocity >= smallest && std::abs(start.position) <= largest &&
         std::abs(start.velocity) <= largest && std::abs(goal.position) <= largest &&
         std::abs(goal.velocity) <= largest;
}

}  // namespace

double MotorMotionLimits::most(double v) const noexcept {
  return stretch(*this, v, 1.0).law.at(v);
}

double MotorMotionLimits::least(double v) const noexcept {
  return stretch(*this, v, -1.0).law.at(v);
}

void ExponentialProfile::add(double duration, double rate, double target) noexcept {
  constexpr int capacity = 8;
  if (!(duration > 0.0) || count_ >= capacity) {
    return;
  }
  pieces_[count_++] = {end_, position_, velocity_, rate, target};
  if (rate > 0.0) {
    const double gone = -std::expm1(-rate * duration);
    position_ += target * duration - (target - velocity_) * gone / rate;
    velocity_ += (target - velocity_) * gone;
  } else {
    position_ += (velocity_ + 0.5 * target * duration) * duration;
    velocity_ += target * duration;
  }
  end_ += duration;
}

void ExponentialProfile::add_change(double from, double to) noexcept {
  const double sign = to >= from ? 1.0 : -1.0;
  for (int i = 0; i < 4 && sign * (to - from) > 0.0; ++i) {
    const Stretch s = stretch(motor_, from, sign);
    const double next = sign * std::min(sign * s.until, sign * to);
    add(time_of(s.law, from, next), s.law.rate, s.law.target);
    velocity_ = next;
    from = next;
  }
}

ExponentialProfile::ExponentialProfile(const MotorMotionLimits& motor, const MotionState& start,
                                       const MotionState& goal) noexcept
    : motor_(motor), goal_{goal.position, goal.velocity, 0.0} {
  if (!is_usable(motor, start, goal)) {
    goal_ = {std::isfinite(goal.position) ? goal.position : 0.0, 0.0, 0.0};
    pieces_[0].position = goal_.position;
    return;
  }
  constexpr double nearly = 1.0 - 1e-9;
  const double high = std::min(motor.velocity, nearly * top_speed(motor, 1.0));
  const double low = std::min(motor.velocity, nearly * top_speed(motor, -1.0));
  goal_.velocity = std::clamp(goal.velocity, -low, high);
  position_ = start.position;
  velocity_ = start.velocity;
  pieces_[0] = {0.0, start.position, start.velocity, 0.0, 0.0};

  // As the trapezoid: beyond the straight change accelerate first, short of it brake first.
  const double d = goal.position - start.position;
  const Change straight = change(motor, start.velocity, goal_.velocity);
  const double beyond = d - straight.distance;
  const double rounding =
      4e-15 * (std::abs(goal.position) + std::abs(start.position) + std::abs(straight.distance));
  if (std::abs(beyond) <= rounding) {
    add_change(start.velocity, goal_.velocity);
    return;
  }
  const double sign = beyond > 0.0 ? 1.0 : -1.0;
  const double most = sign > 0.0 ? high : low;
  const auto way = [&](double peak) {
    return sign * (change(motor, start.velocity, sign * peak).distance +
                   change(motor, sign * peak, goal_.velocity).distance);
  };
  // The way grows with the peak: p'(c) = c (1/a_up + 1/|a_down|), from zero speed on.
  double below = std::max({0.0, sign * start.velocity, sign * goal_.velocity});
  double above = most;
  double peak = most;
  double cruise = 0.0;
  const double at_most = below < most ? way(most) : way(below = most);
  if (sign * d >= at_most) {
    cruise = (sign * d - at_most) / most;
  } else {
    peak = 0.5 * (below + above);
    constexpr int max_iterations = 100;
    for (int i = 0; i < max_iterations; ++i) {
      const double miss = sign * d - way(peak);
      (miss > 0.0 ? below : above) = peak;
      const double up = std::abs(sign > 0.0 ? motor.most(peak) : motor.least(-peak));
      const double down = std::abs(sign > 0.0 ? motor.least(peak) : motor.most(-peak));
      const double step = peak > 0.0 ? miss / (peak * (1.0 / up + 1.0 / down)) : 0.0;
      double next = peak + step;
      if (!(next > below && next < above)) {
        next = 0.5 * (below + above);
      }
      if (std::abs(miss) <= rounding || next == peak || !(below < above)) {
        break;
      }
      peak = next;
    }
    // Near the top speed the peak has too few digits for its way: from a little less, the rest is
    // cruised.
    double rest = sign * d - way(peak);
    for (int i = 0; i < 60 && rest < 0.0; ++i) {
      peak = std::max(0.0, peak - std::ldexp(1e-16 * most, i));
      rest = sign * d - way(peak);
    }
    cruise = peak > 0.0 ? std::max(0.0, rest) / peak : 0.0;
  }
  add_change(start.velocity, sign * peak);
  add(cruise, 0.0, 0.0);
  add_change(sign * peak, goal_.velocity);
  if (!std::isfinite(end_) || !std::isfinite(position_)) {
    goal_.velocity = 0.0;
    count_ = 0;
    end_ = 0.0;
    pieces_[0] = {0.0, goal_.position, 0.0, 0.0, 0.0};
  }
}

ExponentialProfile ExponentialProfile::to_velocity(const MotorMotionLimits& motor,
                                                   const MotionState& start,
                                                   double velocity) noexcept {
  const MotionState goal{start.position, velocity, 0.0};
  ExponentialProfile profile(motor, start, {start.position, start.velocity, 0.0});
  profile.end_ = 0.0;
  profile.count_ = 0;
  if (!is_usable(motor, start, goal)) {
    const double place = std::isfinite(start.position) ? start.position : 0.0;
    profile.goal_ = {place, 0.0, 0.0};
    profile.pieces_[0] = {0.0, place, 0.0, 0.0, 0.0};
    return profile;
  }
  constexpr double nearly = 1.0 - 1e-9;
  const double high = std::min(motor.velocity, nearly * top_speed(motor, 1.0));
  const double low = std::min(motor.velocity, nearly * top_speed(motor, -1.0));
  const double end = std::clamp(velocity, -low, high);
  profile.position_ = start.position;
  profile.velocity_ = start.velocity;
  profile.pieces_[0] = {0.0, start.position, start.velocity, 0.0, 0.0};
  profile.add_change(start.velocity, end);
  profile.goal_ = {profile.position_, end, 0.0};
  if (!std::isfinite(profile.end_) || !std::isfinite(profile.position_)) {
    profile.goal_ = {start.position, 0.0, 0.0};
    profile.count_ = 0;
    profile.end_ = 0.0;
    profile.pieces_[0] = {0.0, start.position, 0.0, 0.0, 0.0};
  }
  return profile;
}

MotionState ExponentialProfile::sample(double t) const noexcept {
  if (t >= end_) {
    const double past = std::isfinite(t) ? t - end_ : 0.0;
    const double position = goal_.position + goal_.velocity * past;
    return {std::isfinite(position) ? position : goal_.position, goal_.velocity, 0.0};
  }
  int i = count_ - 1;
  while (i > 0 && t < pieces_[i].begin) {
    --i;
  }
  const Piece& p = pieces_[i < 0 ? 0 : i];
  const double s = t > 0.0 ? t - p.begin : 0.0;
  if (p.rate > 0.0) {
    const double gone = -std::expm1(-p.rate * s);
    const double left = p.target - p.velocity;
    return {p.position + p.target * s - left * gone / p.rate, p.velocity + left * gone,
            p.rate * left * (1.0 - gone)};
  }
  return {p.position + (p.velocity + 0.5 * p.target * s) * s, p.velocity + p.target * s, p.target};
}

MotionLimits ExponentialProfile::limits() const noexcept {
  return {std::min(motor_.velocity, top_speed(motor_, 1.0)), motor_.most(0.0), -motor_.least(0.0),
          std::min(motor_.velocity, top_speed(motor_, -1.0))};
}

}  // namespace flyball
