#pragma once

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/response_margins.hpp>

/// What loops that are closed in several ways have in common is looked for once.
namespace flyball::classical::detail {

/// `frequency_response` and `peak_gain` of a system of which the rightmost poles are known.
[[nodiscard]] FrequencyResponse response_with(const DelaySystem& system,
                                              const Eigen::VectorXcd& rightmost);
[[nodiscard]] Expected<Peak> peak_gain_with(const DelaySystem& system,
                                            const Eigen::VectorXcd& rightmost);

}  // namespace flyball::classical::detail
