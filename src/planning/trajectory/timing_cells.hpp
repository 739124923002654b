#pragma once

#include <vector>

#include <flyball/planning/path/path.hpp>

#include "planning/trajectory/timing.hpp"

/// The intervals of a path's timing: made, weighed and cut.
namespace flyball::detail {

/// What a timing asks of a path's joints.
struct JointRules {
  bool accelerates = true;  ///< Whether an acceleration is limited; else velocities may jump.
  bool faces = false;       ///< Whether turning rates are those of the way, and may not jump.
  bool bends = false;       ///< Whether no acceleration may jump: of coordinates with limited jerk.
};

/// The intervals of the first pass. @param cuts  Of each piece, where intervals are to end; or
/// empty.
[[nodiscard]] std::vector<TimingCell> coarse_cells(const Path& path,
                                                   const std::vector<std::vector<double>>& cuts,
                                                   const JointRules& rules);

[[nodiscard]] double total_duration(const std::vector<TimingCell>& cells,
                                    const std::vector<Bezier2>& b);

/// What each interval costs: its time times the share of the limits that it leaves. Where x is
/// smallest that share slows down the way to it and from it, too. @param left  Those shares.
[[nodiscard]] std::vector<double> losses(const std::vector<TimingCell>& cells,
                                         const std::vector<Bezier2>& b,
                                         const std::vector<double>& left);

/// The part of a parabola between two shares of its interval.
[[nodiscard]] Bezier2 part_of(const Bezier2& b, double from, double to) noexcept;

/// Parts of intervals, made fewer in one proportion where they are more than `most` in all.
void share_out(std::vector<int>& parts, std::size_t most);

/// Intervals cut into parts, and a motion on them.
void refine(std::vector<TimingCell>& cells, std::vector<Bezier2>& motion,
            const std::vector<int>& parts);

}  // namespace flyball::detail
