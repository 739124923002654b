#include <flyball/control/state_feedback.tpp>

namespace flyball {

#define FLYBALL_STATES_INPUTS(States, Inputs) template class StateFeedback<States, Inputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
