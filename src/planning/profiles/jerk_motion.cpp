#include <cmath>

#include <flyball/planning/profiles/s_curve_profile.hpp>

namespace flyball {

namespace {

MotionState after(const JerkMotion::Piece& piece, double t) {
  const MotionState& at = piece.at;
  return {at.position + (at.velocity + (0.5 * at.acceleration + piece.jerk * t / 6.0) * t) * t,
          at.velocity + (at.acceleration + 0.5 * piece.jerk * t) * t,
          at.acceleration + piece.jerk * t};
}

}  // namespace

void JerkMotion::add(double duration, double jerk) noexcept {
  if (!(duration > 0.0) || count_ >= capacity) {
    return;
  }
  // While a motion is built its goal is where it has come to.
  begin_[count_] = end_;
  position_[count_] = goal_.position;
  velocity_[count_] = goal_.velocity;
  acceleration_[count_] = goal_.acceleration;
  jerk_[count_] = jerk;
  goal_ = after({end_, goal_, jerk}, duration);
  ++count_;
  end_ += duration;
}

MotionState JerkMotion::sample(double t) const noexcept {
  if (!(t < end_)) {
    if (!(t >= end_)) {
      return piece(0).at;  // no time at all
    }
    const double past = std::isfinite(t) ? t - end_ : 0.0;
    const double position = goal_.position + goal_.velocity * past;
    return {std::isfinite(position) ? position : goal_.position, goal_.velocity,
            past > 0.0 ? 0.0 : goal_.acceleration};
  }
  const int i = index_at(t);
  return after(piece(i), t > 0.0 ? t - begin_[i] : 0.0);
}

double JerkMotion::jerk(double t) const noexcept {
  return t >= 0.0 && t < end_ ? jerk_[index_at(t)] : 0.0;
}

}  // namespace flyball
