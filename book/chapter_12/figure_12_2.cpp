#include <numbers>

#include <flyball/mechanisms/motor.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

/// Figure 12.2: what the datasheet of a 775pro draws (section 12.1.2), at 12 V over the speed. The
/// lines leave the free current of 0.7 A out, so that nothing flows at free speed.
FigureResult figure_12_2() {
  constexpr double rpm = std::numbers::pi / 30.0;  // rad/s
  constexpr double free_speed = 18730.0;           // rpm
  const mechanisms::DcMotor motor =
      mechanisms::motor("775pro", {.nominal_voltage = 12_V,
                                   .stall_torque = Torque(0.71),
                                   .stall_current = 134_A,
                                   .free_current = 0_A,
                                   .free_speed = AngularVelocity(free_speed * rpm)})
          .value();
  // The datasheet's own; τ ω of its line is 348.1 W at half of the free speed.
  constexpr double largest_power = 347.0;  // W

  FigureResult figure{.id = "12.2", .title = "Datasheet curves of a 775pro"};
  std::vector<double> speed;
  std::vector<double> current;
  std::vector<double> power;
  std::vector<double> torque;
  for (double n = 0.0; n < free_speed; n += 50.0) {
    const double share = n / free_speed;
    speed.push_back(n);
    current.push_back(motor.current(n * rpm, 12.0));  // (12.1)
    torque.push_back(motor.torque(n * rpm, 12.0));    // (12.2)
    power.push_back(4.0 * largest_power * share * (1.0 - share));
  }
  figure.columns = {{"speed", "rpm", speed},
                    {"current", "A", current},
                    {"output_power", "W", power},
                    {"torque", "N m", torque}};
  figure.numbers = {{"R", "Ohm", motor.R}, {"K_t", "N m/A", motor.Kt}};
  figure.picture =
      Plot{.title = figure.title,
           .x_label = "Speed (rpm)",
           .panels = {{.y_label = "Current (A), power (W)",
                       .lines = {{.label = "Current", .x = speed, .y = current, .color = 0},
                                 {.label = "Output power", .x = speed, .y = power, .color = 2}}},
                      {.y_label = "Torque (N m)",
                       .lines = {{.label = "", .x = speed, .y = torque, .color = 1}}}}};
  return figure;
}

}  // namespace flyball::book
