// Dead reckoning round a circle (sections 10.1 and 10.2): forward Euler leaves it at once, the pose
// exponential is exact for any period in which the twist is constant.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/estimation/odometry.hpp>

int main() {
  using namespace flyball;
  // A circle of 1 m radius in 2π s.
  constexpr double pi = std::numbers::pi;
  std::printf("%12s %16s %22s\n", "period (s)", "Euler off by (m)", "exponential off by (m)");
  double euler_off = 0.0;
  double exponential_off = 0.0;
  for (const int steps : {10, 30, 100, 300}) {
    //! [odometry]
    Odometry euler(OdometryRule::forward_euler);
    Odometry exponential;  // OdometryRule::pose_exponential
    const double T = 2.0 * pi / steps;
    for (int k = 0; k < steps / 2; ++k) {
      const Eigen::Vector3d twist(1.0 * T, 0.0, 1.0 * T);  // m, m, rad
      euler.step(twist);
      exponential.step(twist);
    }
    const Pose2d truth(0.0, 2.0, pi);  // half way round
    //! [odometry]
    euler_off = (euler.pose().translation() - truth.translation()).norm();
    exponential_off = (exponential.pose().translation() - truth.translation()).norm();
    std::printf("%12.4f %16.4f %22.1e\n", T, euler_off, exponential_off);
  }
  return euler_off > 1e-3 && exponential_off < 1e-12 ? 0 : 1;
}
