// error: (use of deleted function|invokes a deleted function|call to deleted|deleted constructor)
#include <flyball/systems/discretize.hpp>

using namespace flyball::literals;

bool design(const flyball::ContinuousSystem<2, 1, 1>& model) {
#ifdef WRONG
  return discretize(model, 0.02).has_value();
#else
  return discretize(model, 20_ms).has_value();
#endif
}
