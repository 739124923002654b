// error: no conversion
#include <flyball/mechanisms/elevator.hpp>

using namespace flyball::literals;

bool design(const flyball::mechanisms::DcMotor& motor) {
#ifdef WRONG
  return flyball::mechanisms::elevator(
             {.motor = motor, .gearing = 10.0, .mass = 2.54_cm, .drum_radius = 8_kg})
      .has_value();
#else
  return flyball::mechanisms::elevator(
             {.motor = motor, .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm})
      .has_value();
#endif
}
