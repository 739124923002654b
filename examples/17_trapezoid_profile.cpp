// The fastest motion of an elevator under limits of velocity and acceleration (section 15.1):
// accelerate, cruise, brake.
#include <cmath>
#include <cstdio>

#include <flyball/planning/profiles/trapezoid_profile.hpp>

int main() {
  using namespace flyball;
  //! [profile]
  const TrapezoidProfile profile({.velocity = 1.5, .acceleration = 3.0}, {.position = 0.2},
                                 {.position = 1.4});
  for (double t = 0.0; t <= profile.total_time() + 1e-9; t += profile.total_time() / 8.0) {
    const MotionState at = profile.sample(t);
    std::printf("%6.3f s %7.3f m %7.3f m/s %6.1f m/s^2\n", t, at.position, at.velocity,
                at.acceleration);
  }
  //! [profile]
  // 1.2 m: 0.5 s up to 1.5 m/s and 0.5 s down take 0.75 m, the rest 0.3 s.
  std::printf("takes %.3f s\n", profile.total_time());
  return std::abs(profile.total_time() - 1.3) < 1e-12 ? 0 : 1;
}
