#pragma once

#include <optional>
#include <vector>

#include "study/answer/parts.hpp"

/// A drivetrain's velocity loops in the answer of `tune`.
namespace flyball::study {

/// Why there is no design of either mode; nothing if there is one.
[[nodiscard]] std::optional<Error> refusal_of(const DriveDesign& drive);
/// Of both modes, each named.
[[nodiscard]] std::vector<Diagnostic> diagnostics_of(const DriveDesign& drive);
/// What the modes' loops add to the verdict on the log.
void add_verdict(Verdict& verdict, const DriveDesign& drive);

/// The members "linear", "angular", "kP", "K" of the answer's "drive".
void write_drive_design(JsonWriter& json, const TuneResult& result);
/// Sections, figures and files.
void add_drive_design(Answer& answer, const TuneResult& result);

}  // namespace flyball::study
