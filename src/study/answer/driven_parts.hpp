#pragma once

#include <vector>

#include <flyball/study/drive.hpp>

/// Pieces of the answer of `flyball drive`.
namespace flyball::study {

/// The field from above, errors, speeds, voltages and the battery over time.
[[nodiscard]] std::vector<Figure> figures_of(const DriveResult& result);
/// The robot on the field, moving.
[[nodiscard]] std::vector<Animation> animations_of(const DriveResult& result);
/// "data/drive.wpilog": poses, module states, chassis speeds, voltages, a Mechanism2d.
[[nodiscard]] AnswerFile driven_log_file(const DriveResult& result);

/// "left", …: the motors of the record's columns, without those that steer.
[[nodiscard]] std::vector<std::string> shaft_names(DriveKind kind);

/// Of all pictures over time.
inline constexpr const char* drive_clock = "drive";

}  // namespace flyball::study
