#pragma once

#include <cmath>

#include <Eigen/Core>

#include <flyball/systems/model.hpp>

namespace bench {

/// A differential drive on the field: x = [x, y, θ, vl, vr], u = [Vl, Vr], y = [θ, vl, vr]
/// (section 8.7 and the figures of 8.9; three CIM motors a side).
struct Drivetrain {
  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  double c1 = -7.0;
  double c2 = 1.5;
  double b1 = 2.5;
  double b2 = -0.6;
  double trackwidth = 0.59055;

  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using Scalar = flyball::ScalarOf<X, U>;
    using std::cos, std::sin;
    const Scalar v = 0.5 * (x(3) + x(4));
    return Eigen::Vector<Scalar, 5>{v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / trackwidth,
                                    c1 * x(3) + c2 * x(4) + b1 * u(0) + b2 * u(1),
                                    c2 * x(3) + c1 * x(4) + b2 * u(0) + b1 * u(1)};
  }
  template <class X, class U>
  auto output(const X& x, const U&) const {
    return Eigen::Vector<flyball::ScalarOf<X, U>, 3>{x(2), x(3), x(4)};
  }
};

}  // namespace bench
