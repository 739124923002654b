#pragma once

#include <optional>

#include "classical/delay_characteristic.hpp"

/// How many poles of a system with dead time lie right of a line.
namespace flyball::classical::detail {

/// By the determinant's turns along Re s = line, and round the half circle on which it is
/// det(sI - A) but for loop gains below one. Nothing where it cannot be told: a pole on the line,
/// or more than 300 000 evaluations.
/// @param line  Right of what the jumps' poles tend to. @param highest  rad/s, beyond which no
/// loop gain matters.
[[nodiscard]] std::optional<int> count_right_of(const Characteristic& f, double line,
                                                double highest);

}  // namespace flyball::classical::detail
