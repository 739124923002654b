#pragma once

#include <complex>
#include <vector>

#include <flyball/control/lqg.hpp>
#include <flyball/mechanisms/mechanism.hpp>

namespace flyball {

/// A sampled feedback loop, opened at the plant input: a continuous plant with a pure delay behind
/// a zero-order hold, and the controller's linear part u = -(C_c q + D_c y), q⁺ = A_c q + B_c y,
/// where y = C x is what the controller is given.
struct PlantInputLoop {
  Eigen::MatrixXd A;    ///< n x n, continuous plant.
  Eigen::MatrixXd B;    ///< n x 1, continuous plant.
  Eigen::MatrixXd C;    ///< p x n, what the controller sees.
  Time period;          ///< s
  Time delay;           ///< Pure delay anywhere in the loop, s; it need not be whole periods.
  Eigen::MatrixXd A_c;  ///< q x q; q may be 0.
  Eigen::MatrixXd B_c;  ///< q x p
  Eigen::MatrixXd C_c;  ///< 1 x q
  Eigen::MatrixXd D_c;  ///< 1 x p
};

/// Full-state feedback: L(z) = K (z I - A_d)⁻¹ B_d z^{-delay/T}.
/// @param A, B  Continuous plant, one input. @param K  1 x n, designed for the period.
/// @errors ArgumentError for shapes, entries, period and delay, of at most `most_delay_periods`.
[[nodiscard]] Expected<PlantInputLoop> state_feedback_loop(const MatrixRef& A, const MatrixRef& B,
                                                           const MatrixRef& K, Time period,
                                                           Time delay);

/// The observer-based regulator (Lqg): the true plant may differ from the regulator's model.
/// @param A, B, C  The true continuous plant, one input, without feedthrough.
/// @param model  What the observer believes, discrete, n states.
/// @param K  1 x n. @param K_e  n x p, filter form.
/// @errors ArgumentError for shapes, entries, period and delay.
[[nodiscard]] Expected<PlantInputLoop> observer_regulator_loop(
    const MatrixRef& A, const MatrixRef& B, const MatrixRef& C, const DiscreteSystem<>& model,
    const MatrixRef& K, const MatrixRef& K_e, Time delay);

/// The longest delay of a sampled loop: each period of it is a state.
inline constexpr double most_delay_periods = 250.0;

/// A frequency where the loop gain crosses |L| = 1 or the negative real axis.
struct Crossover {
  double frequency = 0.0;  ///< rad/s, up to Nyquist's π/T.
  double gain = 0.0;       ///< |L|
  double phase = 0.0;      ///< deg, of L, in (-180, 180].
};

/// How much the plant input may be wrong before the loop becomes unstable.
///
/// If the loop is not stable as it is there is no margin: all are zero, the gains one.
struct StabilityMargins {
  bool stable = false;
  double spectral_radius = 0.0;  ///< Of the closed loop with its delay; < 1 is stable.
  /// Stable for every real gain between these two at the plant input.
  double gain_margin_up = 1.0;    ///< > 1; infinity if none destabilises.
  double gain_margin_down = 1.0;  ///< In [0, 1); 0 if none destabilises.
  double phase_margin = 0.0;      ///< deg, the smallest rotation either way; 180 if none.
  double delay_margin = 0.0;      ///< s, further pure delay, exact between samples too; may be inf.
  /// Disk margin of the symmetric kind: α = 2/‖S - T‖∞. The loop stays stable for every complex
  /// factor in the disk with the diameter [disk_gain_down, disk_gain_up] on the real axis.
  double disk_margin = 0.0;
  double disk_gain_up = 1.0;                ///< (2 + α)/(2 - α)
  double disk_gain_down = 1.0;              ///< (2 - α)/(2 + α)
  double disk_phase = 0.0;                  ///< deg, 2 atan(α/2)
  double disk_frequency = 0.0;              ///< rad/s, where ‖S - T‖ is largest.
  std::vector<Crossover> gain_crossovers;   ///< |L| = 1, by frequency.
  std::vector<Crossover> phase_crossovers;  ///< L real and negative, by frequency.
};

/// Margins of a loop: crossings and the disk margin are those of `classical::loop_margins`, of
/// which none is missed, and those at zero frequency; stability and the delay margin's limit come
/// from the closed loop's eigenvalues, for between samples further delay is not one of z.
///
/// @errors ArgumentError for a malformed loop or one with a feedthrough; those of `expm`;
///         SystemError::no_convergence where the response is nothing but rounding.
/// Cost: some ten thousand evaluations of L: some milliseconds for two states, and a solution of
/// the closed loop's eigenvalue problem for each step of the search for the delay margin.
/// Source: book, section 7.7.2 (phase margin of the LQR); Seiler, Packard and Gahinet, "An
/// introduction to disk margins", IEEE Control Systems Magazine 40 (2020).
[[nodiscard]] Expected<StabilityMargins> stability_margins(const PlantInputLoop& loop);

/// Closed-loop spectral radius with a real factor on the plant input and further delay: what the
/// margins are margins of. @param gain  1 leaves it. @param further_delay  s.
/// @errors as stability_margins.
[[nodiscard]] Expected<double> closed_loop_radius(const PlantInputLoop& loop, double gain = 1.0,
                                                  Time further_delay = Time(0.0));

/// The loop gain at z = e^{jωT}. @param frequency  rad/s, at most π/T.
/// @errors as stability_margins, out_of_range for the frequency.
[[nodiscard]] Expected<std::complex<double>> loop_response(const PlantInputLoop& loop,
                                                           double frequency);

/// What a regulator does on a mechanism that is not as it was modelled.
struct RobustnessCase {
  double inertia = 1.0;  ///< Factor on the inertia: on kA.
  double gain = 1.0;     ///< Factor on what a volt does: on 1/kV and 1/kA both.
  bool stable = false;
  double spectral_radius = 0.0;
  /// Of the small-signal step response (no limits), relative to its final value; infinite if not
  /// stable.
  double overshoot = 0.0;
  double steady_error = 0.0;  ///< Final value over reference, less one; infinite if not stable.
};

/// The corners and the middle of a rectangle of uncertainty.
struct RobustnessGrid {
  std::vector<RobustnessCase> cases;  ///< By inertia, then by gain.
  bool all_stable = false;
  double worst_overshoot = 0.0;  ///< Largest of the cases.
};

/// What to vary, as factors.
struct RobustnessOptions {
  std::vector<double> inertia{0.8, 0.9, 1.0, 1.1, 1.2};
  std::vector<double> gain{0.8, 0.9, 1.0, 1.1, 1.2};
};

/// The regulator on perturbed mechanisms, with the delay in the loop.
///
/// @param A, B, C  The nominal mechanism, continuous: its last state is the velocity, which the
///                 inertia divides; one input, one output (the first reference's state).
/// @param model, K, K_e  The regulator, see observer_regulator_loop; its plant inversion is of the
///                 model. @param delay  s.
/// @errors ArgumentError; a factor that is not positive.
[[nodiscard]] Expected<RobustnessGrid> robustness_grid(
    const MatrixRef& A, const MatrixRef& B, const MatrixRef& C, const DiscreteSystem<>& model,
    const MatrixRef& K, const MatrixRef& K_e, Time delay, const RobustnessOptions& options = {});

}  // namespace flyball
