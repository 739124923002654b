#include <flyball/mechanisms/power/motor_supply.hpp>

#include <algorithm>

namespace flyball::mechanisms {

double detail::rail_under_load(const Battery& battery, std::span<const MotorTerminal> motors,
                               std::span<const double> R, std::span<const double> back_emf,
                               std::span<const double> wanted) noexcept {
  using flyball::detail::signal_or_zero;
  const double open = signal_or_zero(battery.open_circuit_voltage) -
                      signal_or_zero(battery.resistance * battery.other_current);
  if (!(battery.resistance > 0.0)) {
    return std::max(open, 0.0);
  }
  // What motors feed back is at most e²/(4 R) each, so that no rail is above this.
  double fed_back = 0.0;
  for (std::size_t k = 0; k < motors.size(); ++k) {
    fed_back += 0.25 * back_emf[k] * back_emf[k] / R[k];
  }
  const double top = std::max(open, 0.0) + std::sqrt(battery.resistance * fed_back);
  if (!(top > 0.0)) {
    return 0.0;
  }
  const auto excess = [&](double rail) {
    return rail_excess<double>(battery, motors, R, back_emf, wanted, rail);
  };
  double high = top;
  double at_high = excess(high);
  if (at_high >= 0.0) {
    return high;
  }
  // From above, so that of several solutions it is the largest.
  constexpr int parts = 24;
  double low = 0.0;
  double at_low = -1.0;
  for (int part = 1; part <= parts && !(at_low >= 0.0); ++part) {
    if (part > 1) {
      high = low;
      at_high = at_low;
    }
    low = part < parts ? top * (1.0 - static_cast<double>(part) / parts) : 1e-9 * top;
    at_low = excess(low);
  }
  if (!(at_low >= 0.0)) {
    return 0.0;
  }
  // Regula falsi (Illinois).
  int kept = 0;
  for (int iteration = 0; iteration < 60 && high - low > 2e-16 * high; ++iteration) {
    const double secant = low + (high - low) * (at_low / (at_low - at_high));
    const double next =
        iteration < 40 && secant > low && secant < high ? secant : 0.5 * (low + high);
    const double at_next = excess(next);
    if (at_next == 0.0) {
      return next;
    }
    if (at_next > 0.0) {
      low = next;
      at_low = at_next;
      at_high *= kept > 0 ? 0.5 : 1.0;
      kept = 1;
    } else {
      high = next;
      at_high = at_next;
      at_low *= kept < 0 ? 0.5 : 1.0;
      kept = -1;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace flyball::mechanisms
