#pragma once

#include <optional>

#include <flyball/classical/loop_margins.hpp>

/// Lead, lag, lead-lag and notch compensators from what the loop is to be.
namespace flyball::classical {

/// Why there is no compensator of a kind.
enum class CompensatorError {
  phase_not_reached,  ///< It would have to turn the phase further than it can, or the other way.
  gain_not_reached,   ///< With the gain at rest that was given no pole and zero do it.
  unstable_loop,      ///< What meets the specification does not stabilise the plant.
};
[[nodiscard]] ErrorInfo error_info(CompensatorError code);

/// A compensator in its loop L = P C, judged.
struct Compensation {
  TransferFunction compensator;
  LoopMargins margins;     ///< Of L.
  Eigen::VectorXcd poles;  ///< Of 1/(1 + L); none are told of a continuous loop with dead time.
};

/// Where |L| is to be 1, and with what phase margin.
struct CrossoverGoal {
  double crossover = 0.0;      ///< rad/s
  double phase_margin = 50.0;  ///< deg
  /// C(0), from a steady-state error (`gain_for_error_constant`); none leaves it open.
  std::optional<double> gain{};
  int stages = 1;  ///< Equal ones of a lead: each turns less than 90°.
};

/// The closed-loop poles that are to dominate, those of s² + 2ζω s + ω².
struct PoleGoal {
  double natural_frequency = 0.0;  ///< ω, rad/s
  double damping_ratio = 0.7;      ///< ζ in (0, 1).
  std::optional<double> gain{};    ///< C(0), as above.
  int stages = 1;
};

/// C(0) with which L has the error constant lim sᵐ L(s) (position, velocity, acceleration constant,
/// by the plant's number m of integrators): a steady-state error of 1/(1 + K) or 1/K.
/// @errors ArgumentError::not_finite, not_positive (zero); TransferError::at_a_pole, for a plant
///         without gain at rest. Source: book, section E.3.5.
[[nodiscard]] Expected<double> gain_for_error_constant(const TransferFunction& plant,
                                                       double constant);

/// C = K ((T s + 1)/(T' s + 1))ⁿ, T > T': with the gain open the smallest ratio T/T' that does it,
/// its phase at its largest at the crossover (of poles by the bisector); with the gain given the
/// only T and T' there are. Both specifications are met exactly, and dead time is exact. Of a
/// discrete plant in the plane of w = (2/T)(z - 1)/(z + 1), whose image the answer is.
/// @errors ArgumentError for the goal, a crossover above Nyquist's frequency;
///         CompensatorError::phase_not_reached with the phase that is wanted and the best margin,
///         gain_not_reached with the bound of the gain, unstable_loop with the unstable poles.
/// Cost: that of `loop_margins`. Source: book, section E.3; Wakeland, IEEE Trans. Automatic Control
/// 21 (1976); Ogata, "Modern Control Engineering", sections 6.6 and 7.11.
[[nodiscard]] Expected<Compensation> lead_compensator(const TransferFunction& plant,
                                                      const CrossoverGoal& goal);
[[nodiscard]] Expected<Compensation> lead_compensator(const TransferFunction& plant,
                                                      const PoleGoal& goal);

/// The same with T < T', which keeps the gain at rest and lowers the rest: the gain must be given.
/// @errors As above.
[[nodiscard]] Expected<Compensation> lag_compensator(const TransferFunction& plant,
                                                     const CrossoverGoal& goal);

/// A lead whose phase is largest at the crossover, and a lag a decade below it that brings the gain
/// at rest to what is given: K (T s + 1)/(T' s + 1) (τ s + 1)/(β τ s + 1), τ = 10/crossover.
/// @errors As above; gain_not_reached where the lead alone has as much.
[[nodiscard]] Expected<Compensation> lead_lag_compensator(const TransferFunction& plant,
                                                          const CrossoverGoal& goal);

/// (s² + 2 ζ₁ ω s + ω²)/(s² + 2 ζ₂ ω s + ω²): gain one but around ω, where it is ζ₁/ζ₂; of a period
/// the bilinear image that keeps the frequency.
/// @param frequency  ω, rad/s, below Nyquist's. @param depth  ζ₁/ζ₂, in [0, 1).
/// @param width  2 ζ₂: the share of ω between the points of half the power, of a deep one.
/// @errors ArgumentError. Source: Franklin, Powell and Emami-Naeini, "Feedback Control of Dynamic
/// Systems", section 5.4.
[[nodiscard]] Expected<TransferFunction> notch_compensator(double frequency, double depth,
                                                           double width,
                                                           std::optional<Time> period = {});

}  // namespace flyball::classical
