#include <algorithm>
#include <cmath>
#include <limits>

#include "core/constants.hpp"
#include "identification/model_simulation.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A state and its sensitivities S = ∂x/∂q, stepped together: what is computed is differentiated.
class Stepper {
 public:
  Stepper(const AnyModel& model, const SensitivityBy* by)
      : model_(model),
        by_(by),
        n_(model.states()),
        A_(n_, n_),
        B_(n_, model.inputs()),
        F_(n_, model.parameters().size()),
        H_(model.outputs(), model.parameters().size()) {
    const Index q = by == nullptr ? 0 : by->size();
    k_.assign(4, VectorXd(n_));
    K_.assign(4, MatrixXd(n_, q));
  }

  /// The classical Runge-Kutta step, the input at the start, in the middle and at the end.
  void explicit_step(VectorXd& x, MatrixXd& S, const VectorXd& u0, const VectorXd& um,
                     const VectorXd& u1, double h) {
    slope(x, S, u0, 0);
    slope(x + 0.5 * h * k_[0], S + 0.5 * h * K_[0], um, 1);
    slope(x + 0.5 * h * k_[1], S + 0.5 * h * K_[1], um, 2);
    slope(x + h * k_[2], S + h * K_[2], u1, 3);
    x += h / 6.0 * (k_[0] + 2.0 * (k_[1] + k_[2]) + k_[3]);
    if (by_ != nullptr) {
      S += h / 6.0 * (K_[0] + 2.0 * (K_[1] + K_[2]) + K_[3]);
    }
  }

  /// Alexander's SDIRK of order 2, γ = 1 - 1/√2: L-stable. Source: SIAM J. Numerical Analysis 14
  /// (1977).
  void implicit_step(VectorXd& x, MatrixXd& S, const VectorXd& u1, const VectorXd& u2, double h) {
    const double gamma = 1.0 - std::sqrt(0.5);
    stage(x, S, u1, gamma * h, 0);
    stage(x + (1.0 - gamma) * h * k_[0], S + (1.0 - gamma) * h * K_[0], u2, gamma * h, 1);
    x += h * ((1.0 - gamma) * k_[0] + gamma * k_[1]);
    if (by_ != nullptr) {
      S += h * ((1.0 - gamma) * K_[0] + gamma * K_[1]);
    }
  }
  static constexpr double first_stage = 0.29289321881345254;  ///< γ, of the step.

  /// y = h(x, u) and ∂y/∂q.
  void output(const VectorXd& x, const MatrixXd& S, const VectorXd& u, Eigen::Ref<VectorXd> y,
              Eigen::Ref<MatrixXd> sensitivity) {
    model_.output(x, u, y);
    if (by_ != nullptr) {
      C_.resize(model_.outputs(), n_);
      D_.resize(model_.outputs(), model_.inputs());
      model_.output_jacobians(x, u, C_, D_);
      sensitivity.noalias() = C_ * S;
      if (!by_->parameters.empty()) {
        model_.parameter_jacobians(x, u, F_, H_);
        for (std::size_t j = 0; j < by_->parameters.size(); ++j) {
          sensitivity.col(static_cast<Index>(j)) += H_.col(by_->parameters[j]);
        }
      }
    }
  }

 private:
  /// k = f and K = A S + F.
  void slope(const VectorXd& x, const MatrixXd& S, const VectorXd& u, std::size_t i) {
    model_.derivative(x, u, k_[i]);
    if (by_ != nullptr) {
      model_.jacobians(x, u, A_, B_);
      K_[i].noalias() = A_ * S;
      add_parameters(x, u, K_[i]);
    }
  }

  void add_parameters(const VectorXd& x, const VectorXd& u, MatrixXd& K) {
    if (!by_->parameters.empty()) {
      model_.parameter_jacobians(x, u, F_, H_);
      for (std::size_t j = 0; j < by_->parameters.size(); ++j) {
        K.col(static_cast<Index>(j)) += F_.col(by_->parameters[j]);
      }
    }
  }

  /// k = f(base + g k, u) by Newton's method, and its sensitivities.
  void stage(const VectorXd& base, const MatrixXd& S, const VectorXd& u, double g, std::size_t i) {
    VectorXd x = base;
    bool found = false;
    constexpr int most = 20;
    for (int iteration = 0; iteration < most && !found && x.allFinite(); ++iteration) {
      model_.derivative(x, u, k_[i]);
      model_.jacobians(x, u, A_, B_);
      const VectorXd step =
          detail::solve_linear(MatrixXd::Identity(n_, n_) - g * A_, VectorXd(base + g * k_[i] - x));
      x += step;
      found = step.norm() <= 1e-10 * (x.norm() + 1e-10);
    }
    if (!found) {  // what follows is not finite, and told so
      x.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    k_[i] = (x - base) / g;
    if (by_ != nullptr) {
      model_.jacobians(x, u, A_, B_);
      MatrixXd right = A_ * S;
      add_parameters(x, u, right);
      K_[i] = detail::solve_linear(MatrixXd::Identity(n_, n_) - g * A_, right);
    }
  }

  const AnyModel& model_;
  const SensitivityBy* by_;
  Index n_;
  MatrixXd A_, B_, F_, H_, C_, D_;
  std::vector<VectorXd> k_;
  std::vector<MatrixXd> K_;
};

/// The inputs between a sample and the next. @param share  Of the way, in [0, 1].
VectorXd input_at(const MatrixXd& inputs, Index k, double share, InputHold hold) {
  const auto u = inputs.col(k);
  if (hold == InputHold::held) {
    return u;
  }
  const auto next = inputs.col(k + 1);
  if (hold == InputHold::linear) {
    return u + share * (next - u);
  }
  const VectorXd slope = k > 0 ? VectorXd(0.5 * (next - inputs.col(k - 1))) : VectorXd(next - u);
  const VectorXd next_slope =
      k + 2 < inputs.cols() ? VectorXd(0.5 * (inputs.col(k + 2) - u)) : VectorXd(next - u);
  const double rest = 1.0 - share;
  return rest * rest * ((1.0 + 2.0 * share) * u + share * slope) +
         share * share * ((1.0 + 2.0 * rest) * next - rest * next_slope);
}

}  // namespace

