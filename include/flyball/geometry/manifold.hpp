#pragma once

#include <concepts>
#include <type_traits>

#include <Eigen/Core>

/// What filters, smoothers and fits ask of a state: points x, and differences between them, which
/// are vectors.
///
///     x ⊕ δ = x Exp(δ),    a ⊖ b = Log(b⁻¹ a),    b ⊕ (a ⊖ b) = a
///
/// δ is in the frame of x (the right, or local, perturbation). For vectors they are + and -. A type
/// of its own (a rotation, a pose, a bundle of them) is a manifold if it has
///
/// - `tangent_size`, the number of entries of a difference, a constant,
/// - `Scalar`, and
/// - `x.plus(δ)` and `a.minus(b)`.
///
/// Source: Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018),
/// equations (25) and (26); Hertzberg et al., "Integrating generic sensor fusion algorithms with
/// sound state representations through encapsulation of manifolds" (2013).
namespace flyball {

namespace detail {

template <class X>
concept EigenVector = std::is_base_of_v<Eigen::MatrixBase<X>, X> && X::ColsAtCompileTime == 1;

template <class X>
concept HasPlusAndMinus = requires(const X& a, const X& b) {
  typename X::Scalar;
  { X::tangent_size } -> std::convertible_to<int>;
  a.plus(a.minus(b));
};

template <class X>
[[nodiscard]] consteval int size_of_tangent() {
  if constexpr (EigenVector<X>) {
    return X::RowsAtCompileTime;
  } else {
    return X::tangent_size;
  }
}

}  // namespace detail

/// A type whose values can be moved by vectors: Eigen vectors, and what has `plus` and `minus`.
template <class X>
concept Manifold = detail::EigenVector<X> || detail::HasPlusAndMinus<X>;

/// The entries of a difference of two X; Eigen::Dynamic where only the value knows.
template <Manifold X>
inline constexpr int tangent_size = detail::size_of_tangent<X>();

/// A difference of two X.
template <Manifold X>
using TangentOf = Eigen::Matrix<typename X::Scalar, tangent_size<X>, 1>;

/// The matrix of a linear map between differences of X, such as a covariance.
template <Manifold X>
using TangentMatrix = Eigen::Matrix<typename X::Scalar, tangent_size<X>, tangent_size<X>>;

/// x ⊕ δ. @param delta  tangent_size x 1.
template <Manifold X, class Tangent>
[[nodiscard]] X plus(const X& x, const Eigen::MatrixBase<Tangent>& delta) {
  if constexpr (detail::EigenVector<X>) {
    return x + delta;
  } else {
    return x.plus(delta);
  }
}

/// a ⊖ b, tangent_size x 1: what `plus` takes from b to a.
template <Manifold X>
[[nodiscard]] TangentOf<X> minus(const X& a, const X& b) {
  if constexpr (detail::EigenVector<X>) {
    return a - b;
  } else {
    return a.minus(b);
  }
}

}  // namespace flyball
