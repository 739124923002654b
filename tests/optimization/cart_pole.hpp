#pragma once

#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include <flyball/optimization/ocp/optimal_control.hpp>

/// The swing-up that solvers are compared by: x = (p, θ, ṗ, θ̇), θ = 0 hanging, from rest to
/// (1, π, 0, 0) in 5 s, 0 ≤ p ≤ 2 m, |u| ≤ 20 N, least Σ u².
namespace cart_pole {

struct Model {
  template <class X, class U>
  auto operator()(const X& x, const U& u) const {
    using std::cos, std::sin;
    using T = typename X::Scalar;
    const double mc = 5.0;
    const double mp = 0.5;
    const double l = 0.5;
    const double g = 9.806;
    const T s = sin(x(1));
    const T c = cos(x(1));
    const T denominator = mc + mp * s * s;
    const T pull = mp * l * x(3) * x(3) * s + u(0);
    const T p = (pull + mp * g * s * c) / denominator;
    const T theta = (-(mc + mp) * g * s - c * pull) / (l * denominator);
    return Eigen::Vector<T, 4>(x(2), x(3), p, theta);
  }
};

inline flyball::optimization::OptimalControlProblem problem(int N) {
  flyball::optimization::OptimalControlProblem problem(4, 1, N);
  problem.set_derivative(Model{}, 5.0);
  problem.set_stage_cost([](const auto&, const auto& u) { return u(0) * u(0); });
  problem.fix_state(0, Eigen::Vector4d::Zero());
  problem.fix_state(N, Eigen::Vector4d(1.0, std::numbers::pi, 0.0, 0.0));
  const double inf = std::numeric_limits<double>::infinity();
  for (int k = 1; k < N; ++k) {
    problem.bound_state(k, Eigen::Vector4d(0.0, -inf, -inf, -inf),
                        Eigen::Vector4d(2.0, inf, inf, inf));
  }
  problem.bound_inputs(Eigen::VectorXd::Constant(1, -20.0), Eigen::VectorXd::Constant(1, 20.0));
  return problem;
}

inline Eigen::MatrixXd start(int N) {
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(4, N + 1);
  for (int k = 0; k <= N; ++k) {
    x(0, k) = static_cast<double>(k) / N;
    x(1, k) = std::numbers::pi * k / N;
  }
  return x;
}

}  // namespace cart_pole
