#pragma once

namespace flyball {

/// What a random variable is like on the whole.
struct Moments {
  double mean = 0.0;      ///< E[x].
  double variance = 0.0;  ///< E[(x - E[x])²].
};

}  // namespace flyball
