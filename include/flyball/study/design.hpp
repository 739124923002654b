#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/control/certificate.hpp>
#include <flyball/core/coordinate.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/export/constants.hpp>
#include <flyball/mechanisms/mechanism.hpp>
#include <flyball/mechanisms/motor.hpp>
#include <flyball/study/frequency_points.hpp>
#include <flyball/study/model_job.hpp>

namespace flyball::study {

/// What an identification leaves open of the loop's plant.
struct PlantSpread {
  /// Of [kV/its value, ln kA, the loop's delay in s]; a row of zeros is known.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// The mechanism to be controlled: gains (identified, or computed from mass, gearing and motors).
struct PlantDescription {
  mechanisms::MechanismKind kind{};
  std::string name{};        ///< What to call it, if not by its kind.
  std::string unit = "rad";  ///< "m" or "rad".
  mechanisms::FeedforwardGains gains{};
  bool kA_determined = true;                   ///< If not, Theorem 14.3.2 is the plant.
  double kA_upper_bound = 0.0;                 ///< V·s²/unit, if not determined.
  std::string kA_reason{};                     ///< Why it is not determined, if a log says so.
  std::optional<PlantSpread> spread{};         ///< Of identified gains.
  std::optional<mechanisms::DcMotor> motor{};  ///< If known: current and battery sag are simulated.
  double gearing = 1.0;                        ///< Motor turns per output turn.
  double drum_radius = 0.0;          ///< m, of a known drum (of a swerve drive: wheel), else 0.
  double nominal_voltage = 12.0;     ///< V
  std::vector<Diagnostic> doubts{};  ///< Of parts that contradict each other.
};

/// What the controller has to do and what it works with. Empty optionals get a default that the
/// result's diagnostics tell.
struct ControllerOptions {
  double period = 0.020;                  ///< s
  std::vector<double> state_tolerance{};  ///< Bryson's largest acceptable errors; empty: chosen.
  double input_tolerance = 12.0;          ///< V
  double max_voltage = 12.0;              ///< V, the input's limit.
  std::optional<double> delay{};          ///< s, from sensing to acting; identified or 0 if absent.
  /// Act on the state that is predicted over the delay (PredictingLqg), with the gain for no delay,
  /// in place of a gain that is compensated for it (B.12).
  std::optional<bool> predict_delay{};
  NamedControl named{};  ///< Of a model by formula, see ModelJob.
};

/// What is measured, per sample, and how far the model is trusted.
struct EstimatorOptions {
  std::optional<double> measurement_std{};  ///< unit (position) or unit/s (flywheel).
  std::vector<double> model_std{};          ///< Per sample and state; empty: chosen.
};

/// The sensor that the simulated loop reads.
struct SensorOptions {
  double resolution = 0.0;  ///< unit, smallest step of the sensor; 0 for none.
};

/// The battery whose voltage sags under load.
struct BatteryOptions {
  double open_circuit_voltage = 12.5;  ///< V
  double resistance = 0.020;           ///< Ohm
};

/// The reference that the simulated loop follows: a trapezoid from 0 to the goal.
struct ProfileOptions {
  std::optional<double> goal{};          ///< unit (or unit/s for a flywheel).
  std::optional<double> max_velocity{};  ///< unit/s; the fastest the motor can follow if absent.
  std::optional<double> max_acceleration{};  ///< unit/s²
};

/// Design a controller for a mechanism.
struct DesignJob {
  PlantDescription plant;
  ControllerOptions controller;
  EstimatorOptions estimator;
  SensorOptions sensor;
  BatteryOptions battery;
  ProfileOptions profile;
  unsigned long long seed = 1;
};

/// The loop as it runs: plant, delay, observer and feedback; its limits are not in it.
struct LoopBehavior {
  Eigen::VectorXcd poles{};               ///< All of its eigenvalues, slowest first.
  double time_constant = 0.0;             ///< s, of the slowest.
  std::optional<double> rise_time{};      ///< s, of a small step from 10 % to 90 %.
  std::optional<double> settling_time{};  ///< s, until it stays within 2 % of its end.
  double overshoot = 0.0;                 ///< As a share of the step.
  std::vector<double> step_time{};        ///< s, each period of the small step.
  std::vector<double> step{};             ///< The controlled output over where it ends.
};

/// Robustness of the loop broken at the plant input, with the delay in it. Without a kA the worst
/// over every kA that was checked. Without feedback there is none: every entry is NaN.
struct LoopMargins {
  double gain_margin = 0.0;     ///< Ratio > 1 by which the gain may rise; infinity if any.
  double gain_reduction = 0.0;  ///< Ratio < 1 to which the gain may fall; 0 if any.
  double phase_margin = 0.0;    ///< rad
  double delay_margin = 0.0;    ///< s, further delay that is tolerated.
  double disk_margin = 0.0;     ///< Symmetric disk margin α.
  double crossover = 0.0;       ///< rad/s, gain crossover that limits the phase; 0 if none.
};

/// One point of the grid over inertia and gain errors.
struct RobustnessPoint {
  double inertia_factor = 1.0;  ///< True inertia over the model's; NaN where kA is not determined.
  double kA = 0.0;              ///< V·s²/unit, the true inertia's.
  double gain_factor = 1.0;     ///< True actuator gain over the model's.
  double delay_factor = 1.0;    ///< True delay over the model's.
  bool stable = false;
  double spectral_radius = 0.0;  ///< Of the closed loop.
  double overshoot = 0.0;        ///< Of a small step, as a share of it; infinity if unstable.
};

/// What is proven of the loop for every mechanism of a set.
struct PlantProof {
  std::string of{};   ///< "errors", "delays", "identified": which set.
  std::string set{};  ///< The same in words: "an inertia and a gain within ±20 % of the model's".
  bool tried = true;  ///< False where the loop has too many states for a proof.
  int states = 0;     ///< Of the loop, the inputs on their way among them.
  LoopCertificate certificate{};
  /// Of the worst member found, the parameters are [kV; kA; gain; delay].
};

/// The fastest trapezoid that the motor can follow with its voltage.
struct FastestMotion {
  double max_velocity = 0.0;      ///< unit/s
  double max_acceleration = 0.0;  ///< unit/s²
  double goal = 0.0;              ///< unit (unit/s for a flywheel), of the simulated motion.
  double duration = 0.0;          ///< s
  double voltage_reserve = 0.0;   ///< V kept back for feedback.
};

/// Gains in the unit that other tools want.
using PasteGains = exports::UnitGains;

/// A designed loop: what to implement, how well it holds, how it behaves.
///
/// States are [position, velocity] for elevators and arms and [velocity] for a flywheel. When kA is
/// not determined, a position mechanism has the state [position] alone (Theorem 14.3.2) and a
/// flywheel's velocity follows within one period. The input is always a voltage: the part of it
/// that the linear model sees, to which kS sgn(v) and gravity are added.
///
/// The loop, each period (MechanismController): the measurement, which is `delay`
/// old, is moved along the reference to now, y + delay dr/dt, so that a moving reference causes no
/// error; the observer predicts and corrects; u = K_delayed (r - x_hat) + B⁺ (r' - A r) + kS + kG.
/// A design that predicts over the delay leaves the measurement as it is and acts on the state that
/// the inputs on their way lead to.
struct DesignResult {
  DesignJob job;                     ///< As run, with every default filled in.
  std::vector<Coordinate> states{};  ///< Position (m), …
  bool velocity_servo = false;       ///< kA is not determined: Theorem 14.3.2 is the plant.

