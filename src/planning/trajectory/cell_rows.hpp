#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <flyball/planning/path/path.hpp>
#include <flyball/planning/trajectory/path_constraint.hpp>

#include "planning/trajectory/motion_limit.hpp"
#include "planning/trajectory/timing.hpp"

/// The limits of an interval of a path as rows of its linear program.
namespace flyball::detail {

/// Makes the rows of a path's intervals.
class CellRows {
 public:
  virtual ~CellRows() = default;
  /// Rows and caps of the intervals.
  virtual void fill(const std::vector<TimingCell>& cells, TimingRows& rows) = 0;
  /// How far the limits are from their polynomials in each interval of a motion, of the limits;
  /// margins are made of it. @return Whether the motion keeps within the limits.
  virtual bool verify(const std::vector<TimingCell>& /*cells*/, const std::vector<Bezier2>& /*b*/,
                      TimingRows& /*rows*/) {
    return true;
  }
  /// Use of the limits at τ = 0, 1/3, 2/3, 1 of an interval, 1 where one binds, and which one is
  /// used most on the average.
  struct Use {
    std::array<double, 4> at{};
    int limit = 0;
    double mean = 0.0;  ///< Of that one.
  };
  [[nodiscard]] virtual Use use(const std::vector<TimingCell>& cells, std::size_t cell,
                                const Bezier2& b, const TimingRows& rows) const = 0;
  [[nodiscard]] virtual std::string name(int limit) const = 0;

 protected:
  CellRows() = default;
  CellRows(const CellRows&) = default;
  CellRows& operator=(const CellRows&) = default;
};

/// Of limits of the coordinates on cubics and less: exact.
[[nodiscard]] std::unique_ptr<CellRows> cubic_rows(const Path& path,
                                                   const CoordinateLimits& limits);
/// Of any limits on any path: polynomials through four points of each interval, held to what three
/// more points say they are off.
[[nodiscard]] std::unique_ptr<CellRows> collocated_rows(
    const Path& path, std::vector<std::unique_ptr<MotionLimit>> limits);

}  // namespace flyball::detail
