#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Core>

#include <flyball/control/lyapunov/region_of_attraction.hpp>
#include <flyball/core/signal.hpp>

namespace flyball {

/// What holds a mechanism at an unstable equilibrium with one input, and from where: the numbers of
/// a certified region.
template <int N>
struct BalanceDesign {
  Eigen::Vector<double, N> x = Eigen::Vector<double, N>::Zero();        ///< x*
  Eigen::Matrix<double, N, N> P = Eigen::Matrix<double, N, N>::Zero();  ///< Of V.
  Eigen::RowVector<double, N> K = Eigen::RowVector<double, N>::Zero();
  std::array<bool, static_cast<std::size_t>(N)> angle{};  ///< Of the states.
  double u = 0.0;                                         ///< u*
  double u_min = 0.0;
  double u_max = 0.0;
  double take = 0.0;   ///< V at most: taken over.
  double leave = 0.0;  ///< V above: given up; not below `take`.
};

/// The run-time numbers of a certified loop of N states and one input.
/// @param hysteresis  `leave` over `take`, at least 1: noise and sampling on the border do not make
/// the controllers alternate.
/// @errors ArgumentError::wrong_shape for a loop of another size, out_of_range for the hysteresis,
/// and
///         for a loop without limits, whose input has none at run time either.
template <int N>
[[nodiscard]] Expected<BalanceDesign<N>> balance_design(const SaturatedLoop& loop,
                                                        const CertifiedRegion& region,
                                                        double hysteresis = 1.5) {
  Checks checks("balance_design");
  checks.shape(loop.K, 1, N, "K", "1 x states")
      .shape(region.P, N, N, "the region's P", "states x states")
      .shape(loop.u_min, 1, 1, "u_min", "1 x 1")
      .shape(loop.u_max, 1, 1, "u_max", "1 x 1")
      .within(hysteresis, 1.0, 1e6, "hysteresis")
      .positive(region.level, "the region's level");
  return checks.map([&] {
    BalanceDesign<N> design{.x = loop.x,
                            .P = region.P,
                            .K = loop.K,
                            .u = loop.u(0),
                            .u_min = loop.u_min(0),
                            .u_max = loop.u_max(0),
                            .take = region.level,
                            .leave = hysteresis * region.level};
    for (const Eigen::Index i : loop.angles) {
      design.angle[static_cast<std::size_t>(i)] = true;
    }
    return design;
  });
}

/// Holds a mechanism at an equilibrium from wherever it is known to work: u = clamp(u* + K (x* -
/// x)), and whether to, with hysteresis.
///
/// Run-time object: noexcept, allocation-free, finite and within the limits whatever comes.
template <int N>
class Balance {
 public:
  using State = Eigen::Vector<double, N>;

  /// @param design  As `design_balance` gives it.
  explicit Balance(const BalanceDesign<N>& design) noexcept : design_(design) {}

  /// V(x), angles the shorter way round; infinite for what is no state.
  [[nodiscard]] double value(const State& x) const noexcept {
    const State e = error(x);
    const double V = e.dot(design_.P * e);
    return V >= 0.0 ? V : std::numeric_limits<double>::infinity();
  }
  /// Whether it is in charge, from this state on.
  [[nodiscard]] bool engage(const State& x) noexcept {
    const double V = value(x);
    engaged_ = V <= (engaged_ ? design_.leave : design_.take);
    return engaged_;
  }
  [[nodiscard]] bool engaged() const noexcept { return engaged_; }
  /// Forgets that it was.
  void reset() noexcept { engaged_ = false; }
  /// The input.
  [[nodiscard]] double calculate(const State& x) const noexcept {
    return detail::limited(design_.u - design_.K.dot(error(x)), design_.u_min, design_.u_max);
  }
  [[nodiscard]] const BalanceDesign<N>& design() const noexcept { return design_; }

 private:
  [[nodiscard]] State error(const State& x) const noexcept {
    State e = x - design_.x;
    for (int i = 0; i < N; ++i) {
      if (design_.angle[static_cast<std::size_t>(i)]) {
        e(i) = std::remainder(e(i), 2.0 * std::numbers::pi);
      }
    }
    return e;
  }

  BalanceDesign<N> design_;
  bool engaged_ = false;
};

/// Swings up and balances: a law that brings the energy to that of the upright position, and from
/// where the balance is proven to work, the balance.
///
/// Run-time object: noexcept, allocation-free, bounded, finite and within the limits whatever
/// comes.
/// @tparam Shaper  Has `calculate(x)`, noexcept: the input away from the equilibrium.
/// Source: Spong, "Energy based control of a class of underactuated mechanical systems", IFAC World
/// Congress 1996; Åström and Furuta, "Swinging up a pendulum by energy control", Automatica 36
/// (2000).
template <class Shaper, int N>
class SwingUp {
 public:
  using State = Eigen::Vector<double, N>;

  /// @param shaper  What brings it near. @param design  What holds it there.
  SwingUp(const Shaper& shaper, const BalanceDesign<N>& design) noexcept
      : shaper_(shaper), balance_(design) {}

  /// The input. @param x  N x 1, measured or estimated.
  [[nodiscard]] double calculate(const State& x) noexcept {
    State at = x;
    detail::keep_signals(at);
    if (balance_.engage(at)) {
      return balance_.calculate(at);
    }
    const BalanceDesign<N>& design = balance_.design();
    return detail::limited(shaper_.calculate(at), design.u_min, design.u_max);
  }
  /// Whether it balances.
  [[nodiscard]] bool balancing() const noexcept { return balance_.engaged(); }
  void reset() noexcept { balance_.reset(); }
  [[nodiscard]] const Balance<N>& balance() const noexcept { return balance_; }
  [[nodiscard]] const Shaper& shaper() const noexcept { return shaper_; }

 private:
  Shaper shaper_;
  Balance<N> balance_;
};

}  // namespace flyball
