#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include <flyball/control/lyapunov/region_of_attraction.hpp>
#include <flyball/math/expression/differentiate.hpp>

#include "math/verified/interval_tape.hpp"
#include "math/verified/taylor_tape.hpp"

namespace flyball::detail {

inline constexpr int most_region_states = most_parameters;
using Coordinates = std::array<double, most_region_states>;

/// A box of the coordinates z, x = x* + T z: |z_i - centre_i| <= half_i. Both exact.
struct RegionCell {
  Coordinates centre{};
  Coordinates half{};
};

/// What is known of V̇ over a cell.
struct CellBound {
  double high = 0.0;    ///< No less than V̇ anywhere in it; NaN where nothing is known.
  Coordinates share{};  ///< What each coordinate's width adds.
};

/// A loop in the coordinates z in which V = |z|², nearly: T = x by z, TᵀPT = I within rounding.
class LoopEnclosure {
 public:
  LoopEnclosure(const SaturatedLoop& loop, const Eigen::MatrixXd& P, const Eigen::MatrixXd& T);

  [[nodiscard]] int states() const noexcept { return n_; }
  /// Bounds of V over |z|² = 1: within 1 ± this.
  [[nodiscard]] double slack() const noexcept { return slack_; }
  /// V at least, and at most, in a cell.
  [[nodiscard]] double least(const RegionCell& cell) const noexcept;
  [[nodiscard]] double most(const RegionCell& cell) const noexcept;

  [[nodiscard]] CellBound bound(const RegionCell& cell) noexcept;

  /// The largest eigenvalue of F + Fᵀ over the box |z_i| <= half, from above: the loop contracts
  /// there where it is negative. Infinite where nothing is known.
  [[nodiscard]] double core_rate(double half) noexcept;
  /// |f_z(0)|, from above: what is left of the equilibrium.
  [[nodiscard]] double rest() noexcept;

  /// V̇ at z, in plain floating point.
  [[nodiscard]] double rate(const Eigen::VectorXd& z);

 private:
  using Row = std::array<Interval, most_region_states>;
  using Square = std::array<Row, most_region_states>;

  /// What an input does over a cell: K's, one of its limits, or now one and now the other.
  enum class Regime { linear, low, high, mixed };
  using Regimes = std::array<Regime, most_region_states>;

  /// The regimes of each input that a cell meets: bits of linear, low and high.
  [[nodiscard]] std::array<unsigned, most_region_states> regimes_of(
      const RegionCell& cell) noexcept;
  /// V̇ over the cell whose centre was evaluated last.
  [[nodiscard]] TaylorForm rate_in(const RegionCell& cell, const Regimes& regimes) noexcept;
  /// x and u at a centre.
  void evaluate_centre(const Coordinates& centre) noexcept;
  /// F over the cell about the centre that was evaluated last.
  void evaluate_jacobian(const Coordinates& half) noexcept;

  const SaturatedLoop& loop_;
  Eigen::MatrixXd P_, T_;
  int n_, m_;
  expression::Derivatives derivatives_;
  IntervalTape f_;
  TaylorTape forms_;
  IntervalTape jacobian_;
  Square W_{};                  ///< TᵀP
  std::vector<Interval> KT_{};  ///< m x n, row by row.
  double slack_ = 0.0;
  /// f is affine in u: V̇ is then least and largest where each input is at an end of its range.
  bool affine_ = false;
  std::vector<Interval> in_{}, box_{};
  std::vector<Interval> u_raw_{};
  std::vector<TaylorForm> form_in_{};
  Square F_{};
  std::vector<double> values_{}, point_{}, slope_{};
};

}  // namespace flyball::detail
