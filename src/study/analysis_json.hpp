#pragma once

#include <span>
#include <string>

#include <flyball/study/analyze.hpp>

#include "study/answer_writer.hpp"

namespace flyball::study {

/// The fields that `solve analyze` answers and `analyze --json` too.
void write_structure(const StructureAnalysis& structure, std::span<const std::string> states,
                     AnswerWriter& answer);

}  // namespace flyball::study
