// A flywheel whose speed nobody measures (section 6.10.5): a noisy current sensor, the model of
// Theorem 6.10.2 and a Kalman filter tell it all the same; an offset of the sensor stays in the
// estimate.
#include <cmath>
#include <cstdio>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

namespace {

using namespace flyball;
using namespace flyball::literals;
using Scalar = Eigen::Vector<double, 1>;

/// How far off the speed's estimate is in the end, rad/s, with a sensor that is off by some
/// amperes.
double error_of_speed(const DiscreteSystem<1, 1, 1>& plant, double offset, bool tell) {
  Random random(5);
  //! [filter]
  auto filter =
      kalman_filter(plant, standard_deviations({0.05}), standard_deviations({2.0})).value();
  double omega = 0.0;
  for (int k = 0; k <= 500; ++k) {
    const Scalar u(k < 250 ? 8.0 : 5.0);
    const double current = plant.C(0) * omega + plant.D(0) * u(0);
    filter.update(Scalar(current + offset + 2.0 * random.normal()), u);
    //! [filter]
    if (tell && k % 100 == 0) {
      std::printf("%5.1f %10.1f %12.2f %12.2f\n", 0.02 * k, current, omega, filter.x_hat()(0));
    }
    //! [filter]
    filter.predict(u);
    omega = plant.A(0) * omega + plant.B(0) * u(0);
  }
  //! [filter]
  return std::abs(filter.x_hat()(0) - omega);
}

}  // namespace

int main() {
  //! [model]
  const auto model = mechanisms::flywheel_without_encoder(
      {.motor = mechanisms::neo(), .gearing = 2.0, .moment_of_inertia = 0.02_kg_m2});
  const auto plant = discretize(model.value(), 20_ms).value();
  //! [model]
  std::printf("I = %.3f w + %.2f V amperes\n\n", plant.C(0), plant.D(0));
  std::printf("%5s %10s %12s %12s\n", "t (s)", "I (A)", "w (rad/s)", "estimate");
  const double honest = error_of_speed(plant, 0.0, true);
  const double biased = error_of_speed(plant, 10.0, false);
  std::printf("\noff by %.2f rad/s in the end; with a sensor that shows 10 A too much by %.2f\n",
              honest, biased);
  return honest < 0.5 && biased > 2.0 * honest ? 0 : 1;
}
