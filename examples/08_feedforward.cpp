// Feedforwards beside one feedback (section 7.8): plant inversion follows a moving reference that
// feedback alone trails, and leaves the poles where they are (7.8.3).
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector2d;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm});
  const auto plant = discretize(elevator.value(), 20_ms).value();
  const auto K = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const TrapezoidProfile profile({.velocity = 1.0, .acceleration = 2.0}, {}, {.position = 1.0});
  const auto reference = [&](int k) {
    const auto at = profile.sample(0.02 * k);
    return Vector2d(at.position, at.velocity);
  };

  //! [inversion]
  const auto inversion = linear_plant_inversion(plant).value();
  const auto voltage = [&](const Vector2d& x, int k, bool with_feedforward) {
    Eigen::Vector<double, 1> u = K * (reference(k) - x);
    if (with_feedforward) {
      u += inversion.calculate(reference(k), reference(k + 1));
    }
    return u;
  };
  //! [inversion]

  double trails[2] = {0.0, 0.0};
  for (const bool with : {false, true}) {
    Vector2d x = Vector2d::Zero();
    for (int k = 0; k < 150; ++k) {
      trails[with] = std::max(trails[with], std::abs(reference(k)(0) - x(0)));
      x = plant.A * x + plant.B * voltage(x, k, with);
    }
  }
  std::printf("largest error of position: %.2f mm by feedback, %.2f mm with plant inversion\n",
              1e3 * trails[0], 1e3 * trails[1]);

  // Two starts come together the same way with and without: by A - BK a period.
  //! [poles]
  Vector2d apart[2];
  for (const bool with : {false, true}) {
    Vector2d x(0.0, 0.0);
    Vector2d other(0.1, 0.0);
    for (int k = 0; k < 10; ++k) {
      x = plant.A * x + plant.B * voltage(x, k, with);
      other = plant.A * other + plant.B * voltage(other, k, with);
    }
    apart[with] = other - x;
  }
  //! [poles]
  std::printf("10 cm apart at the start, after 0.2 s %.6f mm and %.6f mm\n", 1e3 * apart[0](0),
              1e3 * apart[1](0));
  return (apart[0] - apart[1]).norm() < 1e-12 && trails[1] < 0.2 * trails[0] ? 0 : 1;
}
