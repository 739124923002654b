#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/math/derivatives/nested_dual.hpp>
#include <flyball/systems/model.hpp>

/// The manipulator equations of any mechanism from its energies.
namespace flyball::mechanisms {

/// What a LagrangianModel is made of, a type with
///
/// - `static constexpr int coordinates()`, how many numbers q describe where it is,
/// - `kinetic_energy(q, v)` and `potential_energy(q)`, J, over generic scalars: Eigen vectors in, a
///   number out; the kinetic energy is a quadratic form of v = dq/dt,
///
/// and, where it has them,
///
/// - `input_matrix()`, or `input_matrix(q)` over a generic scalar: B, n x m, which turns inputs
///   into generalised forces; without it there is an input for each coordinate, its force,
/// - `dissipation(q, v)`, Rayleigh's function, W: ½ vᵀDv for viscous friction D,
/// - `parameters()`, an Eigen vector of fixed size: then all of these but the input matrix take one
///   argument more, the parameters p over a generic scalar,
/// - `description()`, a ModelDescription.
///
/// Such as a pendulum of 1 kg and 1 m:
/// ```
/// struct Bob {
///   static constexpr int coordinates() { return 1; }
///   template <class Q, class V>
///   auto kinetic_energy(const Q&, const V& v) const { return 0.5 * v(0) * v(0); }
///   template <class Q>
///   auto potential_energy(const Q& q) const { return -9.81 * cos(q(0)); }
/// };
/// ```
template <class E>
concept MechanicalEnergies = requires { std::integral_constant<int, E::coordinates()>{}; };

namespace detail {

template <class E>
inline constexpr bool has_parameters = requires(const E& energies) { energies.parameters(); };

/// The parameters of energies that have none.
struct NoParameters {
  using Scalar = double;
};

/// Solves M x = b for a symmetric positive definite M over any scalar: M = L D Lᵀ.
template <class S, int N>
[[nodiscard]] Eigen::Vector<S, N> solve_definite(Eigen::Matrix<S, N, N> M, Eigen::Vector<S, N> b) {
  for (int j = 0; j < N; ++j) {
    for (int i = j + 1; i < N; ++i) {
      const S factor = M(i, j) / M(j, j);
      for (int k = j + 1; k < N; ++k) {
        M(i, k) = M(i, k) - factor * M(j, k);
      }
      b(i) = b(i) - factor * b(j);
    }
  }
  for (int i = N - 1; i >= 0; --i) {
    for (int k = i + 1; k < N; ++k) {
      b(i) = b(i) - M(i, k) * b(k);
    }
    b(i) = b(i) / M(i, i);
  }
  return b;
}

/// What `lagrangian_model` looks at in one configuration.
struct MechanicsSample {
  Eigen::VectorXd q, v;
  double energy = 0.0;          ///< T(q, v)
  double doubled_energy = 0.0;  ///< T(q, 2 v)
  double potential = 0.0;       ///< V(q)
  Eigen::MatrixXd M;
  Eigen::VectorXd forces;  ///< C v + G + ∂W/∂v
};
[[nodiscard]] Expected<void> check_mechanics(const MechanicsSample& sample);

}  // namespace detail

/// The equations of motion of a mechanism, from its energies by automatic differentiation:
///
///   M(q) dv/dt + C(q, v) v + G(q) = B u - ∂W/∂v,  dq/dt = v,
///   M = ∂²T/∂v∂v,  G = ∂V/∂q,
///   C_ij = ½ Σ_k (∂M_ij/∂q_k + ∂M_ik/∂q_j - ∂M_jk/∂q_i) v_k,
///
/// Lagrange's equations of L = T - V; with these Christoffel symbols dM/dt - 2 C is skew. Texts
/// that write the gravity's torque on the right call it τ_g = -G. x = [q; v], u as the energies'
/// input matrix says; it is a model like any other: it simulates, linearises with exact derivatives
/// and, where the energies have parameters, is identified.
///
/// Cost: the derivative one call of T with n + 1 times 2 n + 1 numbers for each, one of V; no
/// allocation. A pendulum by hand is some ten times faster: where a model is called a billion
/// times, hold a closed form to this one in a test. Source: book, chapter 13; Tedrake,
/// "Underactuated Robotics", appendix on multi-body dynamics; Murray, Li and Sastry, "A
/// Mathematical Introduction to Robotic Manipulation", section 4.3.
template <MechanicalEnergies E>
class LagrangianModel {
 public:
  /// n.
  static constexpr int coordinates() { return E::coordinates(); }
  /// The size of x.
  static constexpr int states() { return 2 * n; }
  /// The size of u.
  static constexpr int inputs() {
    if constexpr (requires(const E& e) { e.input_matrix(); }) {
      return decltype(std::declval<const E&>().input_matrix())::ColsAtCompileTime;
    } else if constexpr (requires(const E& e, const Eigen::Vector<double, n>& q) {
                           e.input_matrix(q);
                         }) {
      return decltype(std::declval<const E&>().input_matrix(
          std::declval<const Eigen::Vector<double, n>&>()))::ColsAtCompileTime;
    } else {
      return n;
    }
  }