  Eigen::MatrixXd A_continuous, B_continuous;
  Eigen::MatrixXd A, B, C;  ///< Discrete plant (Theorem 7.3.1) and its output.
  Eigen::MatrixXd Q, R;     ///< LQR weights (Bryson).
  Eigen::MatrixXd K;        ///< LQR gain, u = K (r - x).
  /// What is used: the gain with the delay compensated (B.12), or K where the delay is predicted.
  Eigen::MatrixXd K_delayed;
  Eigen::VectorXcd poles{};       ///< Of A - B K: of the design, which knows no delay.
  Eigen::MatrixXd kalman_gain{};  ///< Filter form (9.22).
  Eigen::VectorXcd estimator_poles{};
  Eigen::MatrixXd inversion{};  ///< B⁺ of the plant inversion u = B⁺ (r' - A r).

  LoopBehavior loop{};        ///< As it runs.
  bool predicts = false;      ///< Whether the delay is predicted over.
  bool feedback = true;       ///< Whether the gain makes a difference anywhere below Nyquist.
  std::string no_feedback{};  ///< Why there is none.
  LoopMargins margins;
  /// Of the loop opened at the plant input, with the delay in it, on the model, up to Nyquist's
  /// frequency; empty without feedback.
  std::vector<FrequencyPoint> frequency_response{};
  std::vector<RobustnessPoint> robustness{};
  bool robust = false;  ///< Whether every point of the grid is stable.
  double worst_overshoot = 0.0;
  /// For every mechanism of a set, not of a grid: the errors of the grid, and what a log leaves
  /// open.
  std::vector<PlantProof> proofs{};

  FastestMotion motion;
  TimeSeries response{};  ///< The simulated closed loop: columns as `MechanismResponse`.
  double tracking_error_rms =
      0.0;  ///< unit, of the true position (velocity) against the reference.
  double tracking_error_max = 0.0;

  /// Of other tools' controllers, which cannot predict: with the delay compensated in the gain.
  std::vector<PasteGains> paste{};
  /// The same for loops on motor controllers, of 1 ms and without an observer, with the same delay;
  /// empty where there are none.
  std::vector<PasteGains> paste_on_board{};
  std::vector<Diagnostic> diagnostics{};
};

/// Runs the job: discretise, LQR by Bryson's rule, delay compensation, steady-state Kalman gain,
/// feedforward, margins, robustness grid, and a simulated trapezoid with noise, quantisation, delay
/// and battery sag. A kA that is not determined is taken to be anything from 0 to its upper bound:
/// margins and grid are checked over it, and the simulated mechanism has the upper bound. A delay
/// that is predicted over is checked from 0.75 to 1.25 of it.
/// @errors ArgumentError for meaningless options; RiccatiError when no controller exists;
///         DesignError. With what was noticed before.
[[nodiscard]] ExpectedAll<DesignResult> design(const DesignJob& job);

/// Why a well-formed job has no design.
enum class DesignError {
  gravity_too_strong,  ///< The motor cannot hold the mechanism within its voltage.
  no_motion_possible,  ///< Friction and gravity leave no voltage to move with.
  margins_lost,        ///< The loop with its delay is unstable for every tolerance tried.
};
[[nodiscard]] ErrorInfo error_info(DesignError code);

}  // namespace flyball::study
