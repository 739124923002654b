// A motor from the five numbers of its datasheet (section 12.1): R, K_t and K_v, what two of them
// in one gearbox are, and where the most power is.
#include <cmath>
#include <cstdio>

#include <flyball/mechanisms/motor.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;

  //! [motor]
  const auto cim = mechanisms::motor("CIM", {.nominal_voltage = 12_V,
                                             .stall_torque = Torque(2.42),
                                             .stall_current = 133_A,
                                             .free_current = 2.7_A,
                                             .free_speed = 5310_rpm})
                       .value();
  //! [motor]
  const auto two = mechanisms::cim(2);
  for (const auto* motor : {&cim, &two}) {
    std::printf("%d x %s: R = %.4f Ohm, Kt = %.5f N m/A, Kv = %.2f rad/s/V\n", motor->count,
                motor->name.c_str(), motor->R, motor->Kt, motor->Kv);
  }
  //! [power]
  double best = 0.0;
  double at = 0.0;
  for (double omega = 0.0; omega < 12.0 * cim.Kv; omega += 1.0) {
    const double power = cim.torque(omega, 12.0) * omega;
    if (power > best) {
      best = power;
      at = omega;
    }
  }
  //! [power]
  std::printf("most power: %.0f W at %.0f rad/s, half of V Kv = %.0f rad/s\n", best, at,
              12.0 * cim.Kv);
  return std::abs(at - 6.0 * cim.Kv) < 1.0 && std::abs(two.R - cim.R / 2.0) < 1e-12 ? 0 : 1;
}
