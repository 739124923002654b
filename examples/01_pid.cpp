// A flywheel brought to 100 rad/s by P, by PI and by P with a feedforward (chapter 2). P alone
// leaves an error, the integral takes it away in its own time, the feedforward never lets it arise.
#include <cmath>
#include <cstdio>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

using namespace flyball;
using namespace flyball::literals;

namespace {

constexpr double reference = 100.0;  // rad/s

/// The error after `seconds` under a controller; V ends at 12.
double error_after(double seconds, const DiscreteSystem<1, 1, 1>& plant, Pid pid,
                   double feedforward) {
  double omega = 0.0;
  //! [loop]
  for (int k = 0; k < seconds / plant.period.si(); ++k) {
    const double voltage = pid.calculate(omega, reference, feedforward);
    omega = plant.A(0) * omega + plant.B(0) * voltage;
  }
  //! [loop]
  return reference - omega;
}

}  // namespace

int main() {
  //! [plant]
  const auto flywheel = mechanisms::flywheel(
      {.motor = mechanisms::neo(), .gearing = 4.0, .moment_of_inertia = 0.01_kg_m2});
  const auto plant = discretize(flywheel.value(), 20_ms).value();
  //! [plant]
  //! [controllers]
  PidSettings settings{.gains = {.kp = 0.05}, .output_min = -12.0, .output_max = 12.0};
  const Pid p = Pid::create(settings).value();
  settings.gains.ki = 0.2;
  const Pid pi = Pid::create(settings).value();
  const double feedforward = flywheel->gains.kV * reference;  // V, holds the speed (14.2)
  //! [controllers]

  std::printf("error in rad/s after      0.5 s     1 s     3 s\n");
  double last = 0.0;
  const auto row = [&](const char* name, const Pid& pid, double volts) {
    std::printf("%-20s", name);
    for (const double seconds : {0.5, 1.0, 3.0}) {
      std::printf("%10.3f", last = error_after(seconds, plant, pid, volts));
    }
    std::printf("\n");
    return last;
  };
  const double of_p = row("P", p, 0.0);
  const double of_pi = row("PI", pi, 0.0);
  const double of_feedforward = row("P and feedforward", p, feedforward);

  // What P leaves: e = r / (1 + k kp) with the plant's gain k = B/(1 - A).
  const double left = reference / (1.0 + plant.B(0) / (1.0 - plant.A(0)) * 0.05);
  std::printf("P leaves r/(1 + k kp) = %.3f rad/s\n", left);
  return std::abs(of_p - left) < 1e-3 && std::abs(of_pi) < 0.01 * of_p &&
                 std::abs(of_feedforward) < 1e-3
             ? 0
             : 1;
}
