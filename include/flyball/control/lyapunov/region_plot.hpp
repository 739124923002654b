#pragma once

#include <string>
#include <vector>

#include <flyball/control/lyapunov/region_of_attraction.hpp>
#include <flyball/core/coordinate.hpp>
#include <flyball/core/figure.hpp>

namespace flyball {

/// The certified region in the plane of two states, the others at x*: its border, what of the plane
/// comes to the equilibrium where a sample is given, and for a loop of two states from where it is
/// reached within some times.
/// @param names  n, of the states, for the axes. @param first, second  Of the axes.
/// @param sampled  Over the same plane; or null. @param times  s, of `backward_rings`, in a loop of
/// two states.
/// @errors As `backward_rings`.
[[nodiscard]] Expected<Plot> region_plot(const SaturatedLoop& loop, const CertifiedRegion& region,
                                         const std::vector<Coordinate>& names, Eigen::Index first,
                                         Eigen::Index second,
                                         const SampledRegion* sampled = nullptr,
                                         const std::vector<double>& times = {});

}  // namespace flyball
