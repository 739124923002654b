#pragma once

#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

/// One elevator of two states with its gains, for the tests of what runs in its loop.
namespace flyball::test {

inline constexpr double limit = 12.0;  // V

inline DiscreteSystem<2, 1, 1> elevator() {
  const auto model = mechanisms::elevator({.kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.6}).value();
  return discretize(model, Time(0.02)).value();
}

inline Eigen::RowVector2d gain() {
  return lqr(elevator(), bryson({0.02, 0.4}), bryson({limit})).value().K;
}

inline Eigen::Vector2d estimator_gain() {
  return kalman_gain(elevator(), standard_deviations({1e-3, 0.05}), standard_deviations({1e-3}))
      .value()
      .K;
}

}  // namespace flyball::test