  /// Unchecked; `lagrangian_model` checks.
  explicit LagrangianModel(E energies) : energies_(std::move(energies)) {}

  [[nodiscard]] const E& energies() const noexcept { return energies_; }
  /// The energies' parameters.
  [[nodiscard]] auto parameters() const
    requires detail::has_parameters<E>
  {
    return energies_.parameters();
  }
  [[nodiscard]] ModelDescription description() const {
    if constexpr (requires { energies_.description(); }) {
      return energies_.description();
    } else {
      return {};
    }
  }

  /// dx/dt over a generic scalar. @param x  2 n x 1. @param u  m x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using S = ScalarOf<X, U, P>;
    const Vector<S> q = x.template head<n>().template cast<S>();
    const Vector<S> v = x.template tail<n>().template cast<S>();
    Vector<S> forces;
    const Matrix<S> M = mass_and_bias(q, v, p, forces);
    const auto B = input_matrix(q);
    for (int i = 0; i < n; ++i) {
      forces(i) = -forces(i);
      for (int j = 0; j < inputs(); ++j) {
        forces(i) = forces(i) + B(i, j) * u(j);
      }
    }
    Eigen::Vector<S, 2 * n> dxdt;
    dxdt << v, detail::solve_definite<S, n>(M, forces);
    return dxdt;
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    if constexpr (detail::has_parameters<E>) {
      return derivative(x, u, energies_.parameters());
    } else {
      return derivative(x, u, detail::NoParameters{});
    }
  }

