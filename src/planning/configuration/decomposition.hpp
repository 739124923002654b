#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "planning/configuration/path_search.hpp"

namespace flyball::detail {

/// What boxes say of a query.
struct BoxAnswer {
  std::optional<ConfigurationPath> path{};  ///< Through free boxes, or by what `along` grew.
  bool grown = false;                       ///< Whether `along` found it.
  bool proven = false;                      ///< Whether it is proven that there is no path.
  long boxes = 0;
  double finest = 1.0;  ///< The smallest box, as a share of the space along an axis.
};

/// Splits what can be reached from the two ends into boxes that are free, blocked or, while they
/// are not decided, split on: the box under study is always one of the coarsest that connects the
/// ends. Whoever is walled in by blocked boxes cannot leave. What was judged, and what
/// is closed, is kept for the next query.
class BoxTree {
 public:
  /// @param judge  Must outlive this.
  explicit BoxTree(Judge& judge);
  ~BoxTree();
  BoxTree(const BoxTree&) = delete;
  BoxTree& operator=(const BoxTree&) = delete;

  /// @param boxes  At most so many more. @param along  Looks for a path along a channel of boxes
  /// that are not blocked, with so many moves; may be empty.
  BoxAnswer connect(const double* start, const double* goal, long boxes, WorkBound& bound,
                    const GrowAlong& along);

 private:
  class Boxes;
  std::unique_ptr<Boxes> boxes_;
};

}  // namespace flyball::detail
