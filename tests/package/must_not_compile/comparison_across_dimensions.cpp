// error: no match for|invalid operands
#include <flyball/core/quantity.hpp>

using namespace flyball::literals;

bool compare() {
#ifdef WRONG
  return 1_m < 1_kg;
#else
  return 1_m < 1_ft;
#endif
}
