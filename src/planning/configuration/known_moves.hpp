#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "planning/configuration/path_search.hpp"

namespace flyball::detail {

/// The moves of the paths that were found, as a graph: where both ends reach it by a free move, its
/// way answers the query without a search. Planning from experience; compare Coleman, Şucan, Moll,
/// Okada and Correll, "Experience-based planning with sparse roadmap spanners", ICRA 2015.
class KnownMoves {
 public:
  /// Keeps a path's moves, each judged, and joins them to what is near. Nothing is added beyond a
  /// thousand places. Cost: two moves a waypoint.
  void learn(Judge& judge, const ConfigurationPath& path);

  /// Cost: at most a dozen moves to leave the ends, O(places) distances, and one search of the
  /// graph.
  [[nodiscard]] std::optional<ConfigurationPath> way(Judge& judge, const double* start,
                                                     const double* goal);
  [[nodiscard]] int size() const noexcept { return static_cast<int>(places_.size()); }

 private:
  struct Link {
    int to;
    float length;
  };
  [[nodiscard]] int part_of(int place) noexcept;
  void join(int a, int b, float length);
  [[nodiscard]] std::optional<std::vector<int>> shortest(const Judge& judge, int from,
                                                         int to) const;

  std::vector<Configuration> places_{};
  std::vector<std::vector<Link>> links_{};
  std::vector<int> parts_{};  ///< Of each place another of the same part; itself: the part's name.
};

}  // namespace flyball::detail
