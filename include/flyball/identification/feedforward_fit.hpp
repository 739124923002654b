#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/identification/one_step_fit.hpp>
#include <flyball/identification/preparation.hpp>
#include <flyball/identification/recording.hpp>

namespace flyball::identification {

/// One identified parameter.
struct GainEstimate {
  double value = 0.0;
  double standard_error = 0.0;
  std::array<double, 2> interval{0.0, 0.0};  ///< 95 %.
  /// Whether the data tell the value. If not, `value` is the best guess, not to be designed with.
  bool determined = true;
  double upper_bound = 0.0;  ///< If not determined: the value is below this (95 %).
  std::string reason{};      ///< If not determined: why.
};

/// A force that the four gains lack and the log asks for beyond doubt; the gains hold beside it.
struct ModelTerm {
  /// "spring", "drag", "asymmetric_friction", "current_limit", "sag", "friction_along_travel",
  /// "backlash".
  std::string name{};
  std::string unit{};  ///< Of the value: "V/m", "V/(rad/s)²", "V", "m", "" (sag).
  GainEstimate value{};
  double largest = 0.0;  ///< V, of it in this log; of backlash the value.
};

/// A run as measured and as simulated in free run from its recorded voltage.
struct FittedRun {
  TestKind kind = TestKind::quasistatic_forward;
  std::size_t source = 0;              ///< Index of the run in the recording.
  bool used = false;                   ///< Whether the fit used it; if not, nothing is simulated.
  std::vector<double> time{};          ///< s, the window that was fitted.
  std::vector<double> voltage{};       ///< V.
  std::vector<double> position{};      ///< Measured; empty if the log has none.
  std::vector<double> velocity{};      ///< Measured (derived from position if the log has none).
  std::vector<double> position_hat{};  ///< Simulated, as the sensor would have shown it.
  std::vector<double> velocity_hat{};  ///< Simulated, delayed and averaged as the sensor does.
  std::vector<double> velocity_residual{};  ///< velocity − velocity_hat.
  /// Rows whose velocity is new: loggers repeat the last one in between, which is no residual.
  std::vector<std::size_t> fresh{};
};

/// The feedforward model V = kS sgn(v) + kV v + kA a + gravity, with gravity nothing (flywheel),
/// kG (elevator) or kG cos(θ + angle_offset) (arm), θ as the log counts it.
struct FeedforwardFit {
  mechanisms::MechanismKind mechanism{};
  std::string unit{};                ///< "m" or "rad".
  GainEstimate kS;                   ///< V.
  GainEstimate kV;                   ///< V/(unit/s).
  GainEstimate kA;                   ///< V/(unit/s²).
  std::optional<GainEstimate> kG{};  ///< V; elevators and arms.
  std::optional<GainEstimate>
      angle_offset{};  ///< rad; arms: true angle from horizontal − measured.
  /// V, of a lift that moves in one direction alone, where neither is determined: kS + kG (forward)
  /// or kG − kS (in reverse).
  std::optional<GainEstimate> gravity_with_friction{};
  bool in_reverse = false;         ///< Whether that is kG − kS.
  std::vector<ModelTerm> terms{};  ///< Beyond the four gains; none of most logs.

  /// Of [kV/its value, ln kA, position_delay, velocity_delay], delays in s: in no direction smaller
  /// than any of the three variance estimates, with the allowances of the standard errors. Zero
  /// where the log has no such column; all zero where no covariance is known.
  std::array<std::array<double, 4>, 4> joint_covariance{};

  double r_squared = 0.0;        ///< Of the free-run simulated velocity, all used runs.
  double velocity_nrmse = 0.0;   ///< RMS error over standard deviation of the velocity.
  double position_delay = 0.0;   ///< s, age of the position column (0 if absent).
  double velocity_delay = 0.0;   ///< s, age of the velocity column, half the averaging included.
  double averaging_width = 0.0;  ///< s, width of the moving average in the velocity column.
  double velocity_scale = 1.0;   ///< Velocity column over derivative of position.
  double velocity_noise = 0.0;   ///< unit/s, robust standard deviation of the velocity residual.
  double position_noise = 0.0;   ///< unit, of the position-difference residual over √2.
  std::optional<OneStepFit> one_step{};  ///< The book's regression, for comparison.
  std::vector<FittedRun> runs{};         ///< One per prepared run.
  std::size_t residuals = 0;
  int iterations = 0;
};

/// How to fit.
struct FitOptions {
  std::optional<mechanisms::MechanismKind> mechanism{};  ///< Overrides the recording's.
  PreparationOptions preparation;
  double difference_span = 0.07;  ///< s, span of the position differences.
  double max_delay = 0.1;         ///< s, largest delay of position or velocity looked for.
  double settling = 0.1;          ///< s, after the start of a run in motion, that is not compared.
  int max_iterations = 200;       ///< Of Levenberg–Marquardt, over all stages.
  bool extend = true;             ///< Take in terms beyond the four gains where the log asks.
};

/// The answer with everything that led to it: also a refused recording can be plotted.
struct FitReport {
  PreparedRecording prepared;             ///< With the mechanism that was chosen, if it was open.
  std::vector<Diagnostic> diagnostics{};  ///< Of preparation and fit.
  Expected<FeedforwardFit> fit;
};

/// Identifies the feedforward gains by an output-error fit: the model is simulated in free run from
/// the recorded voltage (exactly, with sticking and slipping) and compared with what its sensors
/// show, so noise, delay, filtering and repeated rows of the measurement do not bias the gains.
///
/// Residuals are position differences over `difference_span` and the velocity as a moving average
/// of unknown width, each with its own delay and scaled by its own median absolute deviation, under
/// a soft-L1 loss. Intervals take the largest of three variance estimates: HAC, block sandwich and
/// the residuals' own autocorrelation.
///
/// Where neither the recording nor the options say what the mechanism is, the data choose it if
/// they can (`choose_mechanism`), with the warning "mechanism_assumed"; where they contradict what
/// was said, there is the warning "mechanism_contradicted".
///
/// @errors in `fit`: any IdentificationError; ArgumentError::wrong_shape for malformed columns.
/// Cost: about 0.1 s for 10 000 rows; capped by `max_iterations`.
/// Source: Ljung, "System Identification" (2nd ed.), sections 7.2–7.3 (output error), 15.2
/// (robust norms); Newey and West, Econometrica 55 (1987) (HAC).
[[nodiscard]] FitReport identify_feedforward(const Recording& recording,
                                             const FitOptions& options = {});

/// The fit alone. @errors as `identify_feedforward`.
[[nodiscard]] Expected<FeedforwardFit> fit_feedforward(const Recording& recording,
                                                       const FitOptions& options = {});

}  // namespace flyball::identification
