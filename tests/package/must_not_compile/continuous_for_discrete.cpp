// error: no conversion
#include <flyball/systems/system.hpp>

double settle(const flyball::DiscreteSystem<2, 1, 1>& plant);

double design(const flyball::ContinuousSystem<2, 1, 1>& model) {
#ifdef WRONG
  return settle(model);
#else
  return settle({model.A, model.B, model.C, model.D, flyball::Time(0.02)});
#endif
}
