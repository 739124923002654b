#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include <Eigen/Core>

#include <flyball/geometry/lie_group.hpp>

namespace flyball {

namespace detail {

/// The sum of the tangent sizes of the first `count` parts.
template <class... Parts>
[[nodiscard]] consteval int tangent_offset(std::size_t count) {
  const int sizes[] = {tangent_size<Parts>...};
  int sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += sizes[i];
  }
  return sum;
}

template <class First, class...>
struct ScalarOfFirst {
  using type = typename First::Scalar;
};

template <class Other, class Part>
[[nodiscard]] auto cast_part(const Part& part) noexcept {
  if constexpr (EigenVector<Part>) {
    return Eigen::Matrix<Other, tangent_size<Part>, 1>(part.template cast<Other>());
  } else {
    return part.template cast<Other>();
  }
}

}  // namespace detail

/// Several states as one: a pose and the biases of its sensors, say. It is the product of its
/// parts, groups or vectors (for which the product is +), each with its own operations; tangents
/// stand below each other in the parts' order. Sizes are fixed. Source: Sola, Deray, Atchuthan, "A
/// micro Lie theory for state estimation in robotics" (2018), section IV.
template <Manifold... Parts>
class Bundle : public LieGroup<Bundle<Parts...>, typename detail::ScalarOfFirst<Parts...>::type,
                               (tangent_size<Parts> + ...)> {
  static_assert(((tangent_size<Parts> != Eigen::Dynamic) && ...), "a bundle's sizes are fixed");
  using Base = LieGroup<Bundle<Parts...>, typename detail::ScalarOfFirst<Parts...>::type,
                        (tangent_size<Parts> + ...)>;
  static constexpr auto indices = std::index_sequence_for<Parts...>{};

 public:
  using typename Base::Jacobian;
  using typename Base::Scalar;
  using typename Base::Tangent;
  static_assert((std::is_same_v<typename Parts::Scalar, Scalar> && ...),
                "one scalar for all parts");

  template <std::size_t I>
  using Part = std::tuple_element_t<I, std::tuple<Parts...>>;
  /// Where the tangent of a part begins.
  template <std::size_t I>
  static constexpr int offset = detail::tangent_offset<Parts...>(I);

  /// The identity.
  Bundle() noexcept : parts_(identity_of<Parts>()...) {}
  explicit Bundle(const Parts&... parts) noexcept : parts_(parts...) {}
  [[nodiscard]] static Bundle identity() noexcept { return {}; }  ///< 1.

  /// A part by its place.
  template <std::size_t I>
  [[nodiscard]] const Part<I>& get() const noexcept {
    return std::get<I>(parts_);
  }
  template <std::size_t I>
  [[nodiscard]] Part<I>& get() noexcept {
    return std::get<I>(parts_);
  }
  template <class Other>
  [[nodiscard]] auto cast() const noexcept {
    return std::apply(
        [](const Parts&... part) {
          return Bundle<decltype(detail::cast_part<Other>(part))...>(
              detail::cast_part<Other>(part)...);
        },
        parts_);
  }

  [[nodiscard]] Bundle operator*(const Bundle& other) const noexcept {
    return make([&]<std::size_t I>(Index<I>) -> Part<I> {
      if constexpr (is_vector<I>) {
        return get<I>() + other.template get<I>();
      } else {
        return get<I>() * other.template get<I>();
      }
    });
  }
  [[nodiscard]] Bundle inverse() const noexcept {
    return make([&]<std::size_t I>(Index<I>) -> Part<I> {
      if constexpr (is_vector<I>) {
        return -get<I>();
      } else {
        return get<I>().inverse();
      }
    });
  }
  /// Of each part; of vectors the vector.
  [[nodiscard]] static Bundle exp(const Tangent& tau) noexcept {
    return make([&]<std::size_t I>(Index<I>) -> Part<I> {
      if constexpr (is_vector<I>) {
        return segment<I>(tau);
      } else {
        return Part<I>::exp(segment<I>(tau));
      }
    });
  }
  [[nodiscard]] Tangent log() const noexcept {
    Tangent tau;
    each([&]<std::size_t I>(Index<I>) {
      if constexpr (is_vector<I>) {
        segment<I>(tau) = get<I>();
      } else {
        segment<I>(tau) = get<I>().log();
      }
    });
    return tau;
  }
  /// Block-diagonal, as the Jacobians.
  [[nodiscard]] Jacobian adjoint() const noexcept {
    return diagonal([&]<std::size_t I>(Index<I>) { return get<I>().adjoint(); });
  }
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& tau) noexcept {
    return diagonal(
        [&]<std::size_t I>(Index<I>) { return Part<I>::left_jacobian(segment<I>(tau)); });
  }
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& tau) noexcept {
    return diagonal(
        [&]<std::size_t I>(Index<I>) { return Part<I>::left_jacobian_inverse(segment<I>(tau)); });
  }

 private:
  template <std::size_t I>
  using Index = std::integral_constant<std::size_t, I>;
  template <std::size_t I>
  static constexpr bool is_vector = detail::EigenVector<Part<I>>;

  template <class P>
  [[nodiscard]] static P identity_of() noexcept {
    if constexpr (detail::EigenVector<P>) {
      return P::Zero();
    } else {
      return P();
    }
  }
  template <std::size_t I, class Vector>
  [[nodiscard]] static auto segment(Vector& tau) noexcept {
    return tau.template segment<tangent_size<Part<I>>>(offset<I>);
  }
  template <class F>
  static void each(F&& f) noexcept {
    [&]<std::size_t... I>(std::index_sequence<I...>) { (f(Index<I>{}), ...); }(indices);
  }
  template <class F>
  [[nodiscard]] static Bundle make(F&& f) noexcept {
    return [&]<std::size_t... I>(std::index_sequence<I...>) {
      return Bundle(f(Index<I>{})...);
    }(indices);
  }
  /// The blocks of the groups; those of vectors are the identity.
  template <class F>
  [[nodiscard]] static Jacobian diagonal(F&& block_of) noexcept {
    Jacobian J = Jacobian::Identity();
    each([&]<std::size_t I>(Index<I> index) {
      if constexpr (!is_vector<I>) {
        constexpr int n = tangent_size<Part<I>>;
        J.template block<n, n>(offset<I>, offset<I>) = block_of(index);
      }
    });
    return J;
  }

  std::tuple<Parts...> parts_;
};

}  // namespace flyball
