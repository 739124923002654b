#pragma once

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball {

/// A continuous linear time-invariant system, sized at compile time or dynamic.
///
/// dx/dt = A x + B u, y = C x + D u (Definition 6.3.1). It is a model (`model.hpp`).
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
struct ContinuousSystem {
  Eigen::Matrix<double, States, States> A;   ///< States x states, system matrix.
  Eigen::Matrix<double, States, Inputs> B;   ///< States x inputs, input matrix.
  Eigen::Matrix<double, Outputs, States> C;  ///< Outputs x states, output matrix.
  Eigen::Matrix<double, Outputs, Inputs> D;  ///< Outputs x inputs, feedthrough matrix.

  // clang-format off
  /// The size of x, a constant where the type fixes it.
  static constexpr int states() requires(States != Eigen::Dynamic) { return States; }
  Eigen::Index states() const requires(States == Eigen::Dynamic) { return A.rows(); }
  /// The size of u.
  static constexpr int inputs() requires(Inputs != Eigen::Dynamic) { return Inputs; }
  Eigen::Index inputs() const requires(Inputs == Eigen::Dynamic) { return B.cols(); }
  /// The size of y.
  static constexpr int outputs() requires(Outputs != Eigen::Dynamic) { return Outputs; }
  Eigen::Index outputs() const requires(Outputs == Eigen::Dynamic) { return C.rows(); }
  // clang-format on
  /// A x + B u, over a generic scalar. @param x  n x 1. @param u  m x 1.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return (A * x + B * u).eval();
  }
  /// C x + D u, over a generic scalar.
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U& u) const {
    return (C * x + D * u).eval();
  }
};

/// A discrete linear time-invariant system; it carries its sample period, and is a type of its own
/// so that a continuous model cannot be passed for it.
///
/// x_{k+1} = A x_k + B u_k, y_k = C x_k + D u_k (Definition 7.4.1).
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
struct DiscreteSystem {
  Eigen::Matrix<double, States, States> A;   ///< States x states, system matrix.
  Eigen::Matrix<double, States, Inputs> B;   ///< States x inputs, input matrix.
  Eigen::Matrix<double, Outputs, States> C;  ///< Outputs x states, output matrix.
  Eigen::Matrix<double, Outputs, Inputs> D;  ///< Outputs x inputs, feedthrough matrix.
  Time period;                               ///< Sample period, s.
};

/// Shapes that fit each other and finite entries (Table 6.1).
/// @param where  The function that asks, for the message.
/// @errors ArgumentError::wrong_shape, empty, not_finite.
[[nodiscard]] Expected<void> check_system(const MatrixRef& A, const MatrixRef& B,
                                          const MatrixRef& C, const MatrixRef& D,
                                          std::string_view where);

template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<void> check_system(const ContinuousSystem<States, Inputs, Outputs>& system,
                                          std::string_view where) {
  return check_system(system.A, system.B, system.C, system.D, where);
}

/// The same, and a static gain, y = D u of no states, is a system, too.
[[nodiscard]] Expected<void> check_system_or_gain(const MatrixRef& A, const MatrixRef& B,
                                                  const MatrixRef& C, const MatrixRef& D,
                                                  std::string_view where);
[[nodiscard]] Expected<void> check_system_or_gain(const ContinuousSystem<>& system,
                                                  std::string_view where);
[[nodiscard]] Expected<void> check_system_or_gain(const DiscreteSystem<>& system,
                                                  std::string_view where);

/// As for a continuous system; the period must be positive.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<void> check_system(const DiscreteSystem<States, Inputs, Outputs>& system,
                                          std::string_view where) {
  auto period = check_positive(system.period.si(), where, "period", "s");
  return period ? check_system(system.A, system.B, system.C, system.D, where) : period;
}

/// The eigenvalues of A: the poles, in no particular order.
/// @param A  n x n. @return n eigenvalues.
/// @errors ArgumentError::wrong_shape, empty, not_finite; malformed if the QR iteration fails.
/// Cost: O(n³), allocates.
[[nodiscard]] Expected<Eigen::VectorXcd> poles(const MatrixRef& A);

/// Poles of a system (section 6.4 for the continuous, 7.1 for the discrete case).
template <class System>
[[nodiscard]] Expected<Eigen::VectorXcd> poles(const System& system)
  requires requires { system.A; }
{
  return poles(MatrixRef(system.A));
}

/// Whether every pole has a negative real part (section 6.4).
[[nodiscard]] bool is_stable_continuous(const Eigen::VectorXcd& poles) noexcept;
/// Whether every pole lies within the unit circle (section 7.1.1).
[[nodiscard]] bool is_stable_discrete(const Eigen::VectorXcd& poles) noexcept;

/// Whether every pole is where a stable system has it. @errors As `poles`.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<bool> is_stable(const ContinuousSystem<States, Inputs, Outputs>& system) {
  return poles(system).map(is_stable_continuous);
}
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<bool> is_stable(const DiscreteSystem<States, Inputs, Outputs>& system) {
  return poles(system).map(is_stable_discrete);
}

}  // namespace flyball
