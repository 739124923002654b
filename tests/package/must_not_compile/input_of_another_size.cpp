// error: use of deleted function|call to deleted
#include <flyball/estimation/kalman_filter.hpp>

bool step(flyball::KalmanFilter<2, 1, 1>& filter) {
#ifdef WRONG
  return filter.predict(Eigen::Vector3d::Zero());
#else
  return filter.predict(Eigen::Matrix<double, 1, 1>::Zero());
#endif
}
