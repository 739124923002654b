#pragma once

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// The same input-output behaviour in the states x' = T⁻¹x: T⁻¹AT, T⁻¹B, CT, D.
/// @param T  n x n, invertible.
/// @errors ArgumentError for the system, shape and entries of T; SystemError::singular_transform
///         with the reciprocal condition of T. Cost: O(n³), allocates.
[[nodiscard]] Expected<ContinuousSystem<>> similarity_transform(const ContinuousSystem<>& system,
                                                                const MatrixRef& T);
[[nodiscard]] Expected<DiscreteSystem<>> similarity_transform(const DiscreteSystem<>& system,
                                                              const MatrixRef& T);

/// Companion form of a system with one input: ones above the diagonal of A, the characteristic
/// polynomial's coefficients -a₀ … -aₙ₋₁ in its last row, B = [0 … 0 1]ᵀ, and C the numerators'
/// coefficients.
/// @errors ArgumentError for the system, wrong_shape for more than one input;
///         SystemError::not_controllable with the reciprocal condition of the change of states,
///         where the form does not exist or a double cannot hold it.
/// Cost: O(n³), allocates. Its coefficients grow and cancel with n: for reading, not for computing.
/// Source: Kailath, "Linear Systems", section 2.1; the transfer functions of the book's appendix E.
[[nodiscard]] Expected<ContinuousSystem<>> controllable_canonical_form(
    const ContinuousSystem<>& system);
[[nodiscard]] Expected<DiscreteSystem<>> controllable_canonical_form(
    const DiscreteSystem<>& system);

/// Its transpose, for one output: the coefficients in A's last column, C = [0 … 0 1].
/// @errors As above, SystemError::not_observable.
[[nodiscard]] Expected<ContinuousSystem<>> observable_canonical_form(
    const ContinuousSystem<>& system);
[[nodiscard]] Expected<DiscreteSystem<>> observable_canonical_form(const DiscreteSystem<>& system);

/// A system in which each state is as easy to reach as it is to see: both Gramians are diag(σ).
template <class System>
struct BalancedRealization {
  System system;              ///< Of `order` states, the strongest first.
  Eigen::VectorXd hankel;     ///< σ, all n of the given system, decreasing.
  Eigen::MatrixXd T;          ///< n x order: x = T x'.
  Eigen::MatrixXd T_inverse;  ///< order x n: x' = T_inverse x; T_inverse T = I.
  double error_bound = 0.0;   ///< ‖G - G_r‖∞ <= 2 Σ of the σ left out.
};

/// The balanced realisation of a stable system, by the square-root method.
/// @errors ArgumentError for the system; SystemError::not_stable with the pole; not_controllable
///         with the smallest σ if a state is not reached or not seen (see `balanced_truncation`,
///         `minimal_realization`); no_convergence.
/// Cost: O(n³ log κ), allocates.
/// Source: Moore, IEEE Trans. Automatic Control 26 (1981); Laub, Heath, Paige and Ward, same, 32
/// (1987).
[[nodiscard]] Expected<BalancedRealization<ContinuousSystem<>>> balanced_realization(
    const ContinuousSystem<>& system);
[[nodiscard]] Expected<BalancedRealization<DiscreteSystem<>>> balanced_realization(
    const DiscreteSystem<>& system);

/// The `order` strongest states of the balanced realisation: stable, and within `error_bound` of
/// the system at every frequency. The gain at rest is not kept exactly.
/// @param order  From 1 to the number of states with σ above rounding.
/// @errors As above; ArgumentError::out_of_range for the order, with σ of the first state too weak.
/// Source: Enns, IEEE Conf. Decision and Control (1984); Glover, Int. J. Control 39 (1984).
[[nodiscard]] Expected<BalancedRealization<ContinuousSystem<>>> balanced_truncation(
    const ContinuousSystem<>& system, Eigen::Index order);
[[nodiscard]] Expected<BalancedRealization<DiscreteSystem<>>> balanced_truncation(
    const DiscreteSystem<>& system, Eigen::Index order);

/// What of a system takes part in its transfer function.
template <class System>
struct MinimalRealization {
  System system;               ///< The reached and seen part; no states if none is.
  Eigen::Index unreached = 0;  ///< States that no input moves, left out.
  Eigen::Index unseen = 0;     ///< States that are reached and that no output shows, left out.
  Eigen::MatrixXd T;           ///< n x order: x = T x' for motions from rest, but for unseen ones.
};

/// The part of a system that is both reached and seen, by orthogonal staircases on balanced data
/// and the test of each mode that they leave: Kalman's decomposition. A minimal system is returned
/// as it is.
/// @param tolerance  What is left out would be cut off by changes of A, B or C of this size
/// relative to each of them, in balanced units; 0 takes 100 n ε. A mode of
/// `analyze_controllability` whose distance is above it stays, one that hangs on less does not.
/// @errors ArgumentError for the system and a tolerance that is not in [0, 1).
/// Cost: O(n³m), and as much for each mode that only its own test finds; allocates.
/// Source: Kalman, SIAM J. Control 1 (1963); Van Dooren, IEEE Trans.
/// Automatic Control 26 (1981).
[[nodiscard]] Expected<MinimalRealization<ContinuousSystem<>>> minimal_realization(
    const ContinuousSystem<>& system, double tolerance = 0.0);
[[nodiscard]] Expected<MinimalRealization<DiscreteSystem<>>> minimal_realization(
    const DiscreteSystem<>& system, double tolerance = 0.0);

}  // namespace flyball
