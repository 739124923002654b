#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/identification/motor_curve.hpp>

namespace flyball::study {

/// Dynamometer files of motors.
struct MotorCurvesJob {
  std::vector<std::string> paths;
  /// Of all files; by the file's name if it is left out, and compared with nothing where that names
  /// no motor of the table.
  std::string motor{};
  std::optional<double> voltage{};  ///< V, of curves that do not tell it.
};

/// What one file says.
struct MotorCurveFile {
  std::string source;
  Eigen::Index rows = 0;  ///< That were used.
  double voltage = 0.0;   ///< V; of a locked rotor the mean.
  std::optional<identification::MotorConstants> curve{};
  std::optional<identification::LockedRotorConstants> locked{};
  std::optional<mechanisms::DcMotor> known{};  ///< The table's.
};

/// What all files say, in the order in which they were given.
struct MotorCurvesResult {
  std::vector<MotorCurveFile> files;
  std::vector<Diagnostic> diagnostics{};
};

/// A file's constants: CSV with columns of speed, torque and current (a motor curve), or of time,
/// voltage, torque and current (a locked rotor); units in the header. A controller's log of bus
/// voltage, output in percent and input current is taken to the motor's side.
/// @errors FileError, LogError; ArgumentError::unknown_name (motor), wrong_unit, empty (a column),
///         as fit_motor_curve and fit_locked_rotor; each with the path.
/// Source: book, section 12.1.2.
[[nodiscard]] Expected<MotorCurvesResult> fit_motor_curves(const MotorCurvesJob& job);

/// The constants beside the table's. Schema "flyball.motor-curves/1".
[[nodiscard]] Answer answer_of(const MotorCurvesResult& result);

}  // namespace flyball::study
