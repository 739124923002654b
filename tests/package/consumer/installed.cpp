#include <cstdio>

#include <flyball/core/version.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/systems/discretize.hpp>

using namespace flyball;
using namespace flyball::literals;

int main() {
  const auto motor = mechanisms::motor("NEO", 2);
  const auto refused = mechanisms::elevator(
      {.motor = motor.value(), .gearing = 0.0, .mass = 8_kg, .drum_radius = 2.54_cm});
  const auto elevator = mechanisms::elevator(
      {.motor = motor.value(), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm});
  if (refused || !elevator) {
    return 1;
  }
  std::puts(to_string(refused.error()).c_str());
  const auto plant = discretize(*elevator, 20_ms);
  if (!plant || plant->period != 20_ms || !(plant->B(1, 0) > 0.0)) {
    return 1;
  }
  std::printf("Flyball %s: B = [%g %g]\n", version.data(), plant->B(0, 0), plant->B(1, 0));
  return 0;
}
