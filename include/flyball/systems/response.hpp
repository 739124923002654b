#pragma once

#include <optional>

#include <flyball/systems/analysis.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// The instants of a sampled response: 0, step, 2 step, …
struct ResponseTimes {
  Time step{0.0};            ///< s; of a discrete system its period.
  Eigen::Index samples = 0;  ///< From 1 to 10 000 000.
};

/// Until the slowest mode has settled (six time constants) in 600 steps; a growing mode is shown
/// for five of its time constants, an undamped oscillation for six turns, a pure integrator for a
/// second. Of a discrete system every sample, at least ten and at most 2000.
/// @param modes  Of the system. @param period  T, s, of a discrete system.
[[nodiscard]] ResponseTimes response_times(const ModalAnalysis& modes,
                                           std::optional<Time> period = {});

/// What a linear system does at sampled instants.
struct LinearResponse {
  Eigen::VectorXd time;  ///< samples, s.
  Eigen::MatrixXd x;     ///< (samples + 1) x states; the last row is where the last input leads.
  Eigen::MatrixXd y;     ///< samples x outputs.
};

/// x_{k+1} = A x_k + B u_k, y_k = C x_k + D u_k (7.3).
///
/// @param u  samples x inputs. @param x0  states.
/// @errors ArgumentError for the system, shapes and entries; not_finite where the response exceeds
///         the largest double.
/// Cost: O(samples (n + m)(n + p)), allocates.
[[nodiscard]] Expected<LinearResponse> forced_response(const DiscreteSystem<>& system,
                                                       const MatrixRef& u, const MatrixRef& x0);
/// The same of a continuous system whose input is held for `step` after each sample (zero-order
/// hold): exact at the samples, however long the step.
/// @param step  Between the rows of u, s. @errors As above; those of `discretize_zoh`.
[[nodiscard]] Expected<LinearResponse> forced_response(const ContinuousSystem<>& system,
                                                       const MatrixRef& u, const MatrixRef& x0,
                                                       Time step);

/// The response from x0 without input: y(t) = C e^{At} x0, or C A^k x0.
///
/// @param times  Chosen from the poles if left out; the step of a discrete system is its period.
/// @errors As `forced_response`; ArgumentError::out_of_range for the samples; SystemError where the
///         poles are not found.
[[nodiscard]] Expected<LinearResponse> initial_response(
    const ContinuousSystem<>& system, const MatrixRef& x0,
    const std::optional<ResponseTimes>& times = {});
[[nodiscard]] Expected<LinearResponse> initial_response(
    const DiscreteSystem<>& system, const MatrixRef& x0,
    const std::optional<ResponseTimes>& times = {});

/// The response from rest to one input that is 1 from t = 0 on, exact at the samples.
/// @param input  Which, from 0. @errors As `initial_response`; out_of_range for the input.
[[nodiscard]] Expected<LinearResponse> step_response(
    const ContinuousSystem<>& system, Eigen::Index input = 0,
    const std::optional<ResponseTimes>& times = {});
[[nodiscard]] Expected<LinearResponse> step_response(
    const DiscreteSystem<>& system, Eigen::Index input = 0,
    const std::optional<ResponseTimes>& times = {});

/// The response from rest to an impulse of one input: of a continuous system C e^{At} B from t = 0+
/// on (that of D is an impulse itself and not among the samples), of a discrete one that to u_0
/// = 1.
/// @param input  Which, from 0. @errors As `step_response`.
[[nodiscard]] Expected<LinearResponse> impulse_response(
    const ContinuousSystem<>& system, Eigen::Index input = 0,
    const std::optional<ResponseTimes>& times = {});
[[nodiscard]] Expected<LinearResponse> impulse_response(
    const DiscreteSystem<>& system, Eigen::Index input = 0,
    const std::optional<ResponseTimes>& times = {});

}  // namespace flyball
