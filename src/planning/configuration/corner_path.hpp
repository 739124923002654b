#pragma once

#include <optional>

#include "planning/configuration/path_search.hpp"

namespace flyball::detail {

/// The shortest path among regions of two axes: from corner to corner of their boundaries. Nothing
/// if there is none, more than 600 corners, or no work left.
/// @param complete  Whether nothing means that there is none but between regions that touch.
[[nodiscard]] std::optional<ConfigurationPath> corner_path(const ConfigurationSpace& space,
                                                           const double* start, const double* goal,
                                                           WorkBound& bound, bool& complete);

/// A* over a grid of two axes whose cells are proven free, then any angle.
[[nodiscard]] std::optional<ConfigurationPath> space_grid_path(Judge& judge, const double* start,
                                                               const double* goal, int cells,
                                                               double clearance, WorkBound& bound);

/// Least-cost way over a graph whose edges are judged when they are needed.
class Roadmap {
 public:
  /// Adds random valid configurations until there are `nodes`.
  void grow(Judge& judge, Random& random, int nodes, WorkBound& bound);
  [[nodiscard]] std::optional<ConfigurationPath> way(Judge& judge, const double* start,
                                                     const double* goal, WorkBound& bound);
  [[nodiscard]] int size() const noexcept { return static_cast<int>(nodes_.size()); }

 private:
  struct Link {
    int to;
    float length;
    int state;  ///< 0: not judged; 1: free; 2: blocked.
  };
  [[nodiscard]] std::vector<Link> links_from(const Judge& judge, const Configuration& q) const;

  std::vector<Configuration> nodes_{};
  std::vector<std::vector<Link>> links_{};
};

}  // namespace flyball::detail
