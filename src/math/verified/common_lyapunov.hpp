#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace flyball::detail {

/// What a search for a common Lyapunov function may cost, and did.
struct LyapunovSearch {
  int most_steps = 60;
  int most_vain = 8;  ///< Steps after the first T to which `good` says no.
  int steps = 0;
  Eigen::MatrixXd last;  ///< The T with which it ended, good or not; empty where it had none.
};

/// T, upper triangular, with ‖T M_v x‖ < ‖T x‖ for all M_v, as far as floating point can tell: the
/// last `fixed` coordinates are left as they are, T = [L 0; 0 I], which makes M a gain below one
/// from the last inputs to the last outputs with any state's dynamics (the bounded real lemma).
///
/// The linear matrix inequalities P̂ - M_vᵀ P̂ M_v >= t I, P̂ = diag(P, I), P between 0.05 I and 100
/// I, with the largest t, by Newton's method on their barrier as its weight falls; over early as
/// soon as `good` is content with T, or where the barrier's gap shows that no P can be had.
///
/// @param M  Square, of one size, in coordinates in which P = I is not far off.
/// @param good  Asked where t > 0; a search ends with its yes.
/// @return The T to which `good` said yes.
/// Cost: a step O(vertices n⁴ / 2 + n⁶ / 24).
/// Source: Boyd, El Ghaoui, Feron and Balakrishnan, "Linear Matrix Inequalities in System and
/// Control Theory", sections 2.3–2.4, 5.1 and 7.2.
[[nodiscard]] std::optional<Eigen::MatrixXd> common_lyapunov(
    const std::vector<Eigen::MatrixXd>& M, Eigen::Index fixed, LyapunovSearch& search,
    const std::function<bool(const Eigen::MatrixXd& T)>& good);

/// A T for one stable matrix, from AᵀPA - σ²P = -I in balanced coordinates with σ between the
/// spectral radius and one; nothing where it is not stable.
[[nodiscard]] std::optional<Eigen::MatrixXd> lyapunov_factor(const Eigen::MatrixXd& A);

}  // namespace flyball::detail
