#pragma once

#include <limits>
#include <numbers>

/// The numbers that most sources name, once for all.
namespace flyball {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
/// The distance from 1 to the next double, 2⁻⁵².
inline constexpr double epsilon = std::numeric_limits<double>::epsilon();
inline constexpr double pi = std::numbers::pi;
inline constexpr double full_turn = 2.0 * pi;     ///< rad
inline constexpr double one_degree = pi / 180.0;  ///< rad

}  // namespace flyball
