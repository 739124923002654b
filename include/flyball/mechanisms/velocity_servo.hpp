#pragma once

#include <flyball/mechanisms/mechanism.hpp>

namespace flyball::mechanisms {

/// A position whose velocity is the input: dx/dt = 0 x + 1 u, y = x, for a mechanism that follows
/// its voltage faster than it is sampled, so that kA cannot be told from zero. The volts for a
/// velocity u are kS sgn(u) + kV u + gravity.
/// Source: book, Theorem 14.3.2.
[[nodiscard]] ContinuousSystem<1, 1, 1> velocity_servo();

}  // namespace flyball::mechanisms
