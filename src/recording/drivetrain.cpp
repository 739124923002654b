#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recording/drivetrain.hpp"

namespace flyball::recording {

std::vector<Diagnostic> diagnose_drive(const SysIdJson& log) {
  std::vector<Diagnostic> found;
  const auto side = [&](std::string_view name, auto voltage_of, auto velocity_of) {
    double product = 0.0;
    double voltage_power = 0.0;
    double velocity_power = 0.0;
    std::size_t rows = 0;
    double top_voltage = 0.0;
    double travel_speed = 0.0;
    for (const SysIdJson::Run& run : log.runs) {
      const std::vector<double>& voltage = voltage_of(run);
      const std::vector<double>& velocity = velocity_of(run);
      for (std::size_t i = 0; i < std::min(voltage.size(), velocity.size()); ++i) {
        product += voltage[i] * velocity[i];
        voltage_power += voltage[i] * voltage[i];
        velocity_power += velocity[i] * velocity[i];
        top_voltage = std::max(top_voltage, std::abs(voltage[i]));
        travel_speed = std::max(travel_speed, std::abs(velocity[i]));
        ++rows;
      }
    }
    constexpr double standstill = 0.02;  // rotations a second
    if (rows > 0 && travel_speed < standstill) {
      found.push_back({"no_motion", Severity::error,
                       fmt::format("the {} side never moved: at most {:.3g} rotations/s at up to "
                                   "{:.3g} V",
                                   name, travel_speed < 1e-9 ? 0.0 : travel_speed, top_voltage)});
      return;
    }
    const double correlation = voltage_power > 0.0 && velocity_power > 0.0
                                   ? product / std::sqrt(voltage_power * velocity_power)
                                   : 0.0;
    if (correlation < -0.3) {
      found.push_back({"inverted_encoder", Severity::error,
                       fmt::format("the {} side's encoder counts against its voltage (correlation "
                                   "{:.2f}): it is inverted",
                                   name, correlation)});
    }
  };
  using Run = SysIdJson::Run;
  side(
      "left", [](const Run& r) -> const std::vector<double>& { return r.voltage; },
      [](const Run& r) -> const std::vector<double>& { return r.velocity; });
  side(
      "right", [](const Run& r) -> const std::vector<double>& { return r.right_voltage; },
      [](const Run& r) -> const std::vector<double>& { return r.right_velocity; });
  return found;
}

}  // namespace flyball::recording
