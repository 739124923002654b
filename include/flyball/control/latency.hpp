#pragma once

#include <flyball/systems/system.hpp>

namespace flyball {

/// The gain for a state that is `latency` old: K (A - B K)^(L/T), the second case of (B.12). L need
/// not be a multiple of T.
///
/// @param K  m x n, designed for no latency. @param A  n x n, discrete. @param B  n x m, discrete.
/// @param period  T, s. @param latency  L, s, not negative.
/// @errors ArgumentError; MatrixFunctionError::no_real_power for a fraction of a period where a
/// closed-loop pole is real and negative.
/// Source: book, appendix B.4.2, equation B.12.
[[nodiscard]] Expected<Eigen::MatrixXd> compensate_latency(const MatrixRef& K, const MatrixRef& A,
                                                           const MatrixRef& B, Time period,
                                                           Time latency);

template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<Eigen::Matrix<double, Inputs, States>> compensate_latency(
    const Eigen::Matrix<double, Inputs, States>& K,
    const DiscreteSystem<States, Inputs, Outputs>& plant, Time latency) {
  return compensate_latency(K, plant.A, plant.B, plant.period, latency)
      .map([](const Eigen::MatrixXd& gain) { return Eigen::Matrix<double, Inputs, States>(gain); });
}

/// The same for a continuous controller: K e^{(A - B K) L}, the second case of (B.9).
/// @param K  m x n, designed on the continuous plant.
/// @errors ArgumentError; those of `expm`.
/// Source: book, appendix B.4.1, equation B.9.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<Eigen::Matrix<double, Inputs, States>> compensate_latency(
    const Eigen::Matrix<double, Inputs, States>& K,
    const ContinuousSystem<States, Inputs, Outputs>& plant, Time latency);

namespace detail {

[[nodiscard]] Expected<Eigen::MatrixXd> compensate_latency_continuous(const MatrixRef& K,
                                                                      const MatrixRef& A,
                                                                      const MatrixRef& B,
                                                                      Time latency);

}  // namespace detail

template <int States, int Inputs, int Outputs>
Expected<Eigen::Matrix<double, Inputs, States>> compensate_latency(
    const Eigen::Matrix<double, Inputs, States>& K,
    const ContinuousSystem<States, Inputs, Outputs>& plant, Time latency) {
  return detail::compensate_latency_continuous(K, plant.A, plant.B, latency)
      .map([](const Eigen::MatrixXd& gain) { return Eigen::Matrix<double, Inputs, States>(gain); });
}

}  // namespace flyball
