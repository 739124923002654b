#pragma once

#include <Eigen/Core>

#include <flyball/geometry/manifold.hpp>

/// What SO(2), SE(2), SO(3), SE(3) and bundles of them have in common.
namespace flyball {

/// What follows from a group's product, inverse, exponential, logarithm and left Jacobian; the base
/// of each group G, whose differences have N entries. Everything is noexcept and allocation-free,
/// over any scalar: double, float, dual numbers.
///
/// A perturbation is in the frame of the element (right, or local): x ⊕ δ = x Exp(δ). The right
/// Jacobian is that of the exponential in this sense, Exp(τ + δ) ≈ Exp(τ) Exp(Jr(τ) δ), the left
/// one in the other frame, Exp(τ + δ) ≈ Exp(Jl(τ) δ) Exp(τ). So
///
///     ∂(x ⊕ δ)/∂δ = Jr(δ),  ∂(a ⊖ b)/∂a = Jr⁻¹(a ⊖ b),  ∂(a ⊖ b)/∂b = -Jl⁻¹(a ⊖ b).
///
/// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018),
/// equations (25), (26), (67) to (76), (82), (83); Barfoot, "State Estimation for Robotics" (2017),
/// section 7.1.
template <class G, class ScalarType, int N>
class LieGroup {
 public:
  using Scalar = ScalarType;
  static constexpr int tangent_size = N;
  using Tangent = Eigen::Matrix<Scalar, N, 1>;
  using Jacobian = Eigen::Matrix<Scalar, N, N>;

  /// x⁻¹ y: y as seen from this x.
  [[nodiscard]] G between(const G& other) const noexcept { return self().inverse() * other; }
  /// x ⊕ δ = x Exp(δ).
  [[nodiscard]] G plus(const Tangent& delta) const noexcept { return self() * G::exp(delta); }
  /// x ⊖ y = Log(y⁻¹ x), what `plus` takes from y to this x.
  [[nodiscard]] Tangent minus(const G& other) const noexcept { return other.between(self()).log(); }
  /// The point at t of the shortest constant motion to another: x ⊕ t (y ⊖ x); x at 0, y at 1.
  [[nodiscard]] G interpolate(const G& other, const Scalar& t) const noexcept {
    return plus(other.minus(self()) * t);
  }

  /// Jr(τ) = Jl(-τ).
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& tau) noexcept {
    return G::left_jacobian(-tau);
  }
  /// Jr⁻¹(τ) = Jl⁻¹(-τ).
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& tau) noexcept {
    return G::left_jacobian_inverse(-tau);
  }

 private:
  [[nodiscard]] const G& self() const noexcept { return static_cast<const G&>(*this); }
};

/// An element of a group with the covariance of its error ξ, x = mean Exp(ξ).
template <class G>
struct Uncertain {
  G mean;
  typename G::Jacobian covariance;  ///< tangent_size x tangent_size
};

/// x y of independent x and y: Σ = Ad(ȳ⁻¹) Σx Ad(ȳ⁻¹)ᵀ + Σy, to first order (exact for SO(2)).
/// Source: Sola et al. (2018), equations (54), (55), (68).
template <class G>
[[nodiscard]] Uncertain<G> compose(const Uncertain<G>& x, const Uncertain<G>& y) noexcept {
  const typename G::Jacobian Ad = y.mean.inverse().adjoint();
  return {x.mean * y.mean, Ad * x.covariance * Ad.transpose() + y.covariance};
}

/// x⁻¹: Σ = Ad(x̄) Σx Ad(x̄)ᵀ, exact. Source: Sola et al. (2018), equation (62).
template <class G>
[[nodiscard]] Uncertain<G> inverse(const Uncertain<G>& x) noexcept {
  const typename G::Jacobian Ad = x.mean.adjoint();
  return {x.mean.inverse(), Ad * x.covariance * Ad.transpose()};
}

/// x⁻¹ y of independent x and y, as `compose` of `inverse(x)` and y.
template <class G>
[[nodiscard]] Uncertain<G> between(const Uncertain<G>& x, const Uncertain<G>& y) noexcept {
  return compose(inverse(x), y);
}

/// Jr(τ) of any manifold; of vectors the identity.
template <Manifold X>
[[nodiscard]] TangentMatrix<X> right_jacobian(const TangentOf<X>& tau) noexcept {
  if constexpr (detail::EigenVector<X>) {
    return TangentMatrix<X>::Identity(tau.size(), tau.size());
  } else {
    return X::right_jacobian(tau);
  }
}

/// Jr⁻¹(τ) of any manifold; of vectors the identity.
template <Manifold X>
[[nodiscard]] TangentMatrix<X> right_jacobian_inverse(const TangentOf<X>& tau) noexcept {
  if constexpr (detail::EigenVector<X>) {
    return TangentMatrix<X>::Identity(tau.size(), tau.size());
  } else {
    return X::right_jacobian_inverse(tau);
  }
}

}  // namespace flyball