  /// M(q), n x n, over a generic scalar. @param q  n x 1.
  template <class Q>
  [[nodiscard]] auto mass_matrix(const Q& q) const {
    using S = typename Q::Scalar;
    return mass_matrix_with(Vector<S>(q), own_parameters());
  }
  /// C(q, v), n x n. @param q, v  n x 1.
  [[nodiscard]] Eigen::Matrix<double, E::coordinates(), E::coordinates()> coriolis_matrix(
      const Eigen::Vector<double, E::coordinates()>& q,
      const Eigen::Vector<double, E::coordinates()>& v) const {
    using D = NestedDual<double, n>;
    const Matrix<D> M = mass_matrix(variables<double>(q));
    const auto slope = [&](int i, int j, int k) {
      return M(i, j).gradient[static_cast<std::size_t>(k)];
    };
    Matrix<double> C = Matrix<double>::Zero();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k < n; ++k) {
          C(i, j) += 0.5 * (slope(i, j, k) + slope(i, k, j) - slope(j, k, i)) * v(k);
        }
      }
    }
    return C;
  }
  /// G(q) = ∂V/∂q, n x 1, over a generic scalar. @param q  n x 1.
  template <class Q>
  [[nodiscard]] auto gravity_vector(const Q& q) const {
    using S = typename Q::Scalar;
    return slope_of_potential(Vector<S>(q), own_parameters());
  }
  /// B, n x m. @param q  n x 1.
  template <class Q>
  [[nodiscard]] auto input_matrix([[maybe_unused]] const Q& q) const {
    if constexpr (requires { energies_.input_matrix(); }) {
      return energies_.input_matrix();
    } else if constexpr (requires { energies_.input_matrix(q); }) {
      return energies_.input_matrix(q);
    } else {
      return Matrix<double>(Matrix<double>::Identity());
    }
  }
  /// The generalised forces that accelerate it so, M a + C v + G + ∂W/∂v: inverse dynamics.
  /// @param q, v, a  n x 1, over a generic scalar.
  template <class Q, class V, class A>
  [[nodiscard]] auto forces(const Q& q, const V& v, const A& a) const {
    using S = ScalarOf<Q, V, A>;
    Vector<S> bias;
    const Matrix<S> M = mass_and_bias(Vector<S>(q.template cast<S>()),
                                      Vector<S>(v.template cast<S>()), own_parameters(), bias);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        bias(i) = bias(i) + M(i, j) * a(j);
      }
    }
    return bias;
  }
  /// T(q, v) + V(q), J, over a generic scalar. @param x  [q; v], 2 n x 1.
  template <class X>
  [[nodiscard]] auto energy(const X& x) const {
    const auto q = x.template head<n>().eval();
    const auto v = x.template tail<n>().eval();
    using S = typename X::Scalar;
    return S(kinetic(q, v, own_parameters()) + potential(q, own_parameters()));
  }

 private:
  static constexpr int n = E::coordinates();
  template <class S>
  using Vector = Eigen::Vector<S, n>;
  template <class S>
  using Matrix = Eigen::Matrix<S, n, n>;

  [[nodiscard]] auto own_parameters() const {
    if constexpr (detail::has_parameters<E>) {
      return energies_.parameters();
    } else {
      return detail::NoParameters{};
    }
  }
  template <class Q, class V, class P>
  [[nodiscard]] auto kinetic(const Q& q, const V& v, const P& p) const {
    if constexpr (detail::has_parameters<E>) {
      return energies_.kinetic_energy(q, v, p);
    } else {
      return energies_.kinetic_energy(q, v);
    }
  }
  template <class Q, class P>
  [[nodiscard]] auto potential(const Q& q, const P& p) const {
    if constexpr (detail::has_parameters<E>) {
      return energies_.potential_energy(q, p);
    } else {
      return energies_.potential_energy(q);
    }
  }
  template <class Q, class V, class P>
  [[nodiscard]] auto friction(const Q& q, const V& v, const P& p) const {
    if constexpr (detail::has_parameters<E>) {
      return energies_.dissipation(q, v, p);
    } else {
      return energies_.dissipation(q, v);
    }
  }
  static constexpr bool has_dissipation = [] {
    if constexpr (detail::has_parameters<E>) {
      return requires(const E& e, const Vector<double>& q) { e.dissipation(q, q, e.parameters()); };
    } else {
      return requires(const E& e, const Vector<double>& q) { e.dissipation(q, q); };
    }
  }();

  template <class S>
  [[nodiscard]] static Vector<NestedDual<S, n>> variables(const Vector<S>& q) {
    Vector<NestedDual<S, n>> along;
    for (int i = 0; i < n; ++i) {
      along(i) = NestedDual<S, n>::variable(q(i), i);
    }
    return along;
  }

  template <class S, class P>
  [[nodiscard]] Vector<S> slope_of_potential(const Vector<S>& q, const P& p) const {
    const NestedDual<S, n> V = potential(variables<S>(q), p);
    Vector<S> G;
    for (int i = 0; i < n; ++i) {
      G(i) = V.gradient[static_cast<std::size_t>(i)];
    }
    return G;
  }

  template <class S, class P>
  [[nodiscard]] Matrix<S> mass_matrix_with(const Vector<S>& q, const P& p) const {
    using D = NestedDual<S, n>;
    using DD = NestedDual<D, n>;
    Vector<DD> at;
    Vector<DD> v;
    for (int i = 0; i < n; ++i) {
      at(i) = DD(D(q(i)));
      v(i) = DD::variable(D::variable(S(0.0), i), i);
    }
    const DD T = kinetic(at, v, p);
    Matrix<S> M;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        M(i, j) = T.gradient[static_cast<std::size_t>(i)].gradient[static_cast<std::size_t>(j)];
      }
    }
    return M;
  }

  /// M, and C v + G + ∂W/∂v = ∂²T/∂v∂q v - ∂T/∂q + ∂V/∂q + ∂W/∂v.
  template <class S, class P>
  [[nodiscard]] Matrix<S> mass_and_bias(const Vector<S>& q, const Vector<S>& v, const P& p,
                                        Vector<S>& bias) const {
    using D = NestedDual<S, 2 * n>;  // by q, then by v
    using DD = NestedDual<D, n>;     // by v
    Vector<DD> at;
    Vector<DD> rate;
    for (int i = 0; i < n; ++i) {
      at(i) = DD(D::variable(q(i), i));
      rate(i) = DD::variable(D::variable(v(i), n + i), i);
    }
    const DD T = kinetic(at, rate, p);
    bias = slope_of_potential<S>(q, p);
    Matrix<S> M;
    for (int i = 0; i < n; ++i) {
      const D& momentum = T.gradient[static_cast<std::size_t>(i)];
      bias(i) = bias(i) - T.value.gradient[static_cast<std::size_t>(i)];
      for (int j = 0; j < n; ++j) {
        bias(i) = bias(i) + momentum.gradient[static_cast<std::size_t>(j)] * v(j);
        M(i, j) = momentum.gradient[static_cast<std::size_t>(n + j)];
      }
    }
    if constexpr (has_dissipation) {
      Vector<NestedDual<S, n>> fixed;
      for (int i = 0; i < n; ++i) {
        fixed(i) = NestedDual<S, n>(q(i));
      }
      const NestedDual<S, n> W = friction(fixed, variables<S>(v), p);
      for (int i = 0; i < n; ++i) {
        bias(i) = bias(i) + W.gradient[static_cast<std::size_t>(i)];
      }
    }
    return M;
  }

  E energies_;
};

