#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include <flyball/planning/path/path.hpp>

#include "planning/trajectory/jerk_program.hpp"
#include "planning/trajectory/motion_limit.hpp"
#include "planning/trajectory/timing.hpp"

/// The limits of the jerk as rows of a convex program.
namespace flyball::detail {

/// With s⃛ = ½ x'' √x a jerk is √x P, P = e x + b u + ½ a x'' linear in b, and 1/√x is convex, so
/// that about any x̄
///
///     ±P <= 3/2 x̄^{-1/2} - ½ x x̄^{-3/2}   <=>   ±⅔ P √x̄ + x/(3 x̄) <= 1
///
/// is more than |P| √x <= 1 asks for, and as much at x = x̄. That is put through four points of the
/// interval as a cubic, whose Bézier points are the rows; what it is off at three more points is
/// left free, as by `collocated_rows`.
/// Source: Debrouwere, Van Loock, Pipeleers, Tran Dinh, Diehl, De Schutter, Swevers, "Time-optimal
/// path following for robots with convex-concave constraints using sequential convex programming",
/// IEEE T-RO 29 (2013), for convex inner programs one after the other.
class JerkRows {
 public:
  /// Points of an interval, τ = k/6.
  static constexpr std::size_t points = 7;
  using Values = std::array<double, points>;

  /// @param path, limits  Must outlive this.
  JerkRows(const Path& path, const std::vector<std::unique_ptr<MotionLimit>>& limits);

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  /// Looks at the path on these intervals.
  void look(const std::vector<TimingCell>& cells);
  /// Rows of an interval about x̄, into the program.
  void add(const TimingCell& cell, std::size_t i, const Values& about, JerkProgram& program) const;
  /// Whether an interval's rows and what lies between them are kept to. What is between them is
  /// left free from now on.
  bool verify(const TimingCell& cell, std::size_t i, const Values& about, const Bezier2& b);
  /// The largest |jerk| of its limit at a point.
  [[nodiscard]] double use(const TimingCell& cell, std::size_t i, std::size_t k,
                           const Bezier2& b) const;

  /// By how much rounding of b by 1 changes a row, at most: x √x/w² of the limits.
  [[nodiscard]] double rounding(const TimingCell& cell, std::size_t i, const Bezier2& b) const;
  /// The largest y = s⃛^{2/3} of a constant s⃛ from rest over `width` at the beginning of an
  /// interval, or to rest at its end: the jerk is s⃛ (4.5 s² q''' + 9 s q'' + q').
  /// @param backwards  To rest at the end.
  [[nodiscard]] double from_rest(const TimingCell& cell, bool backwards) const;

 private:
  [[nodiscard]] double slope_of(const JerkRow& row, const TimingCell& cell, double tau,
                                const Bezier2& b) const;
  void evaluate(const TimingCell& cell, double tau, JerkRow* rows) const;

  const Path& path_;
  const std::vector<std::unique_ptr<MotionLimit>>& limits_;
  std::size_t count_ = 0;
  std::vector<JerkRow> at_;   ///< Of interval, point, row.
  std::vector<double> room_;  ///< Of interval, row.
};

}  // namespace flyball::detail
