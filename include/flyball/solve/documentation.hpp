#pragma once

#include <string>

#include <flyball/solve/kind.hpp>

/// What is told of the kinds of problems; all of it comes from their rows.
namespace flyball::solve {

/// Every kind with what it solves, for a terminal.
[[nodiscard]] std::string list_of_kinds();

/// The fields of one kind with shapes and units, what is answered, and an example.
[[nodiscard]] std::string help_of(const Kind& kind);

/// The page docs/solve.md.
[[nodiscard]] std::string markdown();

/// JSON Schema (2020-12) of every kind's problem and answer, docs/schemas/solve.schema.json:
/// `#/$defs/dare.problem`, `#/$defs/dare.answer`, and `#/$defs/refusal` for {"error": …}.
[[nodiscard]] std::string json_schema();

}  // namespace flyball::solve
