// A cart-pole caught 20 degrees from upright: the nonlinear model (section 13.3), its exact
// linearisation (8.2), discretisation (7.3.1) and LQR gain (7.7.1), and the nonlinear model again
// under that gain.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/control/lqr.hpp>
#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/simulation/closed_loop.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/linearize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector4d;
  using Input = Eigen::Vector<double, 1>;
  constexpr double pi = std::numbers::pi;

  const auto model =
      mechanisms::cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm});
  if (!model) {
    std::fprintf(stderr, "%s\n", to_string(model.error()).c_str());
    return 1;
  }
  //! [design]
  // Small deviations from the pole standing at the middle of the track, sampled.
  const Time period = 20_ms;
  const Vector4d upright(0.0, pi, 0.0, 0.0);
  const auto linear = linearize(*model, upright, Input(0.0)).value();
  const auto plant = discretize(linear, period).value();
  // No more than 20 cm, 3 degrees, 1 m/s and 1 rad/s of error with no more than 40 N.
  const auto design = lqr(plant, bryson({0.2, 0.05, 1.0, 1.0}), bryson({40.0})).value();
  //! [design]
  std::printf("K = [%.2f N/m, %.2f N/rad, %.2f N/(m/s), %.2f N/(rad/s)]\n", design.K(0),
              design.K(1), design.K(2), design.K(3));
  for (const auto& pole : design.poles) {
    std::printf("closed-loop pole %.4f%+.4fi\n", pole.real(), pole.imag());
  }

  //! [loop]
  // The loop around the nonlinear model, no more than 80 N either way: u = K (r - x), the angle's
  // error the shorter way round, for one turn more is upright, too.
  Vector4d start(0.0, 3.0 * pi + 20.0 * pi / 180.0, 0.0, 0.0);
  auto truth = ModelPlant::create(*model, start).value();
  const ClosedLoop loop{.period = period,
                        .reference = upright.replicate(1, 251),
                        .actuators = {{.min = -80.0, .max = 80.0}}};
  const auto feedback = [&](const LoopSample& sample) -> LoopCommand {
    Eigen::VectorXd error = sample.r - sample.x;
    wrap_angles(error, truth.description().states);
    return design.K * error;
  };
  const auto result = simulate_closed_loop(truth, feedback, loop).value();

  //! [loop]
  std::printf("\n%6s %12s %14s %10s\n", "t (s)", "position (m)", "off upright", "force (N)");
  const auto column = [&](const char* name, std::size_t row) {
    return (*result.series.find(name))[row];
  };
  for (std::size_t row = 0; row < result.series.rows(); row += 25) {
    std::printf("%6.2f %12.4f %10.4f deg %10.3f\n", result.series.time()[row],
                column("position", row), angle_difference(column("angle", row), pi) * 180.0 / pi,
                column("commanded_force", row));
  }
  const Eigen::VectorXd& x = truth.state();
  const bool balanced = std::abs(angle_difference(x(1), pi)) < 1e-3 && std::abs(x(0)) < 1e-2;
  std::printf("\n%s\n", balanced ? "It stands." : "It fell.");
  return balanced ? 0 : 1;
}
