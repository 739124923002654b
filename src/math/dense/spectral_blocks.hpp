#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// Square matrices whose eigenvalues together are those of A, where parts of A are so far apart
/// that the QR iteration would lose the small ones in rounding of the large ones; else A alone.
///
/// States that drive each other are a part; A is block triangular in its parts. A part in which, in
/// balanced units, a group F of states is a million times as fast as the others S is decoupled:
/// with X F = A_SF + S X - X A_FS X its eigenvalues are those of F + A_FS X and S - X A_FS,
/// computed in twice the precision. Source: Kokotović, Khalil and O'Reilly, "Singular perturbation
/// methods in control" (1986), section 2.2; Golub and Van Loan, "Matrix Computations", section 7.6.
[[nodiscard]] std::vector<Eigen::MatrixXd> spectral_blocks(const MatrixRef& A);

/// The same, and the parts of A where they are not far apart, too: its eigenvalues are theirs,
/// whatever couples them.
[[nodiscard]] std::vector<Eigen::MatrixXd> spectral_parts(const MatrixRef& A);

}  // namespace flyball::detail
