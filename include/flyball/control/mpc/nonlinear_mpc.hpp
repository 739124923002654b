#pragma once

#include <flyball/control/mpc/predictive_controller.hpp>

namespace flyball {

/// Nonlinear model predictive control by real-time iterations: each period the model is linearised
/// along the last trajectory, one period on, and one quadratic program is solved,
///
///   min  Σ_{k<N} ½ (x_k - r_k)ᵀQ(x_k - r_k) + ½ (u_k - v_k)ᵀR(u_k - v_k)
///          + ½ (x_N - r_N)ᵀQ_end(x_N - r_N)
///   subject to  x_{k+1} = F_k + ∂F/∂x (x_k - x̄_k) + ∂F/∂u (u_k - ū_k)  and limits as of
///   `LinearMpc`,
///
/// where F is a step of Runge and Kutta's method of order 4 over the period, its derivatives exact.
/// Its solution is the next (x̄, ū). Where the state moves as predicted that converges to the
/// optimum of the nonlinear program from period to period, quadratically in the misfit's size for
/// costs that are small at the end; `change` says how far apart the last two trajectories are.
///
/// Run-time object: noexcept, no allocation after construction, bounded work: one iteration a
/// period, ten in the first period after construction or `reset`. Whatever comes, u is finite and
/// within its limits and rates.
///
/// ```
/// auto mpc = nonlinear_mpc(drive, 20_ms, Q, R, limits).value();
/// mpc.set_trajectory(r, u_r);
/// u = mpc.calculate(x_hat);
/// ```
///
/// Source: Diehl, Bock, Schlöder, "A real-time iteration scheme for nonlinear optimization in
/// optimal feedback control" (2005); Gros et al., "From linear to nonlinear MPC: bridging the gap
/// via the real-time iteration" (2020).
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class NonlinearMpc : public PredictiveController<States, Inputs> {
 public:
  /// @param model  `model_tape` of any model. @param period  T > 0, also the integrator's step.
  /// @param Q, R  As of `LinearMpc::create`. @param settings  Without Q_end it is Q.
  /// @errors ArgumentError::not_positive for the period; wrong_shape where the model is of another
  ///         size; else as `LinearMpc::create`. Cost: as there, and one pass over the model;
  ///         allocates.
  [[nodiscard]] static Expected<NonlinearMpc> create(const ModelTape& model, Time period,
                                                     const MatrixRef& Q, const MatrixRef& R,
                                                     const MpcSettings& settings) {
    const Checks checks = Checks("nonlinear_mpc")
                              .shape(Q, States == Eigen::Dynamic ? Q.rows() : States, Q.rows(), "Q",
                                     "states x states")
                              .shape(R, Inputs == Eigen::Dynamic ? R.rows() : Inputs, R.rows(), "R",
                                     "inputs x inputs");
    if (!checks) {
      return tl::unexpected(checks.error());
    }
    return detail::MpcCore::make(model, period, Q, R, settings).map([](detail::MpcCore&& core) {
      return NonlinearMpc(std::move(core));
    });
  }

  /// The largest change of an input by the last iteration: small near the nonlinear program's
  /// optimum, where only the guess of the newest period is off.
  [[nodiscard]] double change() const noexcept { return this->core_.change(); }

 private:
  explicit NonlinearMpc(detail::MpcCore&& core)
      : PredictiveController<States, Inputs>(std::move(core)) {}
};

/// `NonlinearMpc::create` for a model of the house, or one of your own.
/// @errors As there.
template <Model M>
[[nodiscard]] Expected<NonlinearMpc<detail::fixed_states<M>(), detail::fixed_inputs<M>()>>
nonlinear_mpc(const M& model, Time period, const MatrixRef& Q, const MatrixRef& R,
              const MpcSettings& settings) {
  return NonlinearMpc<detail::fixed_states<M>(), detail::fixed_inputs<M>()>::create(
      model_tape(model), period, Q, R, settings);
}

}  // namespace flyball
