#pragma once

#include <optional>
#include <vector>

#include "planning/configuration/path_search.hpp"

namespace flyball::detail {

/// What boxes say of a query.
struct BoxAnswer {
  std::optional<Path> path{};  ///< Through free boxes.
  bool proven = false;         ///< Whether it is proven that there is no path.
  long boxes = 0;
  double finest = 1.0;  ///< The smallest box, as a share of the space along an axis.
};

/// Splits what can be reached from the two ends into boxes that are free, blocked or, while they
/// are not decided, split on: the box under study is always one of the coarsest that connects the
/// ends. Whoever is walled in by blocked boxes cannot leave.
/// @param boxes  At most so many.
BoxAnswer decompose(Judge& judge, const double* start, const double* goal, long boxes,
                    WorkBound& bound);

}  // namespace flyball::detail
