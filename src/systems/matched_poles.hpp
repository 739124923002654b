#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// Poles and zeros mapped by z = e^{sT}, zeros at infinity but one to -1, and the gain such that
/// G_d(1) = G(0). One input, one output.
[[nodiscard]] Expected<DiscreteSystem<>> match_to_discrete(const ContinuousSystem<>& system,
                                                           Time period);

/// Its inverse: zeros at -1, as near as k equal ones can be found, go back to infinity.
[[nodiscard]] Expected<ContinuousSystem<>> match_to_continuous(const DiscreteSystem<>& system);

}  // namespace flyball::detail
