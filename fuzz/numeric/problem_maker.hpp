#pragma once

#include <nlohmann/json.hpp>

#include <flyball/solve/kind.hpp>

#include "numeric/choices.hpp"

namespace flyball::fuzz {

/// A problem of a kind, made from the fields of its row: matrices of 0 to 8 rows and columns with
/// entries from a palette (0, ±1, rounding errors, subnormals, 1e±20, 1e±154, 1.7e308, fractions),
/// in the shapes on which kernels fail (repeated rows, defective, companion, badly scaled, …).
/// Shapes agree and numbers are finite, so that it is the kernel that answers.
[[nodiscard]] nlohmann::json make_problem(const solve::Kind& kind, Choices& choices);

}  // namespace flyball::fuzz
