// A gain that asks for more volts than there are (section 3.2): what is left of it at a large
// error, how far off the elevator may be before it saturates, and what a step of a metre costs.
#include <cstdio>

#include <flyball/control/lqr.hpp>
#include <flyball/control/saturation.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector2d;
  using Volts = Eigen::Vector<double, 1>;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm});
  const auto plant = discretize(elevator.value(), 20_ms).value();
  const auto design = lqr(plant, bryson({0.02, 0.4}), bryson({12.0})).value();

  //! [analysis]
  const Vector2d error(1.0, 0.0);  // a metre to go, at rest
  const auto at_start =
      analyze_saturation(design.K, error, Volts(-12.0), Volts(12.0), Volts(0.0)).value();
  //! [analysis]
  std::printf("asked for %.0f V, given %.0f V: the gain acts as %.1f %% of itself\n", at_start.u(0),
              at_start.u_limited(0), 100.0 * at_start.gain_fraction(0));
  std::printf("linear while the carriage is within %.1f cm\n", 100.0 * at_start.largest_error(0));

  //! [step]
  const auto step = saturation_of_step({plant.A, plant.B, plant.C, plant.D, plant.period}, design.K,
                                       Vector2d(1.0, 0.0), Volts(-12.0), Volts(12.0), 500);
  //! [step]
  std::printf(
      "a step of 1 m: at the limit for %.2f s, settled after %.2f s, without limits %.2f s\n",
      step->saturated_time, step->settling_time.value(), step->linear_settling_time.value());
  return at_start.u_limited(0) == 12.0 && *step->settling_time > *step->linear_settling_time ? 0
                                                                                             : 1;
}
