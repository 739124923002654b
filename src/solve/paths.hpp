#pragma once

#include <vector>

#include "solve/row.hpp"

namespace flyball::solve {

/// Curves through waypoints, and the fastest motions along them.
[[nodiscard]] std::vector<Kind> path_kinds();

}  // namespace flyball::solve
