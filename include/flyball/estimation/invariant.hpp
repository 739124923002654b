#pragma once

#include <flyball/estimation/estimate.hpp>

namespace flyball {

/// An element of a group whose error is in the fixed frame, x = Exp(e) x_hat: the state of the
/// right invariant filter. Its differences do not change as the body moves (F = I), and a known
/// point seen from the body tells of them what does not depend on x_hat; an Estimate of the group
/// itself, whose error is in the body's frame, is the left invariant filter.
///
/// Source: Barrau and Bonnabel, "The invariant extended Kalman filter as a stable observer", IEEE
/// Trans. Automatic Control 62 (2017).
template <class G>
struct RightInvariant {
  using Scalar = typename G::Scalar;
  static constexpr int tangent_size = G::tangent_size;
  using Tangent = typename G::Tangent;
  using Jacobian = typename G::Jacobian;

  G value;

  /// Exp(δ) x
  [[nodiscard]] RightInvariant plus(const Tangent& delta) const noexcept {
    return {G::exp(delta) * value};
  }
  /// Log(x y⁻¹)
  [[nodiscard]] Tangent minus(const RightInvariant& other) const noexcept {
    return (value * other.value.inverse()).log();
  }
  template <class Other>
  [[nodiscard]] auto cast() const noexcept {
    using Cast = decltype(value.template cast<Other>());
    return RightInvariant<Cast>{value.template cast<Other>()};
  }
  [[nodiscard]] auto matrix() const noexcept { return value.matrix(); }
  /// ∂(x ⊕ δ)/∂δ in the frame of x ⊕ δ.
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& delta) noexcept {
    return G::left_jacobian(delta);
  }
};

/// x <- x Exp(τ) by odometry, the error in the body's frame: F = Ad(Exp(-τ)), Q = Jr(τ) W Jr(τ)ᵀ.
/// @param twist  τ, the way since the last call, in the body's frame. @param W  Its covariance.
/// @return  As Estimate::predict. Source: Sola, Deray, Atchuthan (2018), section V.A.
template <class G, class Form>
bool predict_by_odometry(Estimate<G, Form>& estimate, const TangentOf<G>& twist,
                         const TangentMatrix<G>& W) noexcept {
  const G step = G::exp(twist);
  const TangentMatrix<G> J = G::right_jacobian(twist);
  const TangentMatrix<G> JW = J.lazyProduct(W);
  return estimate.predict(estimate.x_hat() * step, step.inverse().adjoint(),
                          typename Form::Noise(TangentMatrix<G>(JW.lazyProduct(J.transpose()))));
}
/// The same with the error in the fixed frame: F = I, Q = Ad(x) Jl(τ) W (Ad(x) Jl(τ))ᵀ.
template <class G, class Form>
bool predict_by_odometry(Estimate<RightInvariant<G>, Form>& estimate, const TangentOf<G>& twist,
                         const TangentMatrix<G>& W) noexcept {
  const G& x = estimate.x_hat().value;
  const TangentMatrix<G> J = x.adjoint().lazyProduct(G::left_jacobian(twist));
  const TangentMatrix<G> JW = J.lazyProduct(W);
  return estimate.predict({x * G::exp(twist)}, TangentMatrix<G>::Identity(),
                          typename Form::Noise(TangentMatrix<G>(JW.lazyProduct(J.transpose()))));
}

}  // namespace flyball
