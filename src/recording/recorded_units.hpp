#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/identification/recording.hpp>
#include <flyball/recording/load_recording.hpp>

/// In which units a log's positions and velocities are: said, in its metadata, in its channels'
/// names, or told by the data.
namespace flyball::recording {

/// Where a unit is known from; the later have the last word.
enum class UnitSource { none, assumed, data, name, metadata, said };

/// A unit of a position (a length or an angle) or of its rate.
struct RecordedUnit {
  std::string text{};   ///< "rotations", "RPM", as recorded or as a person would write it.
  double factor = 1.0;  ///< SI a unit.
  bool linear = false;  ///< A length or a velocity; else an angle or an angular velocity.
  UnitSource source = UnitSource::none;

  [[nodiscard]] bool known() const { return source != UnitSource::none; }
};

/// The unit that a channel's name ends in or holds: "PositionRad", "pos in Degrees", "VelocityRPM",
/// "velocity_m_s". A rate without "per second" is one a second.
[[nodiscard]] RecordedUnit unit_in_name(std::string_view name, bool rate);

/// Whether a channel's name or unit says that it counts an encoder's ticks.
[[nodiscard]] bool counts_ticks(std::string_view name, std::string_view unit);

/// The unit of a text, of a position or of a rate ("Rotation" of a rate is one a second); unknown
/// if it is of neither.
[[nodiscard]] RecordedUnit unit_of_text(std::string_view text, bool rate, UnitSource source);

struct RecordedUnits {
  RecordedUnit position;
  RecordedUnit velocity;
};

/// Settles both units by what is known and by the ratio of the columns; what was corrected or
/// assumed is told in `notes`. A position whose unit nothing tells stays unknown.
/// @param ratio  Of `velocity_ratio`.
/// @errors RecordingError::unit_mismatch if the columns do not differ by the units' ratio nor by
///         one that a mistaken unit explains.
[[nodiscard]] Expected<RecordedUnits> settle_units(RecordedUnits units, std::optional<double> ratio,
                                                   std::vector<Diagnostic>& notes);

/// The unit that angles of unknown unit are most likely in: the first of rotations, radians and
/// degrees with which the mechanism's speed at 12 V is one that such a mechanism has.
/// @param runs   As recorded. @param ratio  Of `velocity_ratio`.
[[nodiscard]] RecordedUnit likely_angle_unit(const std::vector<identification::TestRun>& runs,
                                             std::optional<double> ratio,
                                             std::optional<mechanisms::MechanismKind> kind);

/// The unit that a drivetrain's ways of unknown unit are most likely in: the first of metres, feet
/// and inches with which its speed at 12 V is a drivetrain's.
[[nodiscard]] RecordedUnit likely_way_unit(const std::vector<identification::TestRun>& runs,
                                           std::optional<double> ratio);

/// Whether a mechanism of that kind (of any, if it is not known) turns so fast at 12 V, rad/s.
[[nodiscard]] bool has_usual_speed(std::optional<mechanisms::MechanismKind> kind, double speed);

}  // namespace flyball::recording
