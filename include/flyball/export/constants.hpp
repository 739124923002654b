#pragma once

#include <string>
#include <vector>

#include <flyball/export/language.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>

namespace flyball::exports {

/// Gains in the unit that another tool wants, per output unit named by `per`.
struct UnitGains {
  std::string per{};  ///< "rad", "m", "rotation", "RPM", …
  double kP = 0.0;    ///< V/unit (position) or V/(unit/s) (flywheel).
  double kD = 0.0;    ///< V/(unit/s)
  double kS = 0.0;    ///< V
  double kV = 0.0;    ///< V/(unit/s)
  double kA = 0.0;    ///< V/(unit/s²)
  double kG = 0.0;    ///< V
};

/// A mechanism's controller as other tools know it.
struct MechanismConstants {
  mechanisms::MechanismKind kind = mechanisms::MechanismKind::flywheel;
  std::string name{};              ///< Of the constants, "Drivetrain"; empty: the kind's.
  std::string unit = "rad";        ///< "m" or "rad", for which there are gains.
  std::vector<UnitGains> gains{};  ///< Per that unit and, where it is known, "rotation" and "RPM".
  /// The same units with gains for a loop of 1 ms on the motor controller; empty: those above.
  std::vector<UnitGains> on_board{};
  double period = 0.020;          ///< s
  double delay = 0.0;             ///< s, age of the measurement that the gains are designed for.
  double nominal_voltage = 12.0;  ///< V
  double gearing = 1.0;           ///< Motor turns per output turn.
  double angle_offset = 0.0;      ///< rad, true angle from horizontal less the measured one (arms).
  bool kA_determined = true;
  double kA_upper_bound = 0.0;  ///< V·s²/unit, if not determined.
  std::string kA_reason{};      ///< Why it is not determined, if that is known.
  std::string no_feedback{};    ///< Why there is none; empty where there is.
};

/// Constants in the form that a team pastes, for one library in one language.
struct PasteText {
  std::string title;  ///< "WPILib, Java".
  std::string file;   ///< A name for it: "constants/wpilib_java.txt".
  std::string text;   ///< Lines that end in a newline; the unit stands on each line with a number.
};

/// For WPILib 2025, in SI units of the mechanism: kS, kG (V), kV (V·s/unit), kA (V·s²/unit), kP
/// (V/unit; V·s/unit for a flywheel), kD (V·s/unit), and the objects that take them. A kA that is
/// not determined is 0, with the reason beside it.
/// @return Empty if there are no gains per the mechanism's own unit.
[[nodiscard]] std::string wpilib_constants(const MechanismConstants& constants, Language language);

/// For CTRE Phoenix 6, a Slot0Configs per rotation of the mechanism, all in volts; the gains are
/// those of its own loop where there are some.
/// @return Empty if there are no gains per rotation (an elevator without a drum radius).
[[nodiscard]] std::string phoenix_constants(const MechanismConstants& constants, Language language);

/// For REVLib, per rotation and RPM of the mechanism, of a SPARK's own loop where there are some;
/// says what is in volts and what SPARKs want as a share of the full voltage. A SPARK adds kD (e_k
/// - e_(k-1)) every millisecond without dividing by the time between, so its kD is the one in V/RPM
/// times 60 s/min, over 1 ms, over the voltage. Source: the preset of WPILib's SysId for REV
/// controllers (period 1 ms, not time-normalised).
/// @return Empty if there are no gains per RPM.
[[nodiscard]] std::string rev_constants(const MechanismConstants& constants, Language language);

/// All of them that there are gains for, WPILib first.
[[nodiscard]] std::vector<PasteText> paste_constants(const MechanismConstants& constants);

}  // namespace flyball::exports
