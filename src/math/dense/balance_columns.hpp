#pragma once

namespace flyball::detail {

/// The exponent that no unit exceeds: those whose ratio squared has no double would leave nothing
/// of a quadratic form.
inline constexpr int widest_unit = 250;

/// A ← D⁻¹AD and d ← d D with powers of two D such that rows and columns are of one size without
/// the diagonal (Osborne; Parlett and Reinsch). A state that only drives others, or is only driven,
/// is scaled until what connects it is no larger than the diagonal. Columns of A lie `ld` apart.
void balance_columns(int n, double* A, int ld, double* d);

}  // namespace flyball::detail
