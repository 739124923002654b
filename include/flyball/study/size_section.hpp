#pragma once

#include <optional>
#include <string>

#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// [size]: the motion that has to be fast, and what it is done with. What is absent is not limited,
/// or not known.
struct SizeSection {
  std::optional<double> start{};     ///< m or rad; of what is controlled by its speed m/s, rad/s.
  std::optional<double> end{};       ///< The same.
  std::optional<Length> distance{};  ///< Of a drivetrain, in place of an end: how far it goes.
  std::optional<bool> stop{};        ///< Whether it is at rest at the end of that distance.
  std::optional<Current> stator_limit{};  ///< Of one motor.
  std::optional<Current> supply_limit{};  ///< Of one motor.
  double efficiency = 1.0;                ///< Of the gears.
  std::optional<double> friction{};       ///< N or N m, at the output.
  MomentOfInertia rotor_inertia{};        ///< Of one motor's rotor and pinion.
  std::optional<double> grip{};           ///< μ of a drivetrain's wheels.
  Voltage brownout_voltage{6.75};
  Current other_current{};                             ///< That the rest of the robot draws.
  std::optional<double> winding_heat_capacity{};       ///< J/K, of one motor.
  std::optional<double> winding_thermal_resistance{};  ///< K/W, of one motor, to its surroundings.
  std::string locked_rotor{};                          ///< A file that tells the heat capacity.
  double ambient_temperature = 25.0;                   ///< °C
  double temperature_limit = 125.0;                    ///< °C
  std::optional<double> gearing_low{}, gearing_high{};
  bool compare_motors = true;
  Time longest{30.0};
};

}  // namespace flyball::study
