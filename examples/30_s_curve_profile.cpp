// An S-curve between any two states, planned anew each period, and three axes that arrive at once
// (section 15.1).
#include <cmath>
#include <cstdio>

#include <flyball/planning/profiles/synchronized_motion.hpp>

int main() {
  using namespace flyball;
  //! [profile]
  const MotionLimits limits{.velocity = 1.5, .acceleration = 3.0, .jerk = 20.0};
  const MotionState goal{.position = 1.4};
  SCurveProfile profile(limits, {.position = 0.2, .velocity = -0.3, .acceleration = 0.5}, goal);
  const double planned = profile.total_time();

  // In the loop: each 20 ms from where it is. A new goal or limit would be followed at once.
  double t = 0.0;
  MotionState r{};
  while (profile.total_time() > 0.02) {
    r = profile.sample(0.02);
    profile = profile.replanned(r, goal);
    t += 0.02;
  }
  t += profile.total_time();
  //! [profile]
  std::printf("planned %.3f s, took %.3f s\n", planned, t);

  //! [axes]
  const SynchronizedMotion<3> motion({limits, limits, limits}, {},
                                     {MotionState{1.0}, {-0.4}, {0.2}}, Synchronization::phase);
  const auto middle = motion.sample(0.5 * motion.total_time());
  //! [axes]
  std::printf("half way along the line: %.3f %.3f %.3f m after %.3f s\n", middle[0].position,
              middle[1].position, middle[2].position, 0.5 * motion.total_time());
  return std::abs(t - planned) < 1e-3 && std::abs(middle[1].position + 0.2) < 1e-9 ? 0 : 1;
}
