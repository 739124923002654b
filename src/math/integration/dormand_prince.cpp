#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/math/integration/butcher_tableau.hpp>

#include "core/try.hpp"
#include "math/integration/ode_steppers.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd OdeProblem::derivative(double t, const VectorXd& x) {
  ++statistics.evaluations;
  VectorXd dxdt(x.size());
  f(t, x, dxdt);
  return dxdt;
}

Eigen::MatrixXd OdeProblem::jacobian_at(double t, const VectorXd& x, const VectorXd& f_of_x) {
  ++statistics.jacobians;
  Eigen::MatrixXd J(x.size(), x.size());
  if (jacobian != nullptr) {
    (*jacobian)(t, x, J);
    return J;
  }
  VectorXd moved = x;
  for (Index j = 0; j < x.size(); ++j) {
    const double wanted =
        std::sqrt(std::numeric_limits<double>::epsilon() * std::max(1e-5, std::abs(x(j))));
    moved(j) = x(j) + std::copysign(wanted, f_of_x(j) * direction);
    const double step = moved(j) - x(j);
    J.col(j) = (derivative(t, moved) - f_of_x) / step;
    moved(j) = x(j);
  }
  return J;
}

double OdeProblem::norm(const VectorXd& e, const VectorXd& x, const VectorXd& y) const {
  double sum = 0.0;
  for (Index i = 0; i < e.size(); ++i) {
    const double scale =
        absolute_tolerance(i) + relative_tolerance * std::max(std::abs(x(i)), std::abs(y(i)));
    sum += (e(i) / scale) * (e(i) / scale);
  }
  return std::sqrt(sum / static_cast<double>(e.size()));
}

double OdeProblem::first_step(double t, const VectorXd& x, const VectorXd& f0) {
  const double d0 = norm(x, x, x);
  const double d1 = norm(f0, x, x);
  const double length = std::abs(t_end - t);
  const double h0 = std::min(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1, length);
  const VectorXd f1 = derivative(t + direction * h0, x + direction * h0 * f0);
  const double d2 = norm(f1 - f0, x, x) / h0;
  const double slope = std::max(d1, d2);
  const double h1 = slope <= 1e-15 ? std::max(1e-6, h0 * 1e-3) : std::pow(0.01 / slope, 1.0 / 5.0);
  const double h = std::min({100.0 * h0, std::isfinite(h1) ? h1 : h0, length, max_step});
  return h > 0.0 ? h : h0;
}

Expected<double> next_time(const OdeProblem& problem, const OdeState& state, bool was_not_finite) {
  const std::vector<double> x(state.x.data(), state.x.data() + state.x.size());
  if (problem.statistics.steps + problem.statistics.rejected >= problem.max_steps) {
    return refusal(IntegrationError::too_many_steps, "integrate")
        .hint("raise max_steps or the tolerance, or take the method for stiff systems")
        .with("t", state.t)
        .with("steps", problem.max_steps)
        .with("x", x);
  }
  if (state.step > 10.0 * std::numeric_limits<double>::epsilon() * std::abs(state.t) &&
      state.step > std::numeric_limits<double>::min()) {
    const bool last = state.step >= std::abs(problem.t_end - state.t);
    return last ? problem.t_end : state.t + problem.direction * state.step;
  }
  if (was_not_finite) {
    return refusal(IntegrationError::not_finite, "integrate", "f(t, x)")
        .got("NaN or infinite ahead of t")
        .with("t", state.t)
        .with("x", x);
  }
  return refusal(IntegrationError::step_underflow, "integrate")
      .hint("the solution is singular there, or f is discontinuous; end before it, or at an event")
      .with("t", state.t)
      .with("step", state.step)
      .with("x", x);
}

Expected<void> DormandPrinceStepper::step(OdeProblem& problem, OdeState& state) {
  constexpr const auto& tableau = tableaus::dormand_prince;
  bool rejected = false;
  bool was_not_finite = false;
  std::array<VectorXd, 7> k;
  k[0] = state.f;
  while (true) {
    FLYBALL_TRY(const double t_next, next_time(problem, state, was_not_finite));
    const double h = t_next - state.t;

    VectorXd stage;
    VectorXd sixth;
    for (std::size_t i = 1; i < 7; ++i) {
      stage = state.x;
      for (std::size_t j = 0; j < i; ++j) {
        stage += (h * tableau.A[i][j]) * k[j];
      }
      if (i == 5) {
        sixth = stage;
      }
      k[i] = problem.derivative(state.t + tableau.c[i] * h, stage);
    }
    const VectorXd& next = stage;  // the last stage's state is the step's: b is the last row of A

    VectorXd difference = VectorXd::Zero(state.x.size());
    for (std::size_t i = 0; i < 7; ++i) {
      difference += (h * (tableau.b[i] - tableau.b_hat[i])) * k[i];
    }
    const double error = problem.norm(difference, state.x, next);
    was_not_finite = !std::isfinite(error) || !k[6].allFinite() || !next.allFinite();
    if (was_not_finite) {
      ++problem.statistics.rejected;
      rejected = true;
      state.step = 0.25 * std::abs(h);
      continue;
    }

    // PI control: the step of the next one is h · 0.9 err^-0.17 err_previous^0.04.
    constexpr double beta = 0.04;
    const double present = std::pow(error, 0.2 - 0.75 * beta);
    if (error > 1.0) {
      ++problem.statistics.rejected;
      rejected = true;
      state.step = std::abs(h) / std::min(5.0, present / 0.9);
      continue;
    }
    const double divisor =
        std::clamp(present / std::pow(previous_error_, beta) / 0.9, 1.0 / 10.0, 5.0);
    double step = std::abs(h) / divisor;
    if (rejected) {
      step = std::min(step, std::abs(h));
    }
    previous_error_ = std::max(error, 1e-4);
    watch_stiffness(h, k[5], k[6], sixth, next);

    // The continuous extension of order 4 (Hairer, Nørsett, Wanner, II.6).
    constexpr std::array<double, 7> d{
        -12715105075.0 / 11282082432.0,  0.0,
        87487479700.0 / 32700410799.0,   -10690763975.0 / 1880347072.0,
        701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0,
        69997945.0 / 29380423.0};
    Eigen::MatrixXd r = Eigen::MatrixXd::Zero(state.x.size(), 5);
    r.col(0) = state.x;
    r.col(1) = next - state.x;
    r.col(2) = h * k[0] - r.col(1);
    r.col(3) = r.col(1) - h * k[6] - r.col(2);
    for (std::size_t i = 0; i < 7; ++i) {
      r.col(4) += (h * d[i]) * k[i];
    }
    state.segment = {state.t, h, std::move(r)};
    state.t = t_next;
    state.x = next;
    state.f = k[6];
    state.step = std::min(step, problem.max_step);
    ++problem.statistics.steps;
    return {};
  }
}

// The two last stages are at the same time; f's change over theirs estimates the eigenvalue that
// matters. Dormand-Prince is stable for |λ| h < 3.3.
void DormandPrinceStepper::watch_stiffness(double h, const VectorXd& k6, const VectorXd& k7,
                                           const VectorXd& x6, const VectorXd& x7) {
  const double distance = (x7 - x6).norm();
  if (distance > 0.0 && std::abs(h) * (k7 - k6).norm() > 3.25 * distance) {
    other_steps_ = 0;
    ++stiff_steps_;
  } else if (++other_steps_ >= 6) {
    stiff_steps_ = 0;
  }
}

}  // namespace flyball::detail
