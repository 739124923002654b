#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/identification/recording.hpp>
#include <flyball/mechanisms/differential_drive.hpp>

namespace flyball::identification {

/// A side of a drivetrain in one test; columns are as long as the run's time, or empty.
struct DriveSide {
  std::vector<double> voltage{};   ///< V
  std::vector<double> position{};  ///< m
  std::vector<double> velocity{};  ///< m/s
};

/// One test of a drivetrain, on one clock. A side has a position, a velocity, or both.
struct DriveRun {
  TestKind kind = TestKind::quasistatic_forward;  ///< As the log says; of a rotation, forward is
                                                  ///< counter-clockwise.
  std::vector<double> time{};                     ///< s, ascending.
  DriveSide left{};
  DriveSide right{};
  std::vector<double> heading{};       ///< rad, counter-clockwise; empty without a gyro.
  std::vector<double> heading_rate{};  ///< rad/s; may be empty.
};

/// The characterisation tests of a differential drive: straight ones, rotations about its middle,
/// or both; any number of each kind.
struct DriveRecording {
  std::string unit = "m";  ///< Of positions: "m", or "rad" of wheels whose size is not known.
  std::vector<DriveRun> runs{};
};

/// How a test drove, as its voltages say.
enum class DriveTest {
  straight,  ///< Both sides alike.
  turning,   ///< The sides against each other.
  mixed,     ///< Neither: a curve, which tells both modes.
};
/// "straight", "turning", "curve".
[[nodiscard]] std::string_view to_string(DriveTest test);

/// A drivetrain's gains by mode (section 14.4), each an output-error fit of its own: half the sum
/// of the sides and half their difference are mechanisms of one degree of freedom, which nothing
/// couples while both sides move.
struct DriveFit {
  std::string unit;                          ///< "m" or "rad".
  std::optional<FeedforwardFit> linear{};    ///< Of half the sum of the sides.
  std::optional<FeedforwardFit> angular{};   ///< Of half their difference: V/(unit/s) of a wheel.
  std::optional<GainEstimate> kS_left{};     ///< V, of the straight tests (else of the rotations).
  std::optional<GainEstimate> kS_right{};    ///< V
  std::optional<GainEstimate> trackwidth{};  ///< m; there with a gyro.

  /// The drive's gains if both modes were identified with their kA.
  [[nodiscard]] std::optional<mechanisms::DriveGains> gains() const;
};

/// A gain of the angular mode, per unit of a wheel's way, as one per radian of the robot's heading:
/// times half the trackwidth, with the errors of both. Source: book, Theorem 14.5.1.
[[nodiscard]] GainEstimate per_radian(const GainEstimate& gain, const GainEstimate& trackwidth);

/// A run's sides and heading, as measured and as the whole model makes them in free run from both
/// recorded voltages.
struct FittedDriveRun {
  bool used = false;  ///< Whether a fit used it; if not, nothing is simulated.
  std::vector<double> time{};
  std::vector<double> left_velocity{}, right_velocity{};          ///< Measured.
  std::vector<double> left_velocity_hat{}, right_velocity_hat{};  ///< As the sensors would show it.
  std::vector<double> heading{}, heading_hat{};  ///< Empty without a gyro, or without trackwidth.
};

/// The answer with everything that led to it.
struct DriveReport {
  DriveRecording recording;            ///< With its signs and its heading mended.
  std::vector<DriveTest> tests{};      ///< Of its runs.
  std::vector<FittedDriveRun> runs{};  ///< Of its runs; empty for a refused fit.
  std::vector<Diagnostic> diagnostics{};
  Expected<DriveFit> fit;
};

/// Identifies a differential drive: kS, kV and kA of the straight and of the turning motion, kS of
/// either side and the trackwidth, by `identify_feedforward` of each mode, by what drives the sides
/// apart and by the heading against the difference of their ways.
///
/// What is mended and told: a side's encoder that counts against its voltage, voltages without
/// sign, sides that are swapped, a gyro that counts clockwise or in degrees, a rate that is not the
/// heading's. A mode that no test excites is left out, and told.
///
/// @errors in `fit`: IdentificationError::no_data, no_motion (with the side), and what the modes'
///         fits refuse; ArgumentError::wrong_shape for malformed columns.
/// Cost: two fits of `identify_feedforward`.
/// Source: book, sections 14.4 and 14.5.
[[nodiscard]] DriveReport identify_drive(const DriveRecording& recording,
                                         const FitOptions& options = {});

}  // namespace flyball::identification
