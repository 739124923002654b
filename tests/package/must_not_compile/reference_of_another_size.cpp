// error: use of deleted function|call to deleted
#include <flyball/control/lqg.hpp>

double step(flyball::Lqg<2, 1, 1>& loop, double y) {
  const Eigen::Matrix<double, 1, 1> measured(y);
#ifdef WRONG
  const Eigen::Vector3d r = Eigen::Vector3d::Zero();
#else
  const Eigen::Vector2d r = Eigen::Vector2d::Zero();
#endif
  return loop.step(r, r, measured)(0);
}
