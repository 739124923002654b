#include <flyball/mechanisms/power/powered.hpp>

#include <flyball/mechanisms/power/metered.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<void> detail::check_supply(std::span<const CurrentLimits> limits, const Battery& battery) {
  constexpr std::string_view where = "powered";
  for (std::size_t k = 0; k < limits.size(); ++k) {
    for (const auto& [value, name] :
         {std::pair{limits[k].stator, "stator"}, {limits[k].supply, "supply"}}) {
      if (!(value >= 0.0)) {
        return refusal(ArgumentError::out_of_range, where,
                       flyball::detail::format("the {} current limit of motor {}", name, k + 1))
            .got(format_number(value) + " A")
            .expected("zero or above; leave it out for no limit");
      }
    }
  }
  return Checks(where)
      .positive(battery.open_circuit_voltage, "the battery's open_circuit_voltage", "V")
      .not_negative(battery.resistance, "the battery's resistance", "Ohm")
      .finite(battery.other_current, "the battery's other_current");
}

Expected<void> detail::check_windings(std::span<const MotorWindings> windings) {
  constexpr std::string_view where = "metered";
  for (std::size_t k = 0; k < windings.size(); ++k) {
    const auto& [winding, count] = windings[k];
    const std::string of = flyball::detail::format(" of motor {}", k + 1);
    for (const auto& [value, name] : {std::pair{winding.heat_capacity, "heat_capacity"},
                                      {winding.thermal_resistance, "thermal_resistance"}}) {
      if (!(value > 0.0)) {
        return refusal(ArgumentError::not_positive, where, name + of)
            .got(format_number(value))
            .expected("greater than zero; leave it out where it is not known");
      }
    }
    FLYBALL_CHECK(Checks(where)
                      .finite(winding.ambient, "ambient" + of)
                      .not_negative(winding.copper, "copper" + of, "1/K"));
    if (count < 1) {
      return refusal(ArgumentError::out_of_range, where, "count" + of)
          .got(std::to_string(count))
          .expected("at least 1");
    }
  }
  return {};
}

}  // namespace flyball::mechanisms
