#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "planning/trajectory/interval_program.hpp"

/// The convex program of a motion whose jerk is limited: x = (ds/dt)² is a parabola on each
/// interval and continuous with its derivative, so that the intervals hang together.
namespace flyball::detail {

/// Minimise Σ ∫ ds/√x over the middle Bézier points m_i > 0 of the intervals, where
///
///     b_0 = z_0 + l m_{i-1} + f m_i,   b_1 = m_i,   b_2 = z_2 + g m_i + h m_{i+1},
///
/// with rows α b_0 + β b_1 + γ b_2 <= right on each interval.
class JerkProgram {
 public:
  /// An interval, and how its points come of the unknowns.
  struct Cell {
    double width = 0.0;
    double z_0 = 0.0, l = 0.0, f = 0.0;
    double z_2 = 0.0, g = 0.0, h = 0.0;
    double rest = 0.0;   ///< Of a way from rest before it, or to rest after it: it takes rest/√m.
    bool fixed = false;  ///< Whether m is given.
  };

  std::vector<Cell> cells;
  std::vector<double> m;  ///< What they are before `solve` is where it begins.

  void clear_rows() noexcept;
  /// Rows come interval after interval.
  void begin_cell() { begins_.push_back(alpha_.size()); }
  void add(double alpha, double beta, double gamma, double right);

  [[nodiscard]] Bezier2 points(std::size_t i) const noexcept;
  /// By the primal-dual interior point method with Mehrotra's corrector (S. Wright, "Primal-Dual
  /// Interior-Point Methods", 1997, chapter 10). The normal matrix has two bands beside its
  /// diagonal.
  /// @param gap  How far the time may be from the least, relative.
  /// @param work  What is left of it, in rows of each step; less by what this takes.
  /// @return Whether all rows are kept to; not where the work was not enough. Cost: ten to forty
  /// passes over the rows.
  [[nodiscard]] bool solve(double gap, double& work);

 private:
  using Symmetric = std::array<double, 6>;  ///< 00, 01, 02, 11, 12, 22

  double differentiate();
  void assemble();
  [[nodiscard]] bool factor();
  /// The step for the complementarities `target_`.
  void direct();
  [[nodiscard]] double largest_share(const std::vector<double>& of,
                                     const std::vector<double>& by) const noexcept;
  [[nodiscard]] std::size_t end_of(std::size_t cell) const noexcept {
    return cell + 1 < begins_.size() ? begins_[cell + 1] : alpha_.size();
  }

  std::vector<std::size_t> begins_;
  std::vector<double> alpha_, beta_, gamma_, right_;
  std::vector<double> slack_, dual_, off_, target_, slack_step_, dual_step_;
  std::vector<Bezier2> slope_;        ///< Of the time, in an interval's b.
  std::vector<Symmetric> curvature_;  ///< The same.
  std::vector<double> rest_slope_, rest_curvature_;
  std::vector<double> diagonal_, next_, after_, step_;
};

}  // namespace flyball::detail
