#pragma once

#include <optional>

#include <flyball/math/expression/tape_builder.hpp>

namespace flyball::expression {

/// The partial derivatives of a node by its operands, as slots.
struct Slopes {
  std::optional<Slot> by_a;
  std::optional<Slot> by_b;
};

/// @param y  The node's own slot. @param by_a, by_b  Which are asked for.
/// For `minimum`, `maximum` and `select`, whose untaken branch may be infinite, see `branch_of`.
[[nodiscard]] Slopes slopes(TapeBuilder& tape, Slot y, bool by_a, bool by_b);

/// Whether the slopes of an operation are finite wherever its operands are; those of `chain` count
/// on operands that are not.
[[nodiscard]] bool has_finite_slopes(Operation operation) noexcept;

/// A choice between two operands: condition ≠ 0 ? then : otherwise.
struct Branch {
  Slot condition;
  Slot then;
  Slot otherwise;
};
/// The choice that a node makes, if it makes one.
[[nodiscard]] std::optional<Branch> branch_of(TapeBuilder& tape, Slot y);

}  // namespace flyball::expression
