// error: (use of deleted function|invokes a deleted function|call to deleted|deleted constructor)
#include <flyball/mechanisms/elevator.hpp>

using namespace flyball::literals;

bool design(const flyball::mechanisms::DcMotor& motor) {
#ifdef WRONG
  return flyball::mechanisms::elevator(
             {.motor = motor, .gearing = 10.0, .mass = 8.0, .drum_radius = 2.54_cm})
      .has_value();
#else
  return flyball::mechanisms::elevator(
             {.motor = motor, .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm})
      .has_value();
#endif
}
