#pragma once

#include <span>
#include <string_view>

#include <flyball/study/project.hpp>

#include "study/field.hpp"

namespace flyball::study {

/// A kind of mechanism: what its signals are, which keys of [mechanism] make it, and how.
struct MechanismRow {
  mechanisms::MechanismKind kind;
  SignalDimensions signals;
  std::span<const std::string_view> needs;
  /// Called with every need met; writes the gains and the nominal voltage.
  /// @errors those of the mechanism's function.
  Expected<void> (*make)(const MechanismParts& parts, PlantDescription& plant);
};

[[nodiscard]] const MechanismRow& mechanism_row(mechanisms::MechanismKind kind);
[[nodiscard]] std::span<const MechanismRow> mechanism_rows();

}  // namespace flyball::study
