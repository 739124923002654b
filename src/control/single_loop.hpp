#pragma once

#include <string_view>

#include <flyball/systems/system.hpp>

/// What the simulated experiments of PID tuning ask of their plant and time.
namespace flyball::detail {

/// A well-formed plant of one input and one output.
[[nodiscard]] Expected<void> check_single_loop(const DiscreteSystem<>& plant,
                                               std::string_view where);

/// The periods in a duration, 2 … 10⁷.
[[nodiscard]] Expected<int> steps_of(double duration, double period, std::string_view where);

}  // namespace flyball::detail
