#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include <flyball/control/mpc/linear_mpc.hpp>
#include <flyball/core/random.hpp>
#include <flyball/optimization/problem/problem.hpp>
#include <flyball/systems/discretize.hpp>

/// Predictive controllers that tests and benchmarks share, and the same programs as problems of the
/// modelling layer, which another method solves.
namespace flyball::mpc_problems {

struct Program {
  Eigen::MatrixXd A, B, Q, R;
  MpcSettings settings{};
  Eigen::VectorXd x_0, r, u_r, d, u_last;
};

/// Errors (x, y, θ, v_l, v_r) in the frame of a differential drive at 2 m/s, 0.6 m wide, each 20
/// ms.
inline Program drive() {
  Program p;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(5, 5);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(5, 2);
  A(0, 3) = A(0, 4) = 0.5;
  A(1, 2) = 2.0;
  A(2, 3) = -1.0 / 0.6;
  A(2, 4) = 1.0 / 0.6;
  A(3, 3) = A(4, 4) = -4.0;
  A(3, 4) = A(4, 3) = -0.5;
  B(3, 0) = B(4, 1) = 2.5;
  B(3, 1) = B(4, 0) = 0.4;
  const auto sampled = discretize_zoh(A, B, Time(0.02)).value();
  p.A = sampled.A;
  p.B = sampled.B;
  p.Q = Eigen::VectorXd{{400.0, 100.0, 25.0, 1.0, 1.0}}.asDiagonal();
  p.R = Eigen::MatrixXd::Identity(2, 2) / 144.0;
  p.settings.horizon = 20;
  p.settings.u_min = Eigen::VectorXd::Constant(2, -12.0);
  p.settings.u_max = Eigen::VectorXd::Constant(2, 12.0);
  p.settings.Q_end = 10.0 * p.Q;
  p.x_0 = Eigen::VectorXd{{0.5, 0.3, 0.2, -1.0, 0.5}};
  p.r = p.d = Eigen::VectorXd::Zero(5);
  p.u_r = p.u_last = Eigen::VectorXd::Zero(2);
  return p;
}

/// The quadrotor of OSQP's documentation, to z = 1 from x = 1, y = -0.5.
inline Program quadrotor() {
  Program p;
  p.A = Eigen::MatrixXd::Identity(12, 12);
  p.A(9, 9) = p.A(10, 10) = p.A(11, 11) = 0.9846;
  p.A(0, 6) = p.A(1, 7) = p.A(2, 8) = 0.1;
  p.A(3, 0) = p.A(9, 6) = 0.0488;
  p.A(4, 1) = p.A(10, 7) = -0.0488;
  p.A(3, 6) = 0.0016;
  p.A(4, 7) = -0.0016;
  p.A(3, 9) = p.A(4, 10) = p.A(5, 11) = 0.0992;
  p.A(9, 0) = 0.9734;
  p.A(10, 1) = -0.9734;
  p.B = Eigen::MatrixXd{
      {0.0, -0.0726, 0.0, 0.0726}, {-0.0726, 0.0, 0.0726, 0.0}, {-0.0152, 0.0152, -0.0152, 0.0152},
      {0.0, -0.0006, 0.0, 0.0006}, {0.0006, 0.0, -0.0006, 0.0}, {0.0106, 0.0106, 0.0106, 0.0106},
      {0.0, -1.4512, 0.0, 1.4512}, {-1.4512, 0.0, 1.4512, 0.0}, {-0.3049, 0.3049, -0.3049, 0.3049},
      {0.0, -0.0236, 0.0, 0.0236}, {0.0236, 0.0, -0.0236, 0.0}, {0.2107, 0.2107, 0.2107, 0.2107}};
  p.Q = Eigen::VectorXd{{0.0, 0.0, 10.0, 10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 5.0, 5.0, 5.0}}
            .asDiagonal();
  p.R = 0.1 * Eigen::MatrixXd::Identity(4, 4);
  p.settings.horizon = 30;
  p.settings.u_min = Eigen::VectorXd::Constant(4, 9.6 - 10.5916);
  p.settings.u_max = Eigen::VectorXd::Constant(4, 13.0 - 10.5916);
  p.settings.Q_end = p.Q;
  p.x_0 = p.r = p.d = Eigen::VectorXd::Zero(12);
  p.x_0(3) = 1.0;
  p.x_0(4) = -0.5;
  p.r(5) = 1.0;
  p.u_r = p.u_last = Eigen::VectorXd::Zero(4);
  return p;
}

/// Stable and unstable plants of up to six states, some of whose limits count.
inline Program random_program(Random& random, bool rates, bool states) {
  Program p;
  const auto whole = [&](int low, int high) {
    return low + static_cast<int>(random.uniform(0.0, 1.0) * (high - low + 1 - 1e-9));
  };
  const int n = whole(1, 6);
  const int m = whole(1, 3);
  const auto matrix = [&](int rows, int columns) {
    Eigen::MatrixXd M(rows, columns);
    for (Eigen::Index i = 0; i < M.size(); ++i) {
      M(i) = random.uniform(-1.0, 1.0);
    }
    return M;
  };
  p.A = Eigen::MatrixXd::Identity(n, n) + 0.3 * matrix(n, n);
  p.B = matrix(n, m);
  const Eigen::MatrixXd root = matrix(n, n);
  p.Q = root * root.transpose();
  p.R = std::pow(10.0, random.uniform(-3.0, 0.0)) * Eigen::MatrixXd::Identity(m, m);
  p.settings.horizon = whole(1, 12);
  p.settings.u_min = -Eigen::VectorXd::Constant(m, random.uniform(0.05, 1.0));
  p.settings.u_max = Eigen::VectorXd::Constant(m, random.uniform(0.05, 1.0));
  p.settings.Q_end = p.Q;
  if (rates) {
    p.settings.du_min = -Eigen::VectorXd::Constant(m, random.uniform(0.02, 0.5));
    p.settings.du_max = Eigen::VectorXd::Constant(m, random.uniform(0.02, 0.5));
  }
  if (states) {
    p.settings.x_min = -Eigen::VectorXd::Constant(n, random.uniform(0.2, 2.0));
    p.settings.x_max = Eigen::VectorXd::Constant(n, random.uniform(0.2, 2.0));
    p.settings.sigma = Eigen::VectorXd::Constant(n, random.uniform(0.0, 10.0));
    p.settings.rho = Eigen::VectorXd::Constant(n, random.uniform(0.0, 10.0));
  }
  p.x_0 = 2.0 * matrix(n, 1);
  p.r = matrix(n, 1);
  p.u_r = 0.1 * matrix(m, 1);
  p.d = 0.1 * matrix(n, 1);
  p.u_last = 0.05 * matrix(m, 1);
  return p;
}

inline Expected<LinearMpc<>> controller(const Program& p) {
  auto mpc = LinearMpc<>::create(p.A, p.B, p.Q, p.R, p.settings);
  if (mpc) {
    mpc->set_reference(p.r, p.u_r);
    mpc->set_disturbance(p.d);
    mpc->set_last_input(p.u_last);
  }
  return mpc;
}

/// The cost and the first input of the same program, stated in the modelling layer.
struct Answer {
  bool solved = false;
  double cost = 0.0;
  Eigen::VectorXd u;
};
inline Answer solve_as_problem(const Program& p) {
  using optimization::Expression;
  using optimization::ExpressionMatrix;
  using optimization::Problem;
  const auto n = static_cast<int>(p.A.rows());
  const auto m = static_cast<int>(p.B.cols());
  const int N = p.settings.horizon;
  Problem problem;
  const ExpressionMatrix X = problem.decision_variable(n, N + 1);
  const ExpressionMatrix U = problem.decision_variable(m, N);
  Expression J = 0.0;
  for (int i = 0; i < n; ++i) {
    problem.subject_to(X(i, 0) == p.x_0(i));
  }
  for (int k = 0; k <= N; ++k) {
    const Eigen::MatrixXd& Q = k < N ? p.Q : p.settings.Q_end;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        J += 0.5 * Q(i, j) * (X(i, k) - p.r(i)) * (X(j, k) - p.r(j));
      }
      if (k > 0 && p.settings.x_min.size() > 0) {
        const Expression slack = problem.decision_variable();
        problem.subject_to(slack >= 0.0);
        problem.subject_to(X(i, k) + slack >= p.settings.x_min(i));
        problem.subject_to(X(i, k) - slack <= p.settings.x_max(i));
        J += p.settings.sigma(i) * slack + 0.5 * p.settings.rho(i) * slack * slack;
      }
    }
    if (k == N) {
      break;
    }
    for (int i = 0; i < n; ++i) {
      Expression next = p.d(i);
      for (int j = 0; j < n; ++j) {
        next += p.A(i, j) * X(j, k);
      }
      for (int j = 0; j < m; ++j) {
        next += p.B(i, j) * U(j, k);
      }
      problem.subject_to(X(i, k + 1) == next);
    }
    for (int j = 0; j < m; ++j) {
      const Expression off = U(j, k) - p.u_r(j);
      J += 0.5 * p.R(j, j) * off * off;
      problem.subject_to(U(j, k) >= p.settings.u_min(j));
      problem.subject_to(U(j, k) <= p.settings.u_max(j));
      if (p.settings.du_min.size() > 0) {
        const double first = std::clamp(p.u_last(j), p.settings.u_min(j), p.settings.u_max(j));
        const Expression before = k > 0 ? U(j, k - 1) : Expression(first);
        problem.subject_to(U(j, k) - before >= p.settings.du_min(j));
        problem.subject_to(U(j, k) - before <= p.settings.du_max(j));
      }
    }
  }
  problem.minimize(J);
  const auto solution = problem.solve();
  Answer answer;
  if (solution) {
    answer.solved = solution->solved();
    answer.cost = solution->cost;
    answer.u = Eigen::VectorXd(m);
    for (int j = 0; j < m; ++j) {
      answer.u(j) = U.value(j, 0);
    }
  }
  return answer;
}

}  // namespace flyball::mpc_problems
