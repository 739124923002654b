#include <flyball/control/state_feedback.tpp>

namespace flyball {

template class StateFeedback<1, 1>;
template class StateFeedback<2, 1>;
template class StateFeedback<2, 2>;
template class StateFeedback<3, 1>;
template class StateFeedback<Eigen::Dynamic, Eigen::Dynamic>;

}  // namespace flyball
