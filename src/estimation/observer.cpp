#include <flyball/estimation/observer.tpp>

namespace flyball {

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template class Observer<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
