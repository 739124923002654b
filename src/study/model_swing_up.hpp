#pragma once

#include <flyball/simulation/closed_loop.hpp>
#include <flyball/study/simulate.hpp>

namespace flyball::study {

/// A model under a law, sampled each period, as `simulate_closed_loop` with the regulator.
[[nodiscard]] Expected<Simulation> simulate_with(const ModelJob& job,
                                                 const ModelRegulator& regulator,
                                                 const ModelRun& run, ControlLaw law);

/// Whether a region of attraction is worth its time: the point is not stable by itself, and every
/// input has a limit.
[[nodiscard]] bool wants_region(const ModelJob& job, const ModelRegulator& regulator);

/// From where the regulator holds the point.
/// @errors As `certify_region`; ArgumentError for inputs without limits.
[[nodiscard]] Expected<ModelRegion> region_of(const ModelJob& job, const ModelRegulator& regulator);

/// Tells of an energy that is none: while the input rests, or holds what [swing_up] holds, it
/// comes and goes; or the input does not change it. At 64 random states. Losses are none of it.
void doubt_energy(const ModelJob& job, const ModelRegulator& regulator,
                  std::vector<Diagnostic>& doubts);

/// The swing-up by [swing_up]'s energy, simulated. @errors ArgumentError for an energy that the
/// angles do not change; as `simulate_with`.
[[nodiscard]] Expected<SwingUpRunResult> swing_up(const ModelJob& job,
                                                  const ModelRegulator& regulator,
                                                  const ModelRegion& region);

}  // namespace flyball::study
