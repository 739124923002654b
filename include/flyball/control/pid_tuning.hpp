#pragma once

#include <span>
#include <string>
#include <vector>

#include <flyball/control/lqr.hpp>
#include <flyball/control/pid.hpp>
#include <flyball/control/response_metrics.hpp>
#include <flyball/systems/system.hpp>

namespace flyball {

/// Why a tuning found no gains.
enum class TuningError {
  no_oscillation,    ///< The relay did not make the plant oscillate.
  no_reaction,       ///< The output did not respond to the step, or did not settle.
  nothing_improves,  ///< No proportional gain brings the output near the reference.
};
[[nodiscard]] ErrorInfo error_info(TuningError code);

/// Which terms a tuning rule is to use.
enum class PidForm { p, pi, pd, pid };

/// A step response of the loop of a sampled plant and a PID controller, simulated.
struct PidResponse {
  std::vector<double> times;   ///< s
  std::vector<double> output;  ///< y
  std::vector<double> input;   ///< u
  ResponseMetrics metrics;
};

/// What simulations of a tuning have in common.
struct TuningScenario {
  PidSettings settings;      ///< Limits, filter and so on; its gains and period are replaced.
  double reference = 1.0;    ///< The step, in the output's unit.
  double duration = 5.0;     ///< s
  double disturbance = 0.0;  ///< Added to the input that the plant sees, such as gravity, V.
  double noise = 0.0;  ///< Standard deviation of the measurement, per sample; seeded, repeatable.
};

/// The loop's step response: u_k of the PID on what is measured, x_{k+1} = A x_k + B (u_k + d). A
/// loop that runs away is kept at a million times the reference.
/// @param plant  Discrete, one input, one output, from rest; its period is the controller's.
/// @param gains  kp, ki, kd in the input's unit per the output's (and s). @param scenario  The
/// step.
/// @return Output and input at each sample, and the metrics of section 2.5.
/// @errors ArgumentError for a plant that is not of one input and output, for the gains and for the
///         scenario. Cost: O(n²) a sample; allocates. Source: book, sections 2.4 and 2.5.
[[nodiscard]] Expected<PidResponse> simulate_pid(const DiscreteSystem<>& plant,
                                                 const PidGains& gains,
                                                 const TuningScenario& scenario);

/// One step of the manual tuning: what was tried, what was seen, and what follows from it.
struct TuningStep {
  PidGains gains;
  ResponseMetrics metrics;
  double jitter = 0.0;    ///< Mean |u_k - u_{k-1}| over the last third, as a share of its limits.
  std::string seen{};     ///< "the output goes over the reference by 12 % and crosses it 3 times"
  std::string decided{};  ///< "keep Kp = 40: it oscillates, which Kd is to damp"
};

/// What the manual procedure found, step by step.
struct ManualTuning {
  PidGains gains;
  std::vector<TuningStep> steps;
  PidResponse response;  ///< With `gains`.
};

/// The manual tuning of section 2.6, done on a model: all gains zero; Kp up until the output starts
/// to oscillate around the reference; Kd up as long as nothing jitters; Ki only if an error
/// remains, as far as it takes to remove it within the duration.
/// @param plant  Discrete, one input, one output.
/// @param velocity  A velocity controller, which typically does not need Kd (2.6, 6.10.7): Kd stays
/// zero, and Kp is taken back to where nothing oscillates.
/// @errors As `simulate_pid`; TuningError::nothing_improves.
/// Cost: some dozens of simulations. Source: book, section 2.6.
[[nodiscard]] Expected<ManualTuning> tune_manually(const DiscreteSystem<>& plant,
                                                   const TuningScenario& scenario, bool velocity);

/// The point at which a plant under proportional control just keeps oscillating.
struct UltimatePoint {
  double gain = 0.0;       ///< K_u, input unit / output unit.
  double period = 0.0;     ///< T_u, s.
  double amplitude = 0.0;  ///< Of the limit cycle that it was measured in.
};

/// Åström and Hägglund's relay: u = bias ± height, switched by the sign of the error with
/// hysteresis, makes the plant oscillate at its phase crossover; K_u = 4 h/(π √(a² - ε²)).
/// @param plant  Discrete, one input, one output. @param height  h > 0, in the input's unit.
/// @param hysteresis  ε >= 0, in the output's unit, above the noise.
/// @param bias  The input around which it switches, the one that holds the output at rest at zero.
/// @param duration  s, at least a few periods.
/// @errors ArgumentError; TuningError::no_oscillation with the switches that were seen.
/// Source: Åström and Hägglund, Automatica 20 (1984).
[[nodiscard]] Expected<UltimatePoint> relay_experiment(const DiscreteSystem<>& plant, double height,
                                                       double hysteresis, double bias,
                                                       double duration);

/// Ziegler and Nichols' rules for an ultimate point: P 0.5 K_u; PI 0.45 K_u, T_u/1.2; PID 0.6 K_u,
/// T_u/2, T_u/8; PD 0.8 K_u, T_u/8. Quarter-amplitude damping: lively.
/// @param point  Gain and period, both positive. @param form  Which terms there are.
/// @return kp, ki = kp/T_i, kd = kp T_d. @errors ArgumentError::not_positive, not_finite.
/// Cost: none to speak of. Source: Ziegler and Nichols, Trans. ASME 64 (1942).
[[nodiscard]] Expected<PidGains> ziegler_nichols(const UltimatePoint& point, PidForm form);

/// Tyreus and Luyben's calmer rules: PI K_u/3.2, 2.2 T_u; PID K_u/2.2, 2.2 T_u, T_u/6.3. P and PD
/// use the same gain and derivative time. Arguments, return and errors as `ziegler_nichols`.
/// Source: Tyreus and Luyben, Ind. Eng. Chem. Res. 31 (1992).
[[nodiscard]] Expected<PidGains> tyreus_luyben(const UltimatePoint& point, PidForm form);

/// K e^{-θ s}/(τ s + 1): what a reaction curve shows of a plant.
struct ReactionCurve {
  double gain = 0.0;           ///< K, output unit / input unit; of either sign.
  double time_constant = 0.0;  ///< τ, s
  double delay = 0.0;          ///< θ, s, as it looks from outside: small lags count too.
};

/// The curve of a step response, by its times at 28.3 % and 63.2 % of the way.
/// @param times  s, the step of the input at the first. @param values  The output.
/// @param input_step  The input's change, not zero.
/// @errors ArgumentError; TuningError::no_reaction where the output moves less than its last fifth
///         still varies. Source: Smith, "Digital Computer Process Control" (1972).
[[nodiscard]] Expected<ReactionCurve> reaction_curve(std::span<const double> times,
                                                     std::span<const double> values,
                                                     double input_step);
/// The same of a plant's simulated step.
/// @param plant  Discrete, one input, one output, from rest. @param input_step  As above.
/// @param duration  s, until it has settled. @errors As above; ArgumentError for the plant.
[[nodiscard]] Expected<ReactionCurve> reaction_curve(const DiscreteSystem<>& plant,
                                                     double input_step, double duration);

/// Gain in units of τ/(Kθ), T_i and T_d: P 1; PI 0.9, θ/0.3; PID 1.2, 2θ, θ/2; PD 1.2, θ/2.
/// @param curve  K, τ > 0 s, θ > 0 s. @param form  Which terms there are.
/// @return kp, ki = kp/T_i, kd = kp T_d.
/// @errors ArgumentError::not_positive where the delay is zero: any gain would do.
/// Source: Ziegler and Nichols, Trans. ASME 64 (1942).
[[nodiscard]] Expected<PidGains> ziegler_nichols(const ReactionCurve& curve, PidForm form);

/// Cohen and Coon's rules. With ρ = θ/τ, the gain in units of τ/(Kθ), T_i and T_d:
///   P 1 + ρ/3;  PI 0.9 + ρ/12, θ(30 + 3ρ)/(9 + 20ρ);  PD 5/4 + ρ/6, θ(6 - 2ρ)/(22 + 3ρ);
///   PID 4/3 + ρ/4, θ(32 + 6ρ)/(13 + 8ρ), 4θ/(11 + 2ρ).
/// Arguments, return and errors as `ziegler_nichols` of a curve.
/// Source: Cohen and Coon, Trans. ASME 75 (1953).
[[nodiscard]] Expected<PidGains> cohen_coon(const ReactionCurve& curve, PidForm form);

/// Skogestad's internal model control: K_c = τ/(K (τ_c + θ)), T_i = min(τ, 4 (τ_c + θ)).
/// @param closed_loop_time  τ_c, s, >= 0; θ is tight and robust.
/// PI, or P without the integral; a first-order curve has nothing for a derivative to cancel, so
/// PD and PID add T_d = θ/2 (half of the delay's Padé lag) in series.
/// @errors ArgumentError. Source: Skogestad, J. Process Control 13 (2003).
[[nodiscard]] Expected<PidGains> simc(const ReactionCurve& curve, double closed_loop_time,
                                      PidForm form);

/// PD gains of a position mechanism, dx/dt = v, dv/dt = -a v + b u, whose closed loop is
/// s² + 2ζω s + ω²: kp = ω²/b, kd = (2ζω - a)/b.
/// @param plant  [position, velocity], continuous. @param natural_frequency  ω > 0, rad/s.
/// @param damping  ζ > 0; 1 is critical.
/// @errors ArgumentError; PolePlacementError. Source: book, sections 2.2 and 7.6.
[[nodiscard]] Expected<PidGains> pd_by_poles(const ContinuousSystem<2, 1, 1>& plant,
                                             double natural_frequency, double damping);

/// PI gains of a velocity mechanism, dv/dt = -a v + b u: kp = (2ζω - a)/b, ki = ω²/b.
/// @errors As above.
[[nodiscard]] Expected<PidGains> pi_by_poles(const ContinuousSystem<1, 1, 1>& plant,
                                             double natural_frequency, double damping);

/// PD gains from the regulator of the sampled mechanism: K = [kp kd] (7.15), for a derivative of
/// the measured velocity. @errors As `lqr`. Source: book, section 7.7.2.
[[nodiscard]] Expected<PidGains> pd_by_lqr(const DiscreteSystem<2, 1, 1>& plant, const Weight& Q,
                                           const Weight& R);

}  // namespace flyball
