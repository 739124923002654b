#pragma once

#include <flyball/systems/analysis.hpp>
#include <flyball/systems/controllability.hpp>

namespace flyball {

/// Poles, and what of a system can be moved and seen.
struct StructureAnalysis {
  ModalAnalysis modes;
  ControllabilityAnalysis controllability;
  ObservabilityAnalysis observability;
};
/// @param system  A, B, C; of a discrete system its matrices too. @param period  T, s, of a
/// discrete system.
/// @errors ArgumentError for the system; those of analyze_modes, analyze_controllability and
///         analyze_observability.
[[nodiscard]] Expected<StructureAnalysis> analyze_structure(const ContinuousSystem<>& system,
                                                            TimeDomain domain,
                                                            Time period = Time(1.0));

}  // namespace flyball
