#pragma once

#include <Eigen/Core>

/// Polynomials on a step by their values at Radau's points, on [-1, 1] with the end 1 among them.
namespace flyball::classical::detail {

struct Collocation {
  Eigen::VectorXd nodes;      ///< p, increasing; the last is 1.
  Eigen::MatrixXd integrals;  ///< p x p: ∫ from -1 to node i of the j-th Lagrange polynomial.
  Eigen::MatrixXd modes;      ///< p x p: Legendre coefficients of values at the nodes.
};

/// Of p points. Source: Hairer and Wanner, "Solving Ordinary Differential Equations II", section
/// IV.5 (Radau IIA). Cost: O(p³).
[[nodiscard]] Collocation radau_collocation(int points);

/// P₀ … P_{count-1} at x.
[[nodiscard]] Eigen::VectorXd legendre(int count, double x);

/// Σ c_k P_k(x), by Clenshaw's recurrence. Cost: O(p), without allocation.
[[nodiscard]] double legendre_sum(const Eigen::Ref<const Eigen::VectorXd>& modes, double x);

/// The coefficients of the derivative of Σ c_k P_k.
[[nodiscard]] Eigen::VectorXd legendre_derivative(const Eigen::VectorXd& modes);

}  // namespace flyball::classical::detail
