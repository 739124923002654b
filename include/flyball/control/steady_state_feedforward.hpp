#pragma once

#include <span>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// Why a feedforward cannot be had.
enum class FeedforwardError {
  no_steady_state,  ///< No constant input holds the outputs at every value.
  singular,         ///< BᵀQB + R has no inverse.
  overflow,         ///< The gain exceeds the largest double.
};
[[nodiscard]] ErrorInfo error_info(FeedforwardError code);

/// What keeps a plant at a reference once it is there: x_ss = N_x y_ss, u_ss = N_u y_ss, and
/// u_ff = K_ff r.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
struct SteadyStateFeedforward {
  Eigen::Matrix<double, States, Outputs> N_x;  ///< n x p, outputs to states (C.1).
  Eigen::Matrix<double, Inputs, Outputs> N_u;  ///< m x p, outputs to inputs (C.2).
  Eigen::Matrix<double, Inputs, States> K_ff;  ///< m x n, N_u N_x⁺, states' reference to input.

  /// u_ff = K_ff r (C.4), (C.6), zero where that is not a finite number. Allocation-free for sizes
  /// known at compile time.
  [[nodiscard]] Eigen::Matrix<double, Inputs, 1> calculate(
      const Eigen::Matrix<double, States, 1>& r) const noexcept {
    Eigen::Matrix<double, Inputs, 1> u_ff = K_ff * r;
    detail::keep_signals(u_ff);
    return u_ff;
  }
};

/// [N_x; N_u] = [A B; C D]⁺ [0; I] (C.3), and K_ff = N_u N_x⁺.
///
/// @param A  n x n, continuous. @param B  n x m. @param C  p x n. @param D  p x m: all outputs at
/// once; where they are to be reached one by one, use `steady_state_feedforward_of_pairs`.
/// @errors ArgumentError for shapes and entries; FeedforwardError::no_steady_state naming the
/// output
///         that cannot be held, with what is left of its equation.
/// Cost: O((n + m)³), allocates. Source: book, Theorem C.2.1.
[[nodiscard]] Expected<SteadyStateFeedforward<>> steady_state_feedforward(const MatrixRef& A,
                                                                          const MatrixRef& B,
                                                                          const MatrixRef& C,
                                                                          const MatrixRef& D);

/// The sum over pairs of one actuator and the one output that it drives, as the theorem's remark
/// advises: output i by input inputs[i]. @param inputs  For each output its input, from 0.
/// @errors As above; ArgumentError::wrong_shape, out_of_range for the pairs.
/// Cost: O((n + m)³) an output; allocates. Source: book, the remark on Theorem C.2.1.
[[nodiscard]] Expected<SteadyStateFeedforward<>> steady_state_feedforward_of_pairs(
    const MatrixRef& A, const MatrixRef& B, const MatrixRef& C, const MatrixRef& D,
    std::span<const int> inputs);

namespace detail {

template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<SteadyStateFeedforward<States, Inputs, Outputs>> sized(
    Expected<SteadyStateFeedforward<>>&& dynamic) {
  return std::move(dynamic).map([](const SteadyStateFeedforward<>& feedforward) {
    return SteadyStateFeedforward<States, Inputs, Outputs>{feedforward.N_x, feedforward.N_u,
                                                           feedforward.K_ff};
  });
}

}  // namespace detail

/// The same for a continuous plant, with its sizes. @errors As above.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<SteadyStateFeedforward<States, Inputs, Outputs>> steady_state_feedforward(
    const ContinuousSystem<States, Inputs, Outputs>& plant) {
  return detail::sized<States, Inputs, Outputs>(
      steady_state_feedforward(plant.A, plant.B, plant.C, plant.D));
}
/// The discrete case has A - I in place of A (C.5). @errors As above; ArgumentError for the period.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<SteadyStateFeedforward<States, Inputs, Outputs>> steady_state_feedforward(
    const DiscreteSystem<States, Inputs, Outputs>& plant) {
  if (auto checked = check_system(plant, "steady_state_feedforward"); !checked) {
    return tl::unexpected(checked.error());
  }
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(plant.A.rows(), plant.A.cols());
  return detail::sized<States, Inputs, Outputs>(
      steady_state_feedforward(Eigen::MatrixXd(plant.A - I), plant.B, plant.C, plant.D));
}

/// QR-weighted plant inversion: u = K_ff (r_{k+1} - A r_k) with K_ff = (BᵀQB + R)⁻¹BᵀQ, which
/// trades the tracking error (weight Q) against effort (weight R). With Q = I and R = 0 it is
/// linear plant inversion.
/// @param B  n x m, discrete. @param Q  n x n, symmetric. @param R  m x m, symmetric.
/// @return K_ff, m x n.
/// @errors ArgumentError for shapes, entries and asymmetry; FeedforwardError::singular where
///         BᵀQB + R is not positive definite, overflow.
/// Formed and solved in twice the precision: what is left of (BᵀQB + R) K = BᵀQ is K's rounding.
/// Source: book, Theorem C.1.1.
[[nodiscard]] Expected<Eigen::MatrixXd> qr_weighted_gain(const MatrixRef& B, const Weight& Q,
                                                         const Weight& R);

/// The same as the run-time feedforward of a discrete plant, u = K_ff (r_{k+1} - A r_k), which does
/// not allocate where the sizes are known. @errors As above, and ArgumentError for the plant.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<LinearPlantInversion<States, Inputs>> qr_weighted_inversion(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Weight& Q, const Weight& R) {
  if (auto checked = check_system(plant, "qr_weighted_inversion"); !checked) {
    return tl::unexpected(checked.error());
  }
  return qr_weighted_gain(plant.B, Q, R).map([&](const Eigen::MatrixXd& K_ff) {
    return LinearPlantInversion<States, Inputs>(plant.A, K_ff);
  });
}

}  // namespace flyball
