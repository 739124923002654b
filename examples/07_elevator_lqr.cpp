// From an elevator's mass, gearing and motors to its feedback gain: Theorems 6.9.1, 7.3.1, 7.7.1.
#include <cstdio>

#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm});
  if (!elevator) {
    std::fprintf(stderr, "%s\n", to_string(elevator.error()).c_str());
    return 1;
  }
  //! [discretize]
  const auto plant = discretize(*elevator, 20_ms).value();
  //! [discretize]
  //! [design]
  // No more than 2 cm and 0.4 m/s of error with no more than 12 V (Bryson's rule).
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();
  //! [design]

  std::printf("K = [%.3f V/m, %.3f V/(m/s)]\n", design.K(0), design.K(1));
  std::printf("closed-loop poles %.4f%+.4fi, %.4f%+.4fi\n", design.poles(0).real(),
              design.poles(0).imag(), design.poles(1).real(), design.poles(1).imag());
  std::printf("hold against gravity with %.3f V\n", elevator->gains.kG);
  return design.residual < 1e-12 && is_stable_discrete(design.poles) ? 0 : 1;
}
