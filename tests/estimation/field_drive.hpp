#pragma once

#include <array>
#include <cmath>

#include <Eigen/Core>

#include <flyball/estimation/measurement_noise.hpp>
#include <flyball/systems/model.hpp>

// A drivetrain on a field with beacons, for the filters of nonlinear models.
namespace flyball::test {

/// x = [x, y, θ, vl, vr], u = [Vl, Vr], y = [θ, vl, vr] (section 8.7).
struct FieldDrive {
  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  static constexpr double trackwidth = 0.6;

  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    const Scalar v = 0.5 * (x(3) + x(4));
    return Eigen::Vector<Scalar, 5>{v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / trackwidth,
                                    -7.0 * x(3) + 1.5 * x(4) + 2.5 * u(0) - 0.6 * u(1),
                                    1.5 * x(3) - 7.0 * x(4) - 0.6 * u(0) + 2.5 * u(1)};
  }
  template <class X, class U>
  auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 3>{x(2), x(3), x(4)};
  }
  ModelDescription description() const {
    return {.outputs = {{"heading", "rad", true}, {"left", "m/s"}, {"right", "m/s"}}};
  }
};

inline const std::array<Eigen::Vector2d, 4> beacons{
    Eigen::Vector2d(8.0, 6.0), Eigen::Vector2d(-7.0, 7.0), Eigen::Vector2d(-6.0, -8.0),
    Eigen::Vector2d(9.0, -5.0)};

/// Distance to a beacon, m, and its direction from the robot's heading, rad.
struct Sighting {
  Eigen::Vector2d beacon;
  template <class X>
  auto operator()(const X& x) const {
    using Scalar = typename X::Scalar;
    const Scalar dx = beacon(0) - x(0);
    const Scalar dy = beacon(1) - x(1);
    using std::atan2, std::sqrt;
    return Eigen::Matrix<Scalar, 2, 1>(sqrt(dx * dx + dy * dy), atan2(dy, dx) - x(2));
  }
};

/// 5 cm and 0.02 rad.
inline MeasurementNoise<2> sighting_noise() {
  return MeasurementNoise<2>::independent(Eigen::Vector2d(0.05 * 0.05, 0.02 * 0.02));
}

}  // namespace flyball::test
