// Records a simulated pendulum on whose end a load is put, as a log that `flyball estimate` reads:
// an encoder's angle with noise, which is gone for half a second, and no reading of velocity and
// load. examples/swing is what it writes; its truth is in columns of their own.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/core/random.hpp>

int main(int argc, char** argv) {
  using namespace flyball;
  std::FILE* log = argc == 2 ? std::fopen(argv[1], "w") : nullptr;
  if (log == nullptr) {
    std::fprintf(stderr, "usage: record_swing FILE.csv\n");
    return 2;
  }
  std::fprintf(log,
               "time (s),torque (N m),angle (deg),true theta (deg),true omega (rad/s),"
               "true load (N m)\n");
  Random random(2027);
  constexpr double degree = std::numbers::pi / 180.0;
  constexpr double dt = 0.01;
  constexpr int fine = 20;
  double theta = 0.3;
  double omega = 0.0;
  for (int k = 0; k <= 1500; ++k) {
    const double t = dt * k;
    const double torque = 1.5 * std::sin(1.1 * t) + std::sin(3.7 * t);
    const double load = t < 6.0 ? 0.0 : 1.0;
    const double angle = theta / degree + 0.5 * random.normal();
    std::fprintf(log, "%.2f,%.4f,", t, torque);
    if (t < 9.0 || t > 9.5) {
      std::fprintf(log, "%.2f", angle);
    }
    std::fprintf(log, ",%.3f,%.4f,%.1f\n", theta / degree, omega, load);
    for (int i = 0; i < fine; ++i) {  // Euler and Maruyama
      constexpr double h = dt / fine;
      constexpr double J = 2.0 * 0.5 * 0.5;
      omega += h * (-9.81 / 0.5 * std::sin(theta) + (torque - load - 0.02 * omega) / J) +
               0.1 * std::sqrt(h) * random.normal();
      theta += h * omega;
    }
  }
  if (std::fclose(log) != 0) {
    std::fprintf(stderr, "record_swing: %s could not be written\n", argv[1]);
    return 2;
  }
  return 0;
}
