#pragma once

#include <cmath>
#include <optional>
#include <string_view>

#include <flyball/systems/system.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

/// Sample periods in a dead time that `check_whole_periods` let pass; 0 of a continuous one.
[[nodiscard]] inline Eigen::Index periods_in(double delay, const std::optional<Time>& period) {
  return period ? static_cast<Eigen::Index>(std::llround(delay / period->si())) : 0;
}

/// A discrete system's dead time is zero or whole periods, of which there are so few that they can
/// be counted: what is positive and no period at all would be neither.
/// @param delay  s, not negative. @errors ArgumentError::out_of_range.
[[nodiscard]] inline Expected<void> check_whole_periods(double delay,
                                                        const std::optional<Time>& period,
                                                        std::string_view where,
                                                        std::string_view of) {
  constexpr double most = 1e9;
  const double periods = period ? delay / period->si() : 0.0;
  const double whole = std::round(periods);
  if (!period || delay == 0.0 ||
      (whole >= 1.0 && whole <= most && std::abs(periods - whole) <= 1e-9 * periods)) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, "delay")
      .got(periods > 0.0 ? flyball::detail::format("{} periods", periods)
                         : flyball::detail::format("{} s", delay))
      .expected(whole <= most ? flyball::detail::format("whole periods, for {}", of)
                              : flyball::detail::format("at most {} periods", most));
}

}  // namespace flyball::classical::detail
