#pragma once

#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::study {

/// Identify a mechanism from a log, then design its controller.
struct TuneJob {
  IdentifyJob identification;
  DesignJob design;  ///< Its plant, and a delay that is not given, come from the log.
};

/// Both results. When the fit was refused there is no design; its error is in the identification.
struct TuneResult {
  IdentifyResult identification;
  std::optional<ExpectedAll<DesignResult>> design{};
};

/// @errors as `identify`.
[[nodiscard]] ExpectedAll<TuneResult> tune(const TuneJob& job);

/// The plant that a fit hands on: its gains; kA only if it is determined (else its upper bound).
[[nodiscard]] PlantDescription plant_from_fit(const identification::FeedforwardFit& fit);

}  // namespace flyball::study
