// error: no conversion
#include <flyball/core/quantity.hpp>

using namespace flyball::literals;

double seconds() {
#ifdef WRONG
  const double period = 20_ms;
#else
  const double period = (20_ms).si();
#endif
  return period;
}
