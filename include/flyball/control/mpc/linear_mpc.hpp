#pragma once

#include <flyball/control/mpc/predictive_controller.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// Linear model predictive control: the first input of
///
///   min  Σ_{k<N} ½ (x_k - r_k)ᵀQ(x_k - r_k) + ½ (u_k - v_k)ᵀR(u_k - v_k)
///          + ½ (x_N - r_N)ᵀQ_end(x_N - r_N)
///   subject to  x_{k+1} = A x_k + B u_k + d,  u_min ≤ u_k ≤ u_max,
///               du_min ≤ u_k - u_{k-1} ≤ du_max,  x_min ≤ x_k ≤ x_max (softened where need be).
///
/// Each period the program is solved, from the active limits of the solution before, one period on;
/// as long as none is active that takes one recursion over the horizon with gains that are known.
///
/// Run-time object: noexcept, no allocation after construction whatever the sizes, at most 20 sets
/// of active limits and 40 steps of an interior-point method a period. Whatever comes, u is finite
/// and within its limits and rates; a state that is not of finite numbers, or beyond
/// `largest_signal`, is answered by the input before.
///
/// ```
/// MpcSettings limits{.horizon = 25};
/// limits.u_min = Eigen::VectorXd::Constant(1, -12.0);
/// limits.u_max = Eigen::VectorXd::Constant(1, 12.0);
/// auto mpc = linear_mpc(plant, bryson({0.02, 0.4}).value(), bryson({12.0}).value(),
///                       limits).value();
/// mpc.set_reference({1.0, 0.0}, u_hold);
/// u = mpc.calculate(x_hat);
/// ```
///
/// Source: Rawlings, Mayne, Diehl, "Model predictive control", 2nd ed. (2017), chapter 1 and
/// section 8.8.4; active sets: Bergounioux, Ito, Kunisch (1999); interior points: Rao, Wright,
/// Rawlings (1998).
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class LinearMpc : public PredictiveController<States, Inputs> {
 public:
  using typename PredictiveController<States, Inputs>::StateVector;

  /// @param A  n x n. @param B  n x m: x⁺ = A x + B u. @param Q  n x n, symmetric, positive
  /// semidefinite, 1/state². @param R  m x m, symmetric, positive definite, 1/input².
  /// @errors ArgumentError::wrong_shape, empty, not_finite, not_symmetric, not_positive for the
  ///         matrices; out_of_range for the horizon and for limits that leave nothing between them,
  ///         with the entry; those of `lqr` where Q_end is left out.
  /// Cost: O(N (n + m)³); allocates.
  [[nodiscard]] static Expected<LinearMpc> create(const MatrixRef& A, const MatrixRef& B,
                                                  const MatrixRef& Q, const MatrixRef& R,
                                                  const MpcSettings& settings) {
    const Checks checks = Checks("linear_mpc")
                              .shape(A, States == Eigen::Dynamic ? A.rows() : States, A.rows(), "A",
                                     "states x states")
                              .shape(B, A.rows(), Inputs == Eigen::Dynamic ? B.cols() : Inputs, "B",
                                     "states x inputs");
    if (!checks) {
      return tl::unexpected(checks.error());
    }
    return detail::MpcCore::make(A, B, Q, R, settings).map([](detail::MpcCore&& core) {
      return LinearMpc(std::move(core));
    });
  }

  /// d of x⁺ = A x + B u + d. @return  Whether it was taken: it is of finite numbers.
  bool set_disturbance(const StateVector& d) noexcept {
    return this->core_.set_disturbance(d.data());
  }

 private:
  explicit LinearMpc(detail::MpcCore&& core)
      : PredictiveController<States, Inputs>(std::move(core)) {}
};

/// `LinearMpc::create` with the sizes of the plant.
/// @errors As there.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LinearMpc<States, Inputs>> linear_mpc(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const MatrixRef& Q, const MatrixRef& R,
    const MpcSettings& settings) {
  return LinearMpc<States, Inputs>::create(plant.A, plant.B, Q, R, settings);
}

/// A continuous plant is sampled first.
template <int States, int Inputs, int Outputs, class... Rest>
void linear_mpc(const ContinuousSystem<States, Inputs, Outputs>& plant, const Rest&...) = delete;

}  // namespace flyball
