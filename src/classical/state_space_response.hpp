#pragma once

#include <memory>

#include <flyball/classical/frequency_response.hpp>

namespace flyball::classical::detail {

/// What stands behind the response of a state space; z's if it has a period.
[[nodiscard]] std::shared_ptr<const FrequencyResponse::Source> state_space_source(
    const ContinuousSystem<>& system, std::optional<Time> period, double delay);

}  // namespace flyball::classical::detail
