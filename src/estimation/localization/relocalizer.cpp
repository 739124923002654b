#include <flyball/estimation/localization/relocalizer.hpp>

#include <algorithm>
#include <cmath>

namespace flyball {

namespace {

using Eigen::Vector2d;

double cross(const Vector2d& a, const Vector2d& b) noexcept {
  return a(0) * b(1) - a(1) * b(0);
}

}  // namespace

void Relocalizer::add(double time, const Pose2d& dead_reckoned, const Vector2d& seen,
                      const Vector2d& landmark) noexcept {
  if (!std::isfinite(time + seen.sum() + landmark.sum())) {
    return;
  }
  entries_[static_cast<std::size_t>(next_)] = {time, dead_reckoned, seen, landmark};
  next_ = (next_ + 1) % capacity;
  count_ = std::min(count_ + 1, capacity);
  while (count_ > 1 && newest(count_ - 1).time < time - longest_) {
    --count_;
  }
}

int Relocalizer::agreeing(const Pose2d& pose, const Pose2d& dead_reckoned,
                          int considered) const noexcept {
  int agree = 0;
  for (int k = 0; k < std::min(considered, count_); ++k) {
    const Entry& entry = newest(k);
    const Vector2d now = dead_reckoned.between(entry.dead_reckoned) * entry.seen;
    const double off = (pose * now - entry.landmark).norm();
    agree += off <= tolerance_ + 0.05 * entry.seen.norm() ? 1 : 0;
  }
  return agree;
}

std::optional<Relocalizer::Candidate> Relocalizer::find(const Pose2d& dead_reckoned,
                                                        int least) const noexcept {
  // A pose must explain so much of the newest sightings that it is told from.
  constexpr double share = 0.8;
  // Two landmarks nearer than this tell no direction.
  constexpr double apart = 0.5;
  std::array<Vector2d, capacity> now;  // The landmarks in the robot's frame of now.
  std::array<double, capacity> slack;
  for (int k = 0; k < count_; ++k) {
    const Entry& entry = newest(k);
    const auto at = static_cast<std::size_t>(k);
    now[at] = dead_reckoned.between(entry.dead_reckoned) * entry.seen;
    slack[at] = tolerance_ + 0.05 * entry.seen.norm();
  }
  const auto fits = [&](const Pose2d& pose, int k) {
    const auto at = static_cast<std::size_t>(k);
    return (pose * now[at] - newest(k).landmark).norm() <= slack[at];
  };
  Candidate best;
  for (int i = 0; i < count_; ++i) {
    for (int j = i + 1; j < count_; ++j) {
      const auto a = static_cast<std::size_t>(i);
      const auto b = static_cast<std::size_t>(j);
      const Vector2d there = newest(j).landmark - newest(i).landmark;
      const Vector2d here = now[b] - now[a];
      const double size = there.norm();
      if (size < apart || std::abs(here.norm() - size) > slack[a] + slack[b]) {
        continue;
      }
      const double turn = std::atan2(cross(here, there), here.dot(there));
      const SO2<double> rotation(turn);
      const Vector2d middle = 0.5 * (newest(i).landmark + newest(j).landmark);
      const Pose2d pose(Vector2d(middle - rotation * Vector2d(0.5 * (now[a] + now[b]))), rotation);
      // One sighting beside those of a single landmark is explained by construction: it takes two.
      int agree = 0;
      int of_first = 0;
      int of_second = 0;
      for (int k = 0; k < count_; ++k) {
        if (!fits(pose, k)) {
          continue;
        }
        ++agree;
        of_first += newest(k).landmark == newest(i).landmark ? 1 : 0;
        of_second += newest(k).landmark == newest(j).landmark ? 1 : 0;
        const bool two_landmarks = agree - of_first >= 2 && agree - of_second >= 2;
        if (two_landmarks && agree >= share * (k + 1) && agree > best.agreeing) {
          best = {pose, agree, k + 1};
        }
      }
    }
  }
  if (best.agreeing < least) {
    return std::nullopt;
  }
  // All that agree, by least squares.
  Vector2d middle_now = Vector2d::Zero();
  Vector2d middle_there = Vector2d::Zero();
  for (int k = 0; k < best.considered; ++k) {
    if (fits(best.pose, k)) {
      middle_now += now[static_cast<std::size_t>(k)] / best.agreeing;
      middle_there += newest(k).landmark / best.agreeing;
    }
  }
  double sine = 0.0;
  double cosine = 0.0;
  for (int k = 0; k < best.considered; ++k) {
    if (fits(best.pose, k)) {
      const Vector2d here = now[static_cast<std::size_t>(k)] - middle_now;
      const Vector2d there = newest(k).landmark - middle_there;
      sine += cross(here, there);
      cosine += here.dot(there);
    }
  }
  const SO2<double> rotation(std::atan2(sine, cosine));
  best.pose = Pose2d(Vector2d(middle_there - rotation * middle_now), rotation);
  return best;
}

}  // namespace flyball
