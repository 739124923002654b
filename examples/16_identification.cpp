// kS, kV and kA of a flywheel from a noisy record by ordinary least squares (chapter 14), with
// standard errors, and the model that they make (Theorem 14.3.1).
#include <cmath>
#include <cstdio>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/math/regression/least_squares.hpp>
#include <flyball/mechanisms/flywheel.hpp>

int main() {
  using namespace flyball;
  constexpr double kS = 0.2;
  constexpr double kV = 0.12;
  constexpr double kA = 0.02;
  constexpr double T = 0.02;

  // A ramp of voltage and a step, forward and back.
  Random random(14);
  constexpr int rows = 800;
  Eigen::MatrixXd X(rows, 3);
  Eigen::VectorXd y(rows);
  double omega = 0.0;
  for (int k = 0; k < rows; ++k) {
    const double sign = k < rows / 2 ? 1.0 : -1.0;
    const int in_half = k % (rows / 2);
    const double voltage = sign * (in_half < 300 ? 0.5 + 0.02 * in_half : 9.0);
    const double direction = omega == 0.0 ? sign : std::copysign(1.0, omega);
    const double acceleration = (voltage - kS * direction - kV * omega) / kA;
    //! [rows]
    X.row(k) << direction, omega, acceleration;
    y(k) = voltage + 0.1 * random.normal();
    //! [rows]
    omega += T * acceleration;
  }
  //! [fit]
  const auto fit = least_squares(X, y).value();
  //! [fit]
  const double truth[3] = {kS, kV, kA};
  const char* names[3] = {"kS (V)", "kV (V s/rad)", "kA (V s^2/rad)"};
  bool covered = true;
  for (int i = 0; i < 3; ++i) {
    std::printf("%-15s %9.5f +- %.5f, true %.5f\n", names[i], fit.coefficients(i),
                2.0 * fit.standard_errors(i), truth[i]);
    covered = covered && std::abs(fit.coefficients(i) - truth[i]) < 3.0 * fit.standard_errors(i);
  }
  //! [model]
  const auto model = mechanisms::flywheel(
      {.kS = fit.coefficients(0), .kV = fit.coefficients(1), .kA = fit.coefficients(2)});
  //! [model]
  std::printf("A = -kV/kA = %.3f 1/s, B = 1/kA = %.3f rad/s^2/V\n", model->A(0), model->B(0));
  return covered ? 0 : 1;
}
