#include <flyball/mechanisms/power/powered.hpp>

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

}  // namespace flyball::mechanisms
