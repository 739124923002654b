// error: no conversion
#include <flyball/core/quantity.hpp>

using namespace flyball::literals;

double drum(flyball::Length radius);

double area() {
#ifdef WRONG
  return drum(8_kg);
#else
  return drum(2.54_cm);
#endif
}
