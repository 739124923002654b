#include <flyball/planning/configuration/grid_path.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_grid_path = "grid_path";

Expected<void> check_cell(const OccupancyGrid& grid, std::array<int, 2> cell,
                          std::string_view name) {
  const bool inside = cell[0] >= 0 && cell[0] < grid.columns && cell[1] >= 0 && cell[1] < grid.rows;
  if (!inside ||
      grid.blocked[static_cast<std::size_t>(cell[1]) * static_cast<std::size_t>(grid.columns) +
                   static_cast<std::size_t>(cell[0])] != 0) {
    return refusal(ArgumentError::out_of_range, in_grid_path, name)
        .got(detail::format("({}, {}), {}", cell[0], cell[1],
                            inside ? "which is blocked" : "outside of the grid"))
        .expected("a free cell");
  }
  return {};
}

/// The grid with a border, so that neighbours need no bounds.
class GridSearch {
 public:
  explicit GridSearch(const OccupancyGrid& grid)
      : width_(grid.columns + 2),
        grid_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(grid.rows + 2),
              Cell{1, 0, 0}) {
    for (int r = 0; r < grid.rows; ++r) {
      const std::uint8_t* from =
          grid.blocked.data() + static_cast<std::ptrdiff_t>(r) * grid.columns;
      Cell* to = grid_.data() + index({0, r});
      for (int c = 0; c < grid.columns; ++c) {
        to[c] = {from[c] != 0 ? std::uint8_t{1} : std::uint8_t{0}, 0,
                 std::numeric_limits<std::int32_t>::max()};
      }
    }
    const int w = width_;
    steps_ = {1, -1, w, -w, w + 1, w - 1, -w + 1, -w - 1};
  }

  std::optional<GridPath> run(std::array<int, 2> start, std::array<int, 2> goal) {
    GridPath result;
    const int source = index(start);
    const int target = index(goal);
    column_ = target % width_;
    row_ = target / width_;
    Cell* const cells = grid_.data();
    cells[source].cost = 0;
    int f = estimate(source % width_, source / width_);
    buckets_[static_cast<std::size_t>(f % bucket_count)].push_back(source);
    int empty = 0;
    while (empty < bucket_count) {
      std::vector<int>& bucket = buckets_[static_cast<std::size_t>(f % bucket_count)];
      if (bucket.empty()) {
        ++f;
        ++empty;
        continue;
      }
      empty = 0;
      const int at = bucket.back();
      bucket.pop_back();
      Cell& cell = cells[at];
      if (cell.blocked >= closed) {
        continue;
      }
      cell.blocked = closed;
      ++result.expanded;
      if (at == target) {
        trace(source, target, result);
        return result;
      }
      const std::int32_t cost = cell.cost;
      const int row = at / width_;
      const int column = at - row * width_;
      // Straight ones first: a diagonal needs both of its sides.
      unsigned open = 0;
      for (unsigned d = 0; d < 4; ++d) {
        const int next = at + steps_[d];
        if (cells[next].blocked != 1) {
          open |= 1U << d;
          relax(next, cost + 10, d, column + across[d], row + up[d]);
        }
      }
      constexpr std::array<unsigned, 4> sides{0b0101, 0b0110, 0b1001, 0b1010};
      for (unsigned d = 0; d < 4; ++d) {
        if ((open & sides[d]) == sides[d]) {
          const int next = at + steps_[d + 4];
          if (cells[next].blocked != 1) {
            relax(next, cost + 14, d + 4, column + across[d + 4], row + up[d + 4]);
          }
        }
      }
    }
    return std::nullopt;
  }

 private:
  struct Cell {
    std::uint8_t blocked;  ///< 1: blocked; 2: closed.
    std::uint8_t from;     ///< The step that led here.
    std::int32_t cost;     ///< Ten a cell.
  };
  static constexpr std::uint8_t closed = 2;
  static constexpr int bucket_count = 64;
  static constexpr std::array<int, 8> across{1, -1, 0, 0, 1, -1, 1, -1};
  static constexpr std::array<int, 8> up{0, 0, 1, -1, 1, 1, -1, -1};

  [[nodiscard]] int index(std::array<int, 2> cell) const {
    return (cell[1] + 1) * width_ + cell[0] + 1;
  }
  [[nodiscard]] int estimate(int column, int row) const {
    const int dx = std::abs(column - column_);
    const int dy = std::abs(row - row_);
    return 10 * (dx + dy) - 6 * std::min(dx, dy);
  }
  void relax(int next, std::int32_t cost, unsigned step, int column, int row) {
    Cell& cell = grid_[static_cast<std::size_t>(next)];
    if (cell.blocked == 0 && cost < cell.cost) {
      cell.cost = cost;
      cell.from = static_cast<std::uint8_t>(step);
      buckets_[static_cast<std::size_t>((cost + estimate(column, row)) % bucket_count)].push_back(
          next);
    }
  }

  /// Whether the line between the middles of two cells keeps to free cells; through a corner both
  /// sides have to be free.
  [[nodiscard]] bool sees(int a, int b) const {
    const int dx = std::abs(b % width_ - a % width_);
    const int dy = std::abs(b / width_ - a / width_);
    const int sx = b % width_ > a % width_ ? 1 : -1;
    const int sy = b / width_ > a / width_ ? width_ : -width_;
    long error = dx - dy;
    int at = a;
    for (int left = dx + dy; left > 0; --left) {
      if (error > 0) {
        at += sx;
        error -= 2L * dy;
      } else if (error < 0) {
        at += sy;
        error += 2L * dx;
      } else {
        if (is_blocked(at + sx) || is_blocked(at + sy)) {
          return false;
        }
        at += sx + sy;
        error += 2L * dx - 2L * dy;
        --left;
      }
      if (is_blocked(at)) {
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] bool is_blocked(int at) const {
    return grid_[static_cast<std::size_t>(at)].blocked == 1;
  }

  void trace(int source, int target, GridPath& result) const {
    std::vector<int> way{target};
    while (way.back() != source) {
      const int at = way.back();
      way.push_back(at - steps_[grid_[static_cast<std::size_t>(at)].from]);
    }
    std::reverse(way.begin(), way.end());
    std::vector<int> turns{way.front()};
    // As far as can be seen, by steps that double and then halve.
    for (std::size_t i = 0; i + 1 < way.size();) {
      std::size_t far = i + 1;
      std::size_t step = 1;
      while (far + step < way.size() && sees(way[i], way[far + step])) {
        far += step;
        step *= 2;
      }
      for (; step > 0; step /= 2) {
        if (far + step < way.size() && sees(way[i], way[far + step])) {
          far += step;
        }
      }
      turns.push_back(way[far]);
      i = far;
    }
    for (std::size_t i = 0; i < turns.size(); ++i) {
      result.cells.push_back({turns[i] % width_ - 1, turns[i] / width_ - 1});
      if (i > 0) {
        result.length += std::hypot(result.cells[i][0] - result.cells[i - 1][0],
                                    result.cells[i][1] - result.cells[i - 1][1]);
      }
    }
  }

  int width_;
  int column_ = 0;
  int row_ = 0;
  std::array<int, 8> steps_{};
  std::vector<Cell> grid_;
  std::array<std::vector<int>, bucket_count> buckets_{};
};

}  // namespace

Expected<std::optional<GridPath>> grid_path(const OccupancyGrid& grid, std::array<int, 2> start,
                                            std::array<int, 2> goal) {
  constexpr double most = 268435456.0;
  const double cells = static_cast<double>(grid.columns) * grid.rows;
  if (grid.columns < 1 || grid.rows < 1 || cells > most ||
      grid.blocked.size() != static_cast<std::size_t>(cells)) {
    return refusal(ArgumentError::wrong_shape, in_grid_path, "grid")
        .got(detail::format("{} x {} with {} cells", grid.columns, grid.rows, grid.blocked.size()))
        .expected("columns x rows cells, 1 to 2^28");
  }
  FLYBALL_CHECK(check_cell(grid, start, "start"));
  FLYBALL_CHECK(check_cell(grid, goal, "goal"));
  return GridSearch(grid).run(start, goal);
}

}  // namespace flyball
