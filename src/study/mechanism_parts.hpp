#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <flyball/study/project.hpp>

#include "study/field.hpp"

namespace flyball::study {

/// A kind of mechanism: what its signals are, which keys of [mechanism] make it, and how.
struct MechanismRow {
  mechanisms::MechanismKind kind;
  SignalDimensions signals;
  std::span<const std::string_view> needs;
  std::span<const std::string_view> may;  ///< Keys that it may have beside these.
  /// Called with every need met; writes the gains and the nominal voltage.
  /// @errors those of the mechanism's function.
  Expected<void> (*make)(const MechanismParts& parts, PlantDescription& plant);
};

/// What the drum of an elevator moves: Theorem 6.9.1's mass, or stages that pull each other and a
/// counterbalance (`CascadeElevator`).
struct ElevatorLift {
  double rise = 0.0;     ///< m of the carriage per radian of the drum.
  double inertia = 0.0;  ///< kg, at the carriage.
  double weight = 0.0;   ///< N, less the counterbalance.
};
/// Of mass and drum_radius, which are there. @errors ArgumentError for masses of stages that are
/// none; those of the mechanism's function.
[[nodiscard]] Expected<ElevatorLift> elevator_lift(const MechanismParts& parts);

/// An arm's inertia about its joint is that of a point mass there, at least: tells where it is not.
void doubt_arm(const MechanismParts& parts, std::vector<Diagnostic>& doubts);

[[nodiscard]] const MechanismRow& mechanism_row(mechanisms::MechanismKind kind);
[[nodiscard]] std::span<const MechanismRow> mechanism_rows();

}  // namespace flyball::study
