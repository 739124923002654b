#pragma once

#include <flyball/math/equations/matrix_equation.hpp>

namespace flyball::detail {

/// `discrete_lyapunov` for a correction of another solution, of which the first digits do: whether
/// it satisfies the equation beside sums that cancel is not asked.
[[nodiscard]] Expected<LinearMatrixSolution> discrete_lyapunov_correction(const MatrixRef& A,
                                                                          const MatrixRef& Q);

}  // namespace flyball::detail
