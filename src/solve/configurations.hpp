#pragma once

#include <vector>

#include "solve/row.hpp"

namespace flyball::solve {

/// Spaces of a mechanism's coordinates, and paths through them.
[[nodiscard]] std::vector<Kind> configuration_kinds();

}  // namespace flyball::solve
