// A gain that was designed without a delay, and a sensor that is 50 ms late (appendix B.4): the
// loop swings up, unless the gain is compensated for the time that the measurement is old.
#include <cmath>
#include <cstdio>
#include <deque>

#include <flyball/control/latency.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector2d;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::cim(2), .gearing = 10.0, .mass = 6.8_kg, .drum_radius = 2.763_cm});
  const auto plant = discretize(elevator.value(), 5_ms).value();
  //! [gains]
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  const auto compensated = compensate_latency(design.K, plant, 50_ms).value();  // K (A - BK)^(L/T)
  //! [gains]

  const auto largest_late_error = [&](const Eigen::RowVector2d& K) {
    std::deque<Vector2d> seen(10, Vector2d::Zero());  // 50 ms of 5 ms
    Vector2d x = Vector2d::Zero();
    double largest = 0.0;
    for (int k = 0; k < 400; ++k) {
      seen.push_back(x);
      const Vector2d error = Vector2d(0.5, 0.0) - seen.front();
      seen.pop_front();
      const double u = std::fmin(12.0, std::fmax(-12.0, K.dot(error)));
      x = plant.A * x + plant.B * u;
      if (k > 300) {  // after 1.5 s
        largest = std::fmax(largest, std::abs(0.5 - x(0)));
      }
    }
    return largest;
  };
  const double plain = largest_late_error(design.K);
  const double aware = largest_late_error(compensated);
  std::printf("K = [%.1f V/m, %.2f V/(m/s)]: still %.1f mm off after 1.5 s\n", design.K(0),
              design.K(1), 1e3 * plain);
  std::printf("for 50 ms [%.1f, %.2f]: %.3f mm\n", compensated(0), compensated(1), 1e3 * aware);
  return aware < 1e-3 && plain > 10.0 * aware ? 0 : 1;
}
