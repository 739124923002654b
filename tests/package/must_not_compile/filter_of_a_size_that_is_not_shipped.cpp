// error: the library has no code for this size
#ifndef WRONG
#include <flyball/estimation/kalman_filter.tpp>
#endif
#include <flyball/estimation/kalman_filter.hpp>

bool step(flyball::KalmanFilter<7, 3, 2>& filter) {
  return filter.predict(Eigen::Vector3d::Zero());
}
