#pragma once

#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// The matrices of a discrete system, for what does not ask how long its period is.
[[nodiscard]] inline ContinuousSystem<> bare(const DiscreteSystem<>& s) {
  return {s.A, s.B, s.C, s.D};
}

/// And back.
[[nodiscard]] inline DiscreteSystem<> timed(const ContinuousSystem<>& s, Time period) {
  return {s.A, s.B, s.C, s.D, period};
}

}  // namespace flyball::detail
