#pragma once

#include <algorithm>
#include <vector>

#include <flyball/control/finite_horizon_lqr.hpp>
#include <flyball/core/signal.hpp>
#include <flyball/systems/any_model.hpp>

namespace flyball {

/// A model along a trajectory: at each of N steps the exact linearisation of one RK4 step with the
/// input held,
///
///     δx_{k+1} = A_k δx_k + B_k δu_k,    A_k = ∂φ/∂x, B_k = ∂φ/∂u at (x_k, u_k),
///
/// φ(x, u) the state a period later.
struct TrajectoryLinearization {
  std::vector<DiscretizedMatrices> steps;  ///< N, each n x n and n x m.
  /// n x N, φ(x_k, u_k) - x_{k+1}: zero where the trajectory is one of the model.
  Eigen::MatrixXd defects;
};

/// @param x  n x (N + 1), the states. @param u  m x N, the inputs, each held for one period.
/// @param period  T, s.
/// @errors ArgumentError::wrong_shape, empty, not_finite, not_positive; those of `check_model` with
///         the time. Cost: four Jacobians a step (the variational equation through the stages);
///         allocates. Source: book, sections 8.2 and 8.7.3.
[[nodiscard]] Expected<TrajectoryLinearization> linearize_along(const AnyModel& model,
                                                                const MatrixRef& x,
                                                                const MatrixRef& u, Time period);

/// A regulator along a trajectory, designed.
struct TrajectoryLqr {
  FiniteHorizonLqr regulator;     ///< K_k, m x n, and S_k.
  TrajectoryLinearization model;  ///< What it was designed for.
  Eigen::MatrixXd x;              ///< n x (N + 1)
  Eigen::MatrixXd u;              ///< m x N
  Time period{};
};

/// The finite-horizon time-varying regulator along a trajectory of any model: minimises
/// δx_NᵀS_N δx_N + Σ δxᵀQδx + δuᵀRδu of the deviations, by the discrete Riccati recursion backwards
/// over the linearised steps.
///
/// @param cost  Q (n x n), R (m x m), N or none. @param S_N  n x n, the weight at the end.
/// @errors As `linearize_along` and `finite_horizon_lqr`.
/// Source: book, sections 8.7.3 and 7.7.2; Bryson and Ho, "Applied Optimal Control" (1975), 2.3.
[[nodiscard]] Expected<TrajectoryLqr> trajectory_lqr(const AnyModel& model, const MatrixRef& x,
                                                     const MatrixRef& u, Time period,
                                                     const QuadraticCost& cost, const Weight& S_N);

/// The table of such a regulator in the loop: u = u_k + K_k (x_k - x) within the limits, x_k the
/// trajectory's state. After the last step it goes on with the last gain about the last state.
///
/// Run-time object: noexcept, finite and within the limits whatever comes, allocation-free; the
/// table is allocated when it is made. What is not a finite number counts as no error.
template <int States, int Inputs>
class TrajectoryRegulator {
 public:
  using StateVector = Eigen::Vector<double, States>;
  using InputVector = Eigen::Vector<double, Inputs>;
  using Gain = Eigen::Matrix<double, Inputs, States>;

  /// @param u_min, u_max  Limits of each input; infinite for none.
  /// @param angles  Which states are angles: their errors go the shorter way.
  /// @errors ArgumentError::wrong_shape for a design of other sizes; out_of_range for limits in the
  ///         wrong order.
  [[nodiscard]] static Expected<TrajectoryRegulator> create(
      const TrajectoryLqr& design, const InputVector& u_min, const InputVector& u_max,
      const Eigen::Vector<bool, States>& angles = Eigen::Vector<bool, States>::Constant(false)) {
    const auto N = static_cast<Eigen::Index>(design.regulator.K.size());
    auto checked = Checks("TrajectoryRegulator")
                       .shape(design.x, States, N + 1, "the trajectory", "states x (steps + 1)")
                       .shape(design.u, Inputs, N, "the inputs", "inputs x steps")
                       .also([&] {
                         return check_positive((u_max - u_min).cwiseMin(1.0).minCoeff(),
                                               "TrajectoryRegulator", "u_max - u_min");
                       });
    if (!checked) {
      return tl::unexpected(checked.error());
    }
    TrajectoryRegulator made(design.period.si(), u_min, u_max, angles);
    for (Eigen::Index k = 0; k < N; ++k) {
      made.table_.push_back(
          {design.x.col(k), design.u.col(k), design.regulator.K[static_cast<std::size_t>(k)]});
    }
    made.table_.push_back({design.x.col(N), design.u.col(N - 1), design.regulator.K.back()});
    return made;
  }

  /// @param step  k; beyond the table its end. @param x  n x 1, the state or its estimate.
  [[nodiscard]] InputVector calculate(std::size_t step, const StateVector& x) const noexcept {
    const Entry& at = table_[std::min(step, table_.size() - 1)];
    StateVector e = at.x - x;
    for (int i = 0; i < States; ++i) {
      e(i) = angles_(i) ? angle_difference(double(e(i)), 0.0) : e(i);
    }
    detail::keep_signals(e);
    InputVector u = at.u + at.K * e;
    for (int i = 0; i < Inputs; ++i) {
      u(i) = detail::limited(u(i), u_min_(i), u_max_(i));
    }
    return u;
  }
  /// The step of a time: t/T rounded down; 0 for what is not a finite number.
  [[nodiscard]] std::size_t step_at(double t) const noexcept {
    const double k = t / period_ + 1e-9;
    const auto last = static_cast<double>(table_.size() - 1);
    return k > 0.0 ? static_cast<std::size_t>(std::min(k, last)) : 0;
  }
  /// K_k; of the last step from there on. @param step  k.
  [[nodiscard]] const Gain& K(std::size_t step) const noexcept {
    return table_[std::min(step, table_.size() - 1)].K;
  }
  /// x_k of the trajectory; the last from there on. @param step  k.
  [[nodiscard]] const StateVector& reference(std::size_t step) const noexcept {
    return table_[std::min(step, table_.size() - 1)].x;
  }

 private:
  struct Entry {
    StateVector x;
    InputVector u;
    Gain K;
  };
  TrajectoryRegulator(double period, const InputVector& u_min, const InputVector& u_max,
                      const Eigen::Vector<bool, States>& angles)
      : period_(period), u_min_(u_min), u_max_(u_max), angles_(angles) {}

  double period_;
  InputVector u_min_;
  InputVector u_max_;
  Eigen::Vector<bool, States> angles_;
  std::vector<Entry> table_;  ///< One an instant; the last is the trajectory's end.
};

}  // namespace flyball
