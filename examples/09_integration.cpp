// A pendulum by three integrators (section 7.9): Euler's error falls with the step, Runge-Kutta's
// with its fourth power, and Dormand and Prince choose the step for the accuracy that is asked for.
#include <cmath>
#include <cstdio>

#include <Eigen/Core>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/math/integration/fixed_step.hpp>

int main() {
  using namespace flyball;
  using Eigen::Vector2d;

  //! [model]
  const auto pendulum = [](const auto& x) {
    using Scalar = typename std::decay_t<decltype(x)>::Scalar;
    return Eigen::Vector<Scalar, 2>{x(1), -9.81 * sin(x(0))};
  };
  const Vector2d start(1.0, 0.0);
  //! [model]
  //! [adaptive]
  const auto exact = integrate([&](double, const Vector2d& x) { return pendulum(x); }, 0.0, start,
                               2.0, {.relative_tolerance = 1e-12, .absolute_tolerance = 1e-12})
                         .value();
  //! [adaptive]
  const Vector2d truth = exact.final_state();

  std::printf("%9s %14s %14s\n", "step (s)", "Euler (rad)", "RK4 (rad)");
  double euler_error = 0.0;
  double rk4_error = 0.0;
  double euler_ratio = 0.0;
  double rk4_ratio = 0.0;
  for (const double h : {0.02, 0.01, 0.005, 0.0025}) {
    Vector2d by_euler = start;
    Vector2d by_rk4 = start;
    //! [fixed]
    for (int k = 0; k < std::lround(2.0 / h); ++k) {
      by_euler = forward_euler(pendulum, by_euler, h);
      by_rk4 = rk4(pendulum, by_rk4, h);
    }
    //! [fixed]
    euler_ratio = euler_error / std::abs(by_euler(0) - truth(0));
    rk4_ratio = rk4_error / std::abs(by_rk4(0) - truth(0));
    euler_error = std::abs(by_euler(0) - truth(0));
    rk4_error = std::abs(by_rk4(0) - truth(0));
    std::printf("%9.4f %14.2e %14.2e\n", h, euler_error, rk4_error);
  }
  std::printf("half the step: Euler %.2f times better, RK4 %.2f times\n", euler_ratio, rk4_ratio);
  std::printf("Dormand-Prince to 1e-12: %d steps\n", exact.statistics().steps);
  return std::abs(euler_ratio - 2.0) < 0.2 && std::abs(rk4_ratio - 16.0) < 2.0 ? 0 : 1;
}
