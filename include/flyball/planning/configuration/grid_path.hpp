#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// Cells in rows, each free or not.
struct OccupancyGrid {
  int columns = 0;
  int rows = 0;
  std::vector<std::uint8_t> blocked{};  ///< rows x columns, row by row; 0: free.
};

/// A way over a grid.
struct GridPath {
  /// Column and row of each turn, the ends included. Between two of them the straight line keeps
  /// to free cells.
  std::vector<std::array<int, 2>> cells{};
  double length = 0.0;  ///< In cells.
  long expanded = 0;    ///< Cells that were looked at.
};

/// The shortest way over free cells in steps to the eight neighbours, diagonals only between free
/// cells, by A*; then with any angles, as far as lines keep to free cells.
///
/// @param grid   At most 2^28 cells.  @param start, goal  Column and row of free cells.
/// @return       Nothing if there is no way: all cells that can be reached were seen.
/// @errors       ArgumentError::wrong_shape, out_of_range (a cell outside, or blocked).
/// Cost: O(cells); 8 bytes a cell are allocated.
/// Source: P. Hart, N. Nilsson, B. Raphael, IEEE T-SSC 4 (1968); R. Dial, CACM 12 (1969): buckets;
/// book, section 16.2 (discretize the plot into a grid).
[[nodiscard]] Expected<std::optional<GridPath>> grid_path(const OccupancyGrid& grid,
                                                          std::array<int, 2> start,
                                                          std::array<int, 2> goal);

}  // namespace flyball
