#pragma once

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// Where a system passes less than it does elsewhere.
struct TransmissionZeros {
  /// The finite s (z) at which [sI - A, -B; C, D] has less rank than elsewhere: the zeros of the
  /// transfer matrix, and the modes that no input moves or no output shows.
  Eigen::VectorXcd zeros;
  Eigen::Index normal_rank = 0;  ///< Of the transfer matrix at almost every s; below min(m, p) of a
                                 ///< degenerate one.
};

/// The invariant zeros of a system of any shape, those of a minimal one its transmission zeros.
///
/// States that the outputs' being zero determines are taken out by orthogonal transformations until
/// D has full rank, which each step reveals by singular values; what is left is a regular pencil
/// whose eigenvalues are the zeros (QZ). A degenerate system, whose transfer matrix has a rank
/// below its size, keeps those at which the rank falls further.
/// @param tolerance  Below which singular values are zero, relative to [A B; C D] in balanced
/// units; 0 takes 100 n ε.
/// @errors ArgumentError for the system and a tolerance that is not in [0, 1);
/// SystemError::no_convergence. Cost: O((n + m)(n + p)n), allocates.
/// Source: Emami-Naeini and Van Dooren, "Computation of zeros of linear multivariable systems",
/// Automatica 18 (1982); MacFarlane and Karcanias, Int. J. Control 24 (1976), for the definition.
[[nodiscard]] Expected<TransmissionZeros> transmission_zeros(const ContinuousSystem<>& system,
                                                             double tolerance = 0.0);
[[nodiscard]] Expected<TransmissionZeros> transmission_zeros(const DiscreteSystem<>& system,
                                                             double tolerance = 0.0);

}  // namespace flyball
