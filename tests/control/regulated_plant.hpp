#pragma once

#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/systems/discretize.hpp>

/// A plant under sampled feedback of an observer, for the tests of margins and robustness.
namespace flyball::test {

inline Eigen::MatrixXd scalar(double value) {
  return Eigen::MatrixXd::Constant(1, 1, value);
}

struct Regulated {
  ContinuousSystem<> truth;
  DiscreteSystem<> model;
  Eigen::MatrixXd K;
  Eigen::MatrixXd K_e;
};

inline Regulated regulated(const ContinuousSystem<>& plant, Time period, const Weight& Q,
                           const Weight& R, const Covariance& noise_Q, const Covariance& noise_R) {
  const auto model = discretize(plant, period).value();
  return {plant, model, lqr(model, Q, R).value().K, kalman_gain(model, noise_Q, noise_R).value().K};
}

inline ContinuousSystem<> elevator(double kV, double kA) {
  Eigen::MatrixXd A(2, 2);
  A << 0.0, 1.0, 0.0, -kV / kA;
  return {A, Eigen::Vector2d(0.0, 1.0 / kA), Eigen::RowVector2d(1.0, 0.0), scalar(0.0)};
}

inline Regulated regulated_elevator(double period = 0.02) {
  return regulated(elevator(4.0, 0.3), Time(period), bryson({0.02, 0.4}), bryson({12.0}),
                   standard_deviations({1e-3, 0.05}), standard_deviations({1e-3}));
}

}  // namespace flyball::test
