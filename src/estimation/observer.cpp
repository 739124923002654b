#include <flyball/estimation/observer.tpp>

namespace flyball {

template class Observer<1, 1, 1>;
template class Observer<2, 1, 1>;
template class Observer<2, 1, 2>;
template class Observer<2, 2, 2>;
template class Observer<3, 1, 1>;
template class Observer<3, 1, 2>;
template class Observer<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;

}  // namespace flyball
