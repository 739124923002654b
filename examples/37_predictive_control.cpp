// Model predictive control in the loop: an elevator that is told to go up a metre knows beforehand
// what its voltage, the voltage's rate and its speed may be, and a differential drive finds its way
// to a pose with its nonlinear model.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/LU>

#include <flyball/control/lqr.hpp>
#include <flyball/control/mpc/linear_mpc.hpp>
#include <flyball/control/mpc/nonlinear_mpc.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/model_step.hpp>

using namespace flyball;
using namespace flyball::literals;

namespace {

/// A drive 0.6 m wide: pose (m, rad) and the sides' velocities (m/s), from their voltages.
struct Drive {
  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using std::cos, std::sin;
    using Scalar = ScalarOf<X, U>;
    const Scalar v = 0.5 * (x(3) + x(4));
    return Eigen::Vector<Scalar, 5>{v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / 0.6,
                                    -4.0 * x(3) - 0.5 * x(4) + 2.5 * u(0) + 0.4 * u(1),
                                    -0.5 * x(3) - 4.0 * x(4) + 0.4 * u(0) + 2.5 * u(1)};
  }
};

bool elevator_goes_up() {
  const auto elevator =
      mechanisms::elevator(
          {.motor = mechanisms::neo(2), .gearing = 10.0, .mass = 8_kg, .drum_radius = 2.54_cm})
          .value();
  const auto plant = discretize(elevator, 20_ms).value();

  //! [linear]
  MpcSettings limits{.horizon = 25};
  limits.u_min = Eigen::Vector<double, 1>(-12.0);
  limits.u_max = Eigen::Vector<double, 1>(12.0);
  limits.du_min = Eigen::Vector<double, 1>(-2.0);  // V in a period: the belt is spared
  limits.du_max = Eigen::Vector<double, 1>(2.0);
  limits.x_min = Eigen::Vector2d(-HUGE_VAL, -0.8);  // m/s
  limits.x_max = Eigen::Vector2d(HUGE_VAL, 0.8);
  auto mpc = linear_mpc(plant, bryson({0.02, 0.4}).value(), bryson({12.0}).value(), limits).value();
  mpc.set_reference({1.0, 0.0}, Eigen::Vector<double, 1>(0.0));
  //! [linear]

  std::printf("   t, s  height, m  speed, m/s  voltage, V\n");
  Eigen::Vector2d x(0.0, 0.0);
  double fastest = 0.0;
  double steepest = 0.0;
  double last = 0.0;
  for (int k = 0; k <= 100; ++k) {
    const double u = mpc.calculate(x)(0);
    if (k % 20 == 0) {
      std::printf("%7.2f %10.3f %11.3f %11.2f\n", 0.02 * k, x(0), x(1), u);
    }
    steepest = std::max(steepest, std::abs(u - last));
    last = u;
    x = plant.A * x + plant.B * u;
    fastest = std::max(fastest, std::abs(x(1)));
  }
  std::printf("at most %.3f m/s, and %.3f V from one period to the next\n\n", fastest, steepest);
  return std::abs(x(0) - 1.0) < 1e-3 && fastest < 0.8 + 1e-6 && steepest < 2.0 + 1e-9;
}

/// Round a circle of 1 m at 1 m/s, from beside it.
bool drive_follows_a_circle() {
  const Eigen::Vector2d sides(0.7, 1.3);  // m/s: 1 m/s ahead, 1 rad/s
  const Eigen::Matrix2d A{{-4.0, -0.5}, {-0.5, -4.0}};
  const Eigen::Matrix2d B{{2.5, 0.4}, {0.4, 2.5}};
  const Eigen::Vector2d holding = -(B.inverse() * (A * sides));  // V

  //! [nonlinear]
  MpcSettings limits{.horizon = 20};
  limits.u_min = Eigen::Vector2d(-6.0, -6.0);
  limits.u_max = Eigen::Vector2d(6.0, 6.0);
  const Eigen::MatrixXd Q = Eigen::Vector<double, 5>(100.0, 100.0, 10.0, 1.0, 1.0).asDiagonal();
  auto mpc = nonlinear_mpc(Drive{}, 50_ms, Q, 0.1 * Eigen::Matrix2d::Identity(), limits).value();
  //! [nonlinear]

  const auto circle = [&](double t) {
    return Eigen::Vector<double, 5>{std::sin(t), 1.0 - std::cos(t), t, sides(0), sides(1)};
  };
  std::printf("   t, s     x, m     y, m  off by, m\n");
  Eigen::Vector<double, 5> x{-0.3, 0.25, 0.4, 0.0, 0.0};
  Eigen::Matrix<double, 5, Eigen::Dynamic> r(5, 21);
  const Eigen::Matrix<double, 2, Eigen::Dynamic> u_r = holding.replicate(1, 20);
  double off = 0.0;
  for (int k = 0; k <= 80; ++k) {
    const double t = 0.05 * k;
    for (int i = 0; i <= 20; ++i) {
      r.col(i) = circle(t + 0.05 * i);
    }
    mpc.set_trajectory(r, u_r);
    off = (x - circle(t)).head(2).norm();
    if (k % 16 == 0) {
      std::printf("%7.2f %8.3f %8.3f %10.4f\n", t, x(0), x(1), off);
    }
    const auto& u = mpc.calculate(x);
    for (int i = 0; i < 5; ++i) {
      x = rk4(Drive{}, x, u, 0.01);
    }
  }
  return off < 1e-3;
}

}  // namespace

int main() {
  const bool up = elevator_goes_up();
  const bool round = drive_follows_a_circle();
  return up && round ? 0 : 1;
}
