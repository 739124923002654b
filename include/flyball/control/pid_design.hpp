#pragma once

#include <limits>
#include <optional>

#include <flyball/classical/loop_margins.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/control/pid_tuning.hpp>

/// PID gains from a plant's transfer function: by rules, by a stated robustness, by the loop's
/// crossover and phase margin; each answered with what its loop does.
namespace flyball {

/// Why a plant has no PID gains of the kind that was asked for.
enum class PidDesignError {
  no_rule,            ///< The method does not know such a plant, or this form.
  nothing_robust,     ///< No gains of this form keep the loop as robust.
  unlimited,          ///< Any integral gain would do: the plant has too little lag to limit it.
  phase_not_reached,  ///< The form cannot turn the phase as far as the margin needs.
  unstable_loop,      ///< What the method gives does not stabilise the plant.
  not_dominant,       ///< Another pole of the loop is slower than those that were placed.
};
[[nodiscard]] ErrorInfo error_info(PidDesignError code);

/// What a step of load at the plant's input does to the output.
struct LoadResponse {
  double final_value = 0.0;  ///< Zero with an integral.
  double peak = 0.0;         ///< The deviation that is largest.
  double peak_time = 0.0;    ///< s
  /// s, from where on the output is within 2 % of the peak of its final value; absent where 150 000
  /// points do not show it, of which the others are then.
  std::optional<double> recovery_time{};
  double integral = 0.0;           ///< ∫ (y - final) dt; of a loop with an integral 1/ki.
  double absolute_integral = 0.0;  ///< ∫ |y - final| dt, IAE.
};

/// A PID controller on a plant, judged.
struct PidLoop {
  PidGains gains;
  double derivative_time_constant = 0.0;  ///< s, τ of kd s/(τ s + 1).
  classical::TransferFunction controller;
  classical::LoopMargins margins;      ///< Of L = P C; `sensitivity` is M_s.
  classical::StepMetrics reference{};  ///< Of the output to a step of the reference.
  std::optional<LoadResponse> load{};  ///< Of a stable loop.
};

/// The controller as a transfer function: kp + ki/s + kd s/(τ s + 1), or, sampled as `Pid` runs it,
/// kp + ki T z/(z - 1) + kd (z - 1)/((τ + T) z - τ).
/// @param derivative_time_constant  τ, s; positive where a continuous one has a derivative.
/// @errors ArgumentError::not_finite, out_of_range, not_positive.
[[nodiscard]] Expected<classical::TransferFunction> pid_transfer(
    const PidGains& gains, double derivative_time_constant,
    std::optional<Time> period = std::nullopt);

/// What a loop of a plant and PID gains does: margins to rounding, the reference's step exact in
/// time where nothing is delayed; with dead time, and of loads, from solutions of the loop's
/// differential equation (of order four in a step that follows its fastest part, about 1e-6).
/// @param plant  Continuous, dead time exact, or discrete with the controller's period.
/// @errors As `pid_transfer` and `loop_margins`; of `step_metrics`.
[[nodiscard]] Expected<PidLoop> assess_pid(const classical::TransferFunction& plant,
                                           const PidGains& gains, double derivative_time_constant);

/// A plant as SIMC sees it: K e^{-θs}/((τ₁ s + 1)(τ₂ s + 1)); with τ₁ infinite K is that of
/// K e^{-θs}/(s (τ₂ s + 1)), with both infinite that of K e^{-θs}/s².
struct LagModel {
  double gain = 0.0;
  double time_constant = 0.0;         ///< τ₁, s; may be infinite.
  double second_time_constant = 0.0;  ///< τ₂, s; zero of a first-order model.
  double delay = 0.0;                 ///< θ, s
};

/// Skogestad's half rule: the largest lag that is neglected is given in equal parts to the delay
/// and to the smallest one that is kept; smaller ones and inverse responses add to the delay; zeros
/// in the left half-plane cancel lags first (his rules T1 to T3). Of a discrete plant the poles are
/// those of e^{sT}, and the delay is what keeps the average residence time.
/// @param order  1 or 2 lags. @errors ArgumentError::out_of_range; PidDesignError::no_rule with the
/// pole for plants with complex or unstable poles, or more than two integrators.
/// Source: Skogestad, J. Process Control 13 (2003), sections 2 and 3.
[[nodiscard]] Expected<LagModel> half_rule(const classical::TransferFunction& plant, int order);

/// SIMC gains of a plant by its half-rule model: K_c = τ₁/(K (τ_c + θ)), T_i = min(τ₁, 4 (τ_c +
/// θ)), and T_d = τ₂ in series for PID, given in parallel form; of a double integrator K_c = 1/(4 K
/// (τ_c
/// + θ)²), T_i = T_d = 4 (τ_c + θ).
/// @param form  PidForm::pi or pid. @param closed_loop_time  τ_c, s; zero takes θ.
/// @param filter_ratio  N, τ = T_d/N of the derivative's filter.
/// @errors As `half_rule` and `assess_pid`; ArgumentError for the numbers, not_positive where both
///         times are zero; PidDesignError::no_rule for P, PD, a double integrator under PI;
///         unstable_loop.
/// Source: Skogestad, J. Process Control 13 (2003), table 1.
[[nodiscard]] Expected<PidLoop> tune_simc(const classical::TransferFunction& plant, PidForm form,
                                          double closed_loop_time = 0.0,
                                          double filter_ratio = 10.0);

/// How robust a loop is to be.
struct RobustnessGoal {
  double sensitivity = 1.4;  ///< M_s at most; 1.2 (calm) to 2 (lively).
  double complementary = std::numeric_limits<double>::infinity();  ///< M_t at most.
  double filter_ratio = 10.0;  ///< N, τ = T_d/N; of continuous plants not zero.
};

/// The PI or PID gains with the largest |ki|, the least integral of the error after a load, of all
/// whose loop has max |S| <= M_s and max |T| <= M_t: at each frequency both are quadratic in ki, so
/// the largest ki for given kp and kd is a minimum over the frequencies, and these two are searched
/// for. Of PID controllers those are left out whose load response |P S/(jω)| has a peak above 1/ki,
/// which oscillate and whose ki says little. Unstable, integrating and sampled plants, any sign.
/// @errors ArgumentError for the goal; PidDesignError::no_rule for P and PD, nothing_robust with
/// the
///         nearest there is, unlimited for plants with so little lag that any gain is robust.
/// Cost: some ten milliseconds.
/// Source: Åström, Panagopoulos and Hägglund, Automatica 34 (1998); Åström and Hägglund, "Advanced
/// PID Control" (2006), sections 6.5 to 6.8 (MIGO); Kristiansson and Lennartson, IEE Proc. D 149
/// (2002), for the load's peak.
[[nodiscard]] Expected<PidLoop> tune_by_robustness(const classical::TransferFunction& plant,
                                                   PidForm form, const RobustnessGoal& goal = {});

/// What two sliders ask for.
struct LoopShapeGoal {
  double crossover = 0.0;      ///< rad/s, where |L| is to be 1: how fast.
  double phase_margin = 60.0;  ///< deg there: how calm.
  double filter_ratio = 10.0;  ///< N, τ = T_d/N; of continuous plants not zero.
  double time_ratio = 4.0;     ///< T_i/T_d of PID.
};

/// Gains whose loop crosses |L| = 1 at the frequency with the phase margin, both exactly: P (whose
/// margin is what it is, at least the wanted), PI, PD or PID.
/// @errors ArgumentError for the goal (a crossover above Nyquist's frequency); PidDesignError::
///         phase_not_reached with the best phase margin of this form at this crossover;
///         unstable_loop with the closed loop's count of unstable poles.
/// Cost: some milliseconds. Source: book, section E.3.6; the two sliders are MATLAB's PID Tuner's.
[[nodiscard]] Expected<PidLoop> tune_by_loop_shape(const classical::TransferFunction& plant,
                                                   PidForm form, const LoopShapeGoal& goal);

/// Poles that are to decide about the closed loop.
struct DominantPoles {
  double natural_frequency = 0.0;  ///< ω, rad/s.
  double damping_ratio = 0.7;      ///< ζ of the pair, below 1.
  double third_pole = 1.0;         ///< α: PID's third is at -α ω.
  double filter_ratio = 10.0;      ///< N, τ = T_d/N; of continuous plants not zero.
};

/// Gains with which s² + 2ζω s + ω² is a factor of the closed loop, dead time exact: 1 + P C = 0 at
/// the pair has two equations, for PI or PD; PID has a real pole at -α ω, too. Of a discrete plant
/// the poles are those of e^{sT}.
/// @errors ArgumentError for the goal (ζ from 1 on, a pair above Nyquist's frequency);
///         PidDesignError::no_rule for P, for poles where the plant is zero and where the filter's
///         time does not settle; unstable_loop with the count of unstable poles; not_dominant with
///         the pole that is slower. Cost: some milliseconds.
/// Source: Åström and Hägglund, "Advanced PID Control" (2006), section 6.4; book, section 7.6.
[[nodiscard]] Expected<PidLoop> tune_by_poles(const classical::TransferFunction& plant,
                                              PidForm form, const DominantPoles& goal);

}  // namespace flyball
