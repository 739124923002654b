#pragma once

#include <optional>
#include <vector>

#include <flyball/classical/delay_system.hpp>
#include <flyball/systems/response.hpp>

namespace flyball::classical {

/// What an input does between its samples.
enum class InputShape {
  held,    ///< It keeps its sample's value.
  linear,  ///< It is a straight line to the next sample's.
};

/// An impulse in an output: an impulse at an input that arrives there without passing a state.
struct OutputImpulse {
  double time = 0.0;         ///< s
  Eigen::VectorXd strength;  ///< outputs
};

/// What a system with dead time does at sampled instants. Where a signal jumps at a sample, the
/// sample is what it is afterwards.
struct DelayResponse {
  Eigen::VectorXd time;                   ///< samples, s.
  Eigen::MatrixXd x;                      ///< samples x states.
  Eigen::MatrixXd y;                      ///< samples x outputs.
  std::vector<OutputImpulse> impulses{};  ///< Of an impulse response.
};

/// The response from x0 to sampled inputs; before t = 0 nothing was on its way in a delay.
///
/// Between the instants at which a jump or a kink of the input arrives anywhere, after one, two, …
/// delays, states and delayed signals are polynomials of degree 11 that satisfy the equations at
/// Radau's points (method of steps, Radau IIA of order 23); steps are halved until the last
/// coefficients are below 1e-12 of the signal's largest value so far. So what is answered is right
/// to about 1e-11 of that value, with delays of any ratio to the samples' step. A discrete system
/// is stepped as it is.
/// @param u  samples x inputs. @param x0  states. @param step  s; of a discrete system its period.
/// @errors ArgumentError for shapes and entries; out_of_range for a step that is not the period,
/// for more than 200 states and for a delay below a millionth of the time, or one that takes more
/// steps than there are; not_finite where the response exceeds the largest double;
/// SystemError::no_convergence where 250 000 steps and four a sample do not suffice; steps of ten
/// states count as three, and (n/10)³ times as many of n > 10 are taken. Cost: O((12 n)³) for each
/// length of step, which counts as the steps that take as long, O(n²) a step; allocates. Source:
/// Bellen and Zennaro, "Numerical Methods for Delay Differential Equations" (2003), chapters 3 and
/// 4; Hairer and Wanner, "Solving Ordinary Differential Equations II", section IV.5.
[[nodiscard]] Expected<DelayResponse> forced_response(const DelaySystem& system, const MatrixRef& u,
                                                      const MatrixRef& x0, Time step,
                                                      InputShape shape = InputShape::held);

/// From x0 without input. @param times  Chosen from the poles of the Padé approximation if left
/// out. @errors As above.
[[nodiscard]] Expected<DelayResponse> initial_response(
    const DelaySystem& system, const MatrixRef& x0, const std::optional<ResponseTimes>& times = {});
/// From rest to one input that is 1 from t = 0 on. @param input  Which, from 0.
[[nodiscard]] Expected<DelayResponse> step_response(const DelaySystem& system,
                                                    Eigen::Index input = 0,
                                                    const std::optional<ResponseTimes>& times = {});
/// From rest to an impulse of one input; what of it arrives at an output as an impulse is told
/// apart.
[[nodiscard]] Expected<DelayResponse> impulse_response(
    const DelaySystem& system, Eigen::Index input = 0,
    const std::optional<ResponseTimes>& times = {});

}  // namespace flyball::classical
