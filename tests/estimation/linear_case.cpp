#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "linear_case.hpp"

namespace flyball::test {

Eigen::MatrixXd normal(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

LinearCase linear_case(Random& random) {
  LinearCase c;
  c.plant.A = 0.5 * normal(random, 3, 3);
  c.plant.B = normal(random, 3, 1);
  c.plant.C = normal(random, 2, 3);
  c.plant.D = normal(random, 2, 1);
  c.plant.period = Time(0.1);
  const Eigen::MatrixXd G = normal(random, 3, 2);
  const Eigen::MatrixXd H = normal(random, 2, 2);
  const Eigen::MatrixXd F = normal(random, 3, 3);
  c.Q = G * G.transpose();
  c.R = H * H.transpose() + 0.1 * Eigen::Matrix2d::Identity();
  c.P0 = F * F.transpose() + 0.1 * Eigen::Matrix3d::Identity();
  c.x0 = normal(random, 3, 1);
  return c;
}

Reference::Reference(const LinearCase& c)
    : A(c.plant.A.cast<long double>()),
      B(c.plant.B.cast<long double>()),
      C(c.plant.C.cast<long double>()),
      D(c.plant.D.cast<long double>()),
      Q(c.Q.cast<long double>()),
      R(c.R.cast<long double>()),
      P(c.P0.cast<long double>()),
      x(c.x0.cast<long double>()) {}

void Reference::predict(const U& u) {
  x = (A * x + B * u.cast<long double>()).eval();
  P = (A * P * A.transpose() + Q).eval();
}

void Reference::correct(const Eigen::Vector2d& y, const U& u) {
  const Wide S = C * P * C.transpose() + R;
  const Wide K = S.llt().solve(C * P).transpose();
  const Wide nu = y.cast<long double>() - C * x - D * u.cast<long double>();
  const Wide I_KC = Wide::Identity(3, 3) - K * C;
  x += K * nu;
  P = (I_KC * P * I_KC.transpose() + K * R * K.transpose()).eval();
  log_likelihood -= 0.5L * ((nu.transpose() * S.llt().solve(nu))(0, 0) + std::log(S.determinant()) +
                            2.0L * std::log(2.0L * std::numbers::pi_v<long double>));
}

}  // namespace flyball::test
