#pragma once

#include "math/dense/instruction_set.hpp"
#include "math/extended/double_double.hpp"

namespace flyball::detail {

// The eigenvalues of M, at most 60 steps each, into `values`; false where they do not converge.
// Cost: 50 n³ products of 31 digits, each of which is one instruction and a few sums with fused
// multiply-add.
FLYBALL_KERNEL(bool extended_eigenvalues(const DoubleDoubleMatrix& M, std::complex<double>* values))

}  // namespace flyball::detail
