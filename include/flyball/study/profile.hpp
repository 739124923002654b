#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/planning/profiles/profile_selection.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// A profile that is asked for: lengths, or angles if `angle`, in SI.
struct ProfileJob {
  std::string name{};  ///< Of one of several axes.
  std::string kind{};  ///< As `parse_profile_kind`; empty: chosen by `select_profile`.
  bool angle = false;
  bool continuous = false;  ///< The angle goes the short way.
  MotionState from{};
  MotionState to{};
  std::optional<double> to_velocity{};  ///< Of a change of the velocity, wherever it ends.
  double velocity = 0.0;                ///< 0: the motor's.
  double acceleration = 0.0;
  double deceleration = 0.0;      ///< 0: as `acceleration`.
  double reverse_velocity = 0.0;  ///< 0: as `velocity`.
  std::optional<Time> ramp{};     ///< From no to full acceleration.
  /// Of the motor, if kV is given: V per velocity and acceleration, V.
  std::optional<double> kV{};
  std::optional<double> kA{};
  double kS = 0.0;
  double kG = 0.0;
  Voltage voltage{12.0};
  std::optional<Current> current{};        ///< Its limit, with `resistance`.
  std::optional<Resistance> resistance{};  ///< Of all motors.
  double jump = 0.0;                       ///< Of a stepper profile.
  bool step_motor = false;
  bool delicate = false;
  std::optional<Frequency> resonance{};
  Time period{0.02};
};

/// What became of it.
struct ProfileResult {
  ProfileJob job{};
  ProfileKind kind = ProfileKind::trapezoid;
  std::string unit{};                  ///< "m" or "rad"
  std::vector<std::string> reasons{};  ///< Why it was chosen; empty if it was asked for.
  MotionLimits limits{};
  double duration = 0.0;
  double other_duration = 0.0;  ///< Of the trapezoid, if it is none.
  TimeSeries table{};           ///< Each period: position, velocity, acceleration; then the end.
  /// The same for a picture: finer where it is short, and on both sides of what changes at once.
  TimeSeries curve{};
  std::vector<double> changes{};  ///< Where its acceleration or jerk changes at once, s, from 0.
  double peak_velocity = 0.0;
  double peak_acceleration = 0.0;
};

/// The fields of a profile, for whoever asks a person for them.
[[nodiscard]] std::vector<FieldInfo> profile_fields();

/// A job of a command line. @errors ProjectError, ArgumentError.
[[nodiscard]] ExpectedAll<ProfileJob> profile_job(std::span<const Override> given);

/// Plans and tabulates it.
/// @errors ArgumentError: without limits or motor, of a kind that is not there, of numbers that no
///         profile takes, of more than a million rows.
/// Source: book, section 15.1.
[[nodiscard]] Expected<ProfileResult> plan_profile(const ProfileJob& job);

/// Table, picture, CSV and a C++ header of the table. Schema "flyball.profile/1".
[[nodiscard]] Answer answer_of(const ProfileResult& result);

}  // namespace flyball::study
