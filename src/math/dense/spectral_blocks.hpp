#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// The states of A in parts, each of those that drive each other.
[[nodiscard]] std::vector<std::vector<Eigen::Index>> parts_of(const MatrixRef& A);

/// Square matrices whose eigenvalues together are those of A, where parts of A are so far apart
/// that the QR iteration would lose the small ones in rounding of the large ones; else A alone.
///
/// States that drive each other are a part; A is block triangular in its parts. A part in which, in
/// balanced units, a group F of states is a million times as fast as the others S is decoupled:
/// with X F = A_SF + S X - X A_FS X its eigenvalues are those of F + A_FS X and S - X A_FS,
/// computed in twice the precision. Source: Kokotović, Khalil and O'Reilly, "Singular perturbation
/// methods in control" (1986), section 2.2; Golub and Van Loan, "Matrix Computations", section 7.6.
[[nodiscard]] std::vector<Eigen::MatrixXd> spectral_blocks(const MatrixRef& A);

/// The eigenvalues of A, part by part also where the parts are not far apart: its eigenvalues are
/// theirs, whatever couples them. All NaN where the QR iteration did not converge.
[[nodiscard]] Eigen::VectorXcd eigenvalues_by_parts_of(const MatrixRef& A);

}  // namespace flyball::detail
