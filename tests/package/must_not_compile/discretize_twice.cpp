// error: no matching function
#include <flyball/systems/discretize.hpp>

using namespace flyball::literals;

bool design(const flyball::ContinuousSystem<2, 1, 1>& model,
            const flyball::DiscreteSystem<2, 1, 1>& plant) {
#ifdef WRONG
  return discretize(plant, 20_ms).has_value();
#else
  return plant.period == 20_ms && discretize(model, 20_ms).has_value();
#endif
}
