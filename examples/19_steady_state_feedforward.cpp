// Three feedforwards of a motor with inductance that is to hold a speed (appendix C): plant
// inversion, the same weighted by Q and R, and the steady-state feedforward, each with what it
// leaves.
#include <cmath>
#include <cstdio>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/steady_state_feedforward.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector2d;

  // x = [speed, current]: a CIM with its armature alone (6.10.7).
  ContinuousSystem<2, 1, 1> cim;
  cim.A << -3.5077e-6 / 3.2284e-6, 0.0181 / 3.2284e-6, -0.0181 / 230e-6, -0.0902 / 230e-6;
  cim.B << 0.0, 1.0 / 230e-6;
  cim.C << 1.0, 0.0;
  cim.D << 0.0;
  const auto plant = discretize(cim, 1_ms).value();

  //! [feedforwards]
  const auto steady = steady_state_feedforward(plant).value();   // N_u N_x⁺ r
  const auto inversion = linear_plant_inversion(plant).value();  // B⁺ (r' - A r)
  const auto weighted = qr_weighted_inversion(plant, bryson({20.0, 40.0}), bryson({12.0})).value();
  //! [feedforwards]
  const Vector2d r = steady.N_x * 500.0;  // the state of 500 rad/s
  const auto speed_under = [&](const Eigen::Vector<double, 1>& u) {
    Vector2d x = Vector2d::Zero();
    for (int k = 0; k < 2000; ++k) {
      x = plant.A * x + plant.B * u;
    }
    return x(0);
  };
  double worst = 0.0;
  const auto row = [&](const char* name, const Eigen::Vector<double, 1>& u) {
    const double left = 500.0 - speed_under(u);
    std::printf("%-26s %7.4f V leaves %8.4f rad/s\n", name, u(0), left);
    return std::abs(left);
  };
  worst = std::fmax(row("steady state", steady.calculate(r)),
                    row("plant inversion", inversion.calculate(r, r)));
  const double of_weighted = row("weighted by Q and R", weighted.calculate(r, r));
  return worst < 1e-6 && of_weighted > 1e-3 ? 0 : 1;
}