/// The model of energies, which are looked at in `configurations` seeded ones: q within ± 3, v
/// within ± 2, in their units.
///
/// @param energies  As MechanicalEnergies says.
/// @errors ArgumentError::not_finite for an energy that is not, there; not_positive for a mass
/// matrix
///         that is not positive definite, naming the coordinate that has no inertia (a massless
///         link); out_of_range for a kinetic energy that is no quadratic form of v.
template <MechanicalEnergies E>
[[nodiscard]] Expected<LagrangianModel<E>> lagrangian_model(E energies, int configurations = 16) {
  LagrangianModel<E> model(std::move(energies));
  constexpr int n = E::coordinates();
  constexpr double reach = 3.0;
  constexpr double rate = 2.0;
  Random random(n);
  for (int k = 0; k < configurations; ++k) {
    Eigen::Vector<double, 2 * n> x;
    for (int i = 0; i < n; ++i) {
      x(i) = k == 0 ? 0.0 : random.uniform(-reach, reach);
      x(n + i) = random.uniform(-rate, rate);
    }
    const Eigen::Vector<double, n> q = x.template head<n>();
    const Eigen::Vector<double, n> v = x.template tail<n>();
    const Eigen::Vector<double, n> zero = Eigen::Vector<double, n>::Zero();
    Eigen::Vector<double, 2 * n> at = x;
    const double moving = model.energy(at);
    at.template tail<n>() = 2.0 * v;
    const double faster = model.energy(at);
    at.template tail<n>().setZero();
    const double still = model.energy(at);
    detail::MechanicsSample sample{.q = q,
                                   .v = v,
                                   .energy = moving - still,
                                   .doubled_energy = faster - still,
                                   .potential = still,
                                   .M = model.mass_matrix(q),
                                   .forces = model.forces(q, v, zero)};
    if (auto fine = detail::check_mechanics(sample); !fine) {
      return tl::unexpected(std::move(fine).error());
    }
  }
  return model;
}

}  // namespace flyball::mechanisms
