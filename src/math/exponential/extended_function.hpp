#pragma once

#include <optional>

#include "math/extended/double_double.hpp"

/// Logarithm and power in twice the working precision, without eigenvalues: where rounding of a
/// Schur form in one set of units is more than the large entries of another.
namespace flyball::detail {

/// The principal logarithm, by square roots until A is near the identity and quadrature; nothing
/// where they do not converge: A is singular, or an eigenvalue is on the negative real axis.
[[nodiscard]] std::optional<DoubleDoubleMatrix> extended_logarithm(const DoubleDoubleMatrix& A);

/// e^X by scaling, Taylor and squaring.
[[nodiscard]] DoubleDoubleMatrix extended_exponential(const DoubleDoubleMatrix& X);

}  // namespace flyball::detail
