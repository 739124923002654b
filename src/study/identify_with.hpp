#pragma once

#include <flyball/core/function_ref.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::study {

/// Reads a recording by a selection, which may be asked for a second time.
using LoadFunction =
    FunctionRef<ExpectedAll<recording::LoadedRecording>(const recording::LogSelection&)>;

/// `identify` of whatever `load` reads.
[[nodiscard]] ExpectedAll<IdentifyResult> identify_with(const recording::LogSelection& selection,
                                                        const LoadFunction& load);

/// Adds what contradicts the project, if there are gains.
void tell_contradictions(identification::FitReport& report, const PlantDescription& said);

}  // namespace flyball::study
