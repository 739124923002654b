#pragma once

#include <optional>

#include "classical/delay_characteristic.hpp"

/// How many poles of a system with dead time lie right of a line.
namespace flyball::classical::detail {

/// What all counts of one system may take together, in determinants: 400 000, and fewer of more
/// than ten states and delays, N, of which one costs O(N³).
struct PoleCountWork {
  explicit PoleCountWork(const Characteristic& f);

  long left;
};

/// By the determinant's turns along Re s = line, and round the half circle on which it is
/// det(sI - A) but for loop gains below one. Nothing where it cannot be told: a pole on the line,
/// or no work left.
/// @param line  Right of what the jumps' poles tend to. @param highest  rad/s, beyond which no
/// loop gain matters.
[[nodiscard]] std::optional<int> count_right_of(const Characteristic& f, double line,
                                                double highest, PoleCountWork& work);

}  // namespace flyball::classical::detail
