// error: (use of deleted function|invokes a deleted function|call to deleted|deleted constructor)
#include <flyball/core/quantity.hpp>

using namespace flyball::literals;

void sample(flyball::Time period);

void run() {
#ifdef WRONG
  sample(0.02);
#else
  sample(20_ms);
#endif
}
