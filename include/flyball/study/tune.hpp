#pragma once

#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::study {

/// Identify a mechanism from a log, then design its controller.
struct TuneJob {
  IdentifyJob identification;
  /// Its plant, and a delay that is not given, come from the log; where its plant has gains of its
  /// own (motor and gearing, or [gains]), the log's are held against them.
  DesignJob design;
};

/// A drivetrain's velocity loops. Its modes, half the sum and half the difference of the sides, are
/// mechanisms of one degree of freedom that nothing couples (section 14.4), each designed by itself
/// in units of a wheel's way: one gain on both sides acts on both modes alike.
struct DriveDesign {
  std::optional<ExpectedAll<DesignResult>> linear{};   ///< Of half the sum, if it was identified.
  std::optional<ExpectedAll<DesignResult>> angular{};  ///< Of half the difference.
  /// V/(unit/s) of either side's loop: the smaller of the modes', whose plants are stable and whose
  /// margins a smaller gain leaves.
  double kP = 0.0;
  /// u = K (r − x) of [left, right], with each mode's own gain; there with both designs.
  std::optional<Eigen::Matrix2d> K{};
};

/// Both results. When the fit was refused there is no design; its error is in the identification.
struct TuneResult {
  IdentifyResult identification;
  std::optional<ExpectedAll<DesignResult>> design{};
  std::optional<DriveDesign> drive{};  ///< In its place, of a drivetrain.
};

/// @errors as `identify`.
[[nodiscard]] ExpectedAll<TuneResult> tune(const TuneJob& job);

/// The plant that a fit hands on: its gains; kA only if it is determined (else its upper bound).
[[nodiscard]] PlantDescription plant_from_fit(const identification::FeedforwardFit& fit);

}  // namespace flyball::study
