#pragma once

#include <span>
#include <string>

#include <flyball/systems/structure.hpp>

#include "solve/row.hpp"

namespace flyball::solve {

/// The fields that `solve analyze` answers and `analyze --json` too.
void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     JsonWriter& answer);

/// What it writes, as fields of an answer.
[[nodiscard]] std::vector<Field> structure_fields();

}  // namespace flyball::solve
