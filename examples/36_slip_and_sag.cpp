// A swerve drive off the line at full voltage (chapter 12): its wheels spin and its battery sags,
// and what stator and supply limits of the currents make of it.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <flyball/mechanisms/drivetrain/swerve_dynamics.hpp>
#include <flyball/mechanisms/power/metered.hpp>
#include <flyball/systems/model_step.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using namespace flyball::mechanisms;

  //! [robot]
  const auto robot =
      swerve_dynamics<4>({.body = {.mass = 55_kg, .moment_of_inertia = 5_kg_m2},
                          .positions = {{{0.3, 0.3}, {0.3, -0.3}, {-0.3, 0.3}, {-0.3, -0.3}}},
                          .wheel_radius = 5_cm,
                          .drive = {.motor = kraken_x60(),
                                    .gearing = 6.12,
                                    .moment_of_inertia = MomentOfInertia(0.006)},
                          .steer = {.motor = kraken_x44(),
                                    .gearing = 18.75,
                                    .moment_of_inertia = MomentOfInertia(0.02)},
                          .tire = {.friction = 1.1}})
          .value();
  //! [robot]
  //! [powered]
  const Battery battery{.open_circuit_voltage = 12.6, .resistance = 0.012};
  const auto unlimited = powered(robot, {}, battery).value();
  const auto limited = powered(robot, {.stator = 70.0, .supply = 45.0}, battery).value();
  //! [powered]

  MotorWindings kraken{{.heat_capacity = 60.0, .thermal_resistance = 1.5}, 1};
  const auto run = [&](const auto& drive, const char* name) {
    std::array<MotorWindings, 8> windings;
    windings.fill(kraken);
    const auto model = metered(drive, windings).value();
    using Model = std::decay_t<decltype(model)>;
    auto x = model.start(Eigen::Vector<double, 18>(Eigen::Vector<double, 18>::Zero()));
    Eigen::Vector<double, 8> u = Eigen::Vector<double, 8>::Zero();
    u.head<4>().setConstant(12.0);
    double slip = 0.0;
    double rail = battery.open_circuit_voltage;
    double current = 0.0;
    for (int k = 0; k < 5000; ++k) {  // half a second
      const auto flow = model.flow(x, u);
      rail = std::min(rail, flow.rail);
      current = std::max(current, flow.current[0]);
      x = rk4(model, x, u, 1e-4);
      slip = std::max(slip, 0.05 * x(robot.wheel_speed_at(0)) - x(3));
    }
    std::printf(
        "%-9s %.2f m, %.2f m/s; slip %.2f m/s, rail %.1f V, %.0f A a motor, %.0f J, %.1f C\n", name,
        x(0), x(3), slip, rail, current, x(Model::energy_at()), x(Model::temperature_at(0)));
    return std::pair(slip, rail);
  };
  const auto [spun, sagged] = run(unlimited, "unlimited");
  const auto [held, kept] = run(limited, "limited");
  return spun > 2.0 * held && sagged < kept ? 0 : 1;
}
