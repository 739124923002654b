#include <flyball/math/integration/implicit.hpp>

#include <limits>
#include <string>
#include <vector>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/integration/ode_steppers.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Refusal no_step(IntegrationError code, std::string_view hint, double t, const VectorXd& x) {
  return refusal(code, "implicit_runge_kutta_step")
      .hint(std::string(hint))
      .with("t", t)
      .with("x", std::vector<double>(x.data(), x.data() + x.size()));
}

}  // namespace

Expected<VectorXd> implicit_step(const ButcherTableauView& tableau, OdeFunction f,
                                 const OdeJacobian* jacobian, double t,
                                 const Eigen::Ref<const VectorXd>& x, double dt) {
  constexpr std::string_view where = "implicit_runge_kutta_step";
  if (x.size() == 0) {
    return refusal(ArgumentError::empty, where, "x");
  }
  FLYBALL_CHECK(Checks(where).finite(t, "t").finite(x, "x").finite(dt, "dt"));
  const Index n = x.size();
  const auto stages = static_cast<Index>(tableau.stages);
  const auto a = [&](Index i, Index j) {
    return tableau.A[static_cast<std::size_t>(i * stages + j)];
  };
  detail::OdeProblem problem{.f = f, .jacobian = jacobian};
  const VectorXd f_of_x = problem.derivative(t, x);
  const MatrixXd J = problem.jacobian_at(t, x, f_of_x);

  // I - dt A ⊗ J
  MatrixXd M = MatrixXd::Identity(n * stages, n * stages);
  for (Index i = 0; i < stages; ++i) {
    for (Index j = 0; j < stages; ++j) {
      M.block(i * n, j * n, n, n) -= dt * a(i, j) * J;
    }
  }

  MatrixXd z = MatrixXd::Zero(n, stages);
  MatrixXd k(n, stages);
  double previous = std::numeric_limits<double>::infinity();
  constexpr int max_iterations = 50;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    for (Index i = 0; i < stages; ++i) {
      k.col(i) = problem.derivative(t + tableau.c[static_cast<std::size_t>(i)] * dt, x + z.col(i));
    }
    VectorXd residual(n * stages);
    for (Index i = 0; i < stages; ++i) {
      residual.segment(i * n, n) = -z.col(i);
      for (Index j = 0; j < stages; ++j) {
        residual.segment(i * n, n) += dt * a(i, j) * k.col(j);
      }
    }
    const MatrixXd step = detail::solve_linear(M, residual);
    if (!step.allFinite()) {
      return no_step(IntegrationError::not_finite, "take a shorter step", t, x);
    }
    z += step.reshaped(n, stages);
    const double size = step.cwiseAbs().maxCoeff();
    const double rounding = 4.0 * std::numeric_limits<double>::epsilon() *
                            (x.cwiseAbs().maxCoeff() + z.cwiseAbs().maxCoeff());
    // Where rounding stops it, a correction is as small as one and no longer shrinks.
    if (size <= rounding || (size <= 1e4 * rounding && size >= 0.5 * previous)) {
      VectorXd next = x;
      for (Index i = 0; i < stages; ++i) {
        const auto place = static_cast<std::size_t>(i);
        next += dt * tableau.b[place] * problem.derivative(t + tableau.c[place] * dt, x + z.col(i));
      }
      if (!next.allFinite()) {
        return no_step(IntegrationError::not_finite, "take a shorter step", t, x);
      }
      return next;
    }
    previous = size;
  }
  return no_step(IntegrationError::no_convergence, "take a shorter step", t, x);
}

}  // namespace flyball
