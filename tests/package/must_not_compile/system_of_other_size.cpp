// error: no conversion
#include <flyball/systems/system.hpp>

double settle(const flyball::DiscreteSystem<2, 1, 1>& plant);

#ifdef WRONG
double design(const flyball::DiscreteSystem<3, 1, 1>& plant) {
  return settle(plant);
}
#else
double design(const flyball::DiscreteSystem<2, 1, 1>& plant) {
  return settle(plant);
}
#endif
