#pragma once

#include <span>
#include <string>

#include <flyball/systems/structure.hpp>

#include "io/answer_writer.hpp"

namespace flyball::solve {

/// The fields that `solve analyze` answers and `analyze --json` too.
void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     AnswerWriter& answer);

}  // namespace flyball::solve
