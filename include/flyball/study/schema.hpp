#pragma once

#include <string>

#include <flyball/core/errors.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::study {

/// One JSON object on one line, numbers round-trip; schema "flyball.identify/1" (docs/schemas.md).
[[nodiscard]] std::string to_json(const IdentifyResult& result);
/// Schema "flyball.design/1".
[[nodiscard]] std::string to_json(const DesignResult& result);
/// Schema "flyball.tune/1".
[[nodiscard]] std::string to_json(const TuneResult& result);
/// Schema "flyball.analyze/1".
[[nodiscard]] std::string to_json(const ModelAnalysis& analysis);
/// A refusal: {"schema": …, "error": {"code", "message", …evidence}, "diagnostics": […]}, and
/// `errors` with all of them where there are several.
[[nodiscard]] std::string to_json(const Errors& errors, const std::string& schema);

}  // namespace flyball::study
