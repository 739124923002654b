#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

/// What of a pair can be said without rounding: from which entries are zero, and from each entry's
/// own size.
namespace flyball::detail {

/// The states to which a path of entries that are not zero leads from an input, in their order.
[[nodiscard]] std::vector<Eigen::Index> states_on_paths(const MatrixRef& A, const MatrixRef& B);

/// Whether wᵀ[A - λI, B] = 0 forces w = 0 for every λ because one equation after the other is left
/// with a single unknown: then any relative change of the entries leaves the pair controllable. So
/// a chain of integrators, a companion matrix, distinct modes side by side.
/// @param tolerance  Diagonal entries this close, relative to themselves, count as one.
/// Cost: O(n²(n + m)), far less where nothing is forced.
/// Source: Mayeda and Yamada, "Strong structural controllability", SIAM J. Control Optim. 17
/// (1979).
[[nodiscard]] bool surely_reached(const MatrixRef& A, const MatrixRef& B, double tolerance);

/// Whether rank [A - λI, B] = n at each eigenvalue once the pencil's rows and columns are of one
/// size each: parts of a system whose speeds differ by more than rounding are told apart only so.
/// False, without a look, where no two parts differ so much.
/// @param A, B  In balanced units.
[[nodiscard]] bool reached_at_every_speed(const MatrixRef& A, const MatrixRef& B);

}  // namespace flyball::detail