std::optional<SimulatedRun> simulate_run(const AnyModel& model, const ExperimentRun& run,
                                         const VectorXd& initial, InputHold hold,
                                         const IntegrationPlan& plan, const SensitivityBy* by) {
  const auto count = static_cast<Index>(run.time.size());
  SimulatedRun made{MatrixXd(model.outputs(), count), {}};
  VectorXd x = initial;
  MatrixXd S = MatrixXd::Zero(model.states(), by == nullptr ? 0 : by->size());
  for (std::size_t j = 0; by != nullptr && j < by->states.size(); ++j) {
    S(by->states[j], static_cast<Index>(by->parameters.size() + j)) = 1.0;
  }
  if (by != nullptr) {
    made.sensitivity.resize(model.outputs() * count, by->size());
  }
  Stepper stepper(model, by);
  VectorXd y(model.outputs());
  for (Index k = 0; k < count; ++k) {
    const VectorXd u = run.inputs.col(k);
    stepper.output(x, S, u, y,
                   by == nullptr ? made.sensitivity.middleRows(0, 0)
                                 : made.sensitivity.middleRows(k * y.size(), y.size()));
    made.y.col(k) = y;
    if (!x.allFinite() || !y.allFinite()) {
      return std::nullopt;
    }
    if (k + 1 == count) {
      break;
    }
    const auto at = static_cast<std::size_t>(k);
    const double dt = run.time[at + 1] - run.time[at];
    const double steps = std::max(1.0, std::ceil(dt / plan.step - 1e-6));
    const double h = dt / steps;
    for (double i = 0.0; i < steps; ++i) {
      const auto input = [&](double share) {
        return input_at(run.inputs, k, (i + share) / steps, hold);
      };
      if (plan.implicit) {
        stepper.implicit_step(x, S, input(Stepper::first_stage), input(1.0), h);
      } else {
        stepper.explicit_step(x, S, input(0.0), input(0.5), input(1.0), h);
      }
    }
  }
  return made;
}

std::optional<IntegrationPlan> plan_integration(const AnyModel& model,
                                                const std::vector<ExperimentRun>& runs,
                                                const std::vector<VectorXd>& initial,
                                                InputHold hold, const VectorXd& tolerance) {
  std::vector<double> intervals;
  for (const ExperimentRun& run : runs) {
    for (std::size_t k = 1; k < run.time.size(); ++k) {
      intervals.push_back(run.time[k] - run.time[k - 1]);
    }
  }
  if (intervals.empty()) {
    return IntegrationPlan{false, 1.0};
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  const auto simulate = [&](const IntegrationPlan& plan) {
    std::vector<std::optional<SimulatedRun>> all;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      all.push_back(simulate_run(model, runs[r], initial[r], hold, plan));
    }
    return all;
  };
  std::optional<IntegrationPlan> best;
  double least = infinity;
  constexpr int most = 7;  // 128 steps a sample
  for (const bool implicit : {false, true}) {
    IntegrationPlan plan{implicit, *middle};
    auto coarse = simulate(plan);
    for (int i = 0; i < most; ++i) {
      const IntegrationPlan half{implicit, 0.5 * plan.step};
      auto fine = simulate(half);
      double error = 0.0;
      for (std::size_t r = 0; r < runs.size(); ++r) {
        if (!coarse[r] || !fine[r]) {
          error = infinity;
          break;
        }
        const MatrixXd difference = coarse[r]->y - fine[r]->y;
        for (Index p = 0; p < difference.rows(); ++p) {
          error = std::max(error, difference.row(p).cwiseAbs().maxCoeff() / tolerance(p));
        }
      }
      if (error <= 1.0) {
        return plan;
      }
      if (error < least) {
        least = error;
        best = half;
      }
      plan = half;
      coarse = std::move(fine);
    }
  }
  return best;
}

MatrixXd output_errors(const AnyModel& model, const ExperimentRun& run, const MatrixXd& simulated) {
  MatrixXd errors = simulated - run.outputs;
  for (Index k = 0; k < errors.cols(); ++k) {
    auto column = errors.col(k);
    wrap_angles(column, model.names().outputs);
  }
  return errors;
}

}  // namespace flyball::identification
