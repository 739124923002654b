#pragma once

#include <flyball/core/expected.hpp>
#include <flyball/planning/configuration/configuration_space.hpp>

namespace flyball::detail {

/// Axes of a space: names, stops, scales.
[[nodiscard]] Expected<void> check_axes(const std::vector<SpaceAxis>& axes);
/// The numbers of a region.
[[nodiscard]] Expected<void> check_region(const std::vector<SpaceAxis>& axes,
                                          const std::string& name, const Region& region);
/// A mechanism that the axes move.
[[nodiscard]] Expected<void> check_mechanism(const std::vector<SpaceAxis>& axes,
                                             const PlanarMechanism& mechanism);

}  // namespace flyball::detail
