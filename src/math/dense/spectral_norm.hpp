#pragma once

#include "math/dense/dense.hpp"

namespace flyball::detail {

/// ‖A‖₂, to rounding, by the eigenvalues of AᴴA: a fraction of the work of all singular values.
/// Zero of an empty matrix, NaN of one that is not finite.
[[nodiscard]] double spectral_norm_of_complex(const ComplexMatrixRef& A);

}  // namespace flyball::detail
