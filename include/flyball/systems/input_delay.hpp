#pragma once

#include <flyball/systems/system.hpp>

namespace flyball {

/// A continuous plant whose input arrives `delay` late, sampled under zero-order hold. With the
/// delay = d T + f, 0 <= f < T, the input changes f after each sample, so that exactly
///   x_{k+1} = A x_k + B_0 u_{k-d} + B_1 u_{k-d-1},
/// B_0 = ∫₀^{T-f} e^{A_c s} ds B_c and B_1 = e^{A_c (T-f)} ∫₀^f e^{A_c s} ds B_c.
struct DelayedInputMatrices {
  Eigen::MatrixXd A;      ///< n x n
  Eigen::MatrixXd B_0;    ///< n x m, of the newer input.
  Eigen::MatrixXd B_1;    ///< n x m, of the older one; zero if the delay is whole periods.
  int whole_periods = 0;  ///< d
};

/// @param A  n x n, continuous. @param B  n x m, continuous. @param period  T, s.
/// @param delay  s, not negative, at most 10 000 periods. A pure delay behind the sampler acts
/// alike
///               whether it sits in the actuator or in the sensor.
/// @errors ArgumentError for shapes, entries, period and delay; those of `expm`.
/// Source: Åström and Wittenmark, "Computer-Controlled Systems", 3rd ed., section 2.3.
[[nodiscard]] Expected<DelayedInputMatrices> discretize_delayed_input(const MatrixRef& A,
                                                                      const MatrixRef& B,
                                                                      Time period, Time delay);

/// The same as one system with the inputs on their way as further states,
/// x_aug = [x; u_{k-1}; …; u_{k-d-1}] (u_{k-d-1} only if the delay is not whole periods).
/// @return A system of n + m ⌈delay/T⌉ states whose C sees the plant's states.
/// @errors as discretize_delayed_input.
[[nodiscard]] Expected<DiscreteSystem<>> discretize_with_input_delay(
    const ContinuousSystem<>& system, Time period, Time delay);

}  // namespace flyball
