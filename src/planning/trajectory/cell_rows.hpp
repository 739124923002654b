#pragma once

#include <memory>
#include <span>
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
  /// Rows and caps of the intervals. @param about  A motion, one an interval, about which is put
  /// what is not linear; or empty.
  virtual void fill(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& about,
                    TimingRows& rows) = 0;
  /// Holds a motion against the limits themselves, and rows that it breaks to what they were off.
  /// @param off  How far the limits are from their polynomials in each interval, of the limits.
  /// @return Whether it keeps to all of them.
  virtual bool verify(const std::vector<TimingCell>& /*cells*/, const std::vector<Bezier2>& /*b*/,
                      TimingRows& /*rows*/, std::vector<double>& off) {
    off.clear();
    return true;
  }
  /// How much of the limits an interval leaves: 0 where one is used up all over it.
  [[nodiscard]] virtual double left(const std::vector<TimingCell>& cells, std::size_t cell,
                                    const Bezier2& b, const TimingRows& rows) const = 0;

  /// Whether `fill` looks at a motion.
  [[nodiscard]] virtual bool is_put_about() const { return false; }

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
