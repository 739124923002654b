#pragma once

#include <string>

#include <flyball/core/answer.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

/// What the jobs answer, to be shown by flyball/report, written or sent. The same result gives the
/// same answer.
namespace flyball::study {

/// What the log holds, delays and averaging found, gains with 95 % intervals beside those of the
/// one-step regression, the quality of the fit; each run measured against simulated. A refused fit
/// is told with its reason, and the log shown as it was recorded. Schema "flyball.identify/1".
[[nodiscard]] Answer answer_of(const IdentifyResult& result);

/// Plant, gains, poles, feedforward, margins, the robustness grid, the fastest trapezoid, constants
/// to paste; the closed loop's response; gains.toml (a project file), the generated header. Schema
/// "flyball.design/2".
[[nodiscard]] Answer answer_of(const DesignResult& result);

/// Both. If the fit or the design was refused, what there is and the reason. Schema
/// "flyball.tune/2".
[[nodiscard]] Answer answer_of(const TuneResult& result);

/// A linear system: what it is, its poles, what can be moved and seen, gains, what sampling makes
/// of it; pole map and step responses. Schema "flyball.analyze/2".
[[nodiscard]] Answer answer_of(const ModelAnalysis& result);

/// The answer's JSON alone (docs/schemas.md).
[[nodiscard]] std::string to_json(const IdentifyResult& result);
[[nodiscard]] std::string to_json(const DesignResult& result);
[[nodiscard]] std::string to_json(const TuneResult& result);
[[nodiscard]] std::string to_json(const ModelAnalysis& analysis);

}  // namespace flyball::study
