#include <algorithm>
#include <cmath>
#include <utility>

#include "identification/robust_fit.hpp"
#include "identification/soft_loss.hpp"
#include "identification/statistics.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {
namespace {

/// Iterations before a search may be given up as not worth it.
constexpr int patience = 3;

struct NormalEquations {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  double cost = 0.0;
};

double sum_of_ages(const OutputErrorProblem& problem, const Eigen::VectorXd& x) {
  double sum = 0.0;
  for (const Eigen::Index age : problem.ages()) {
    sum += x[age];
  }
  return sum;
}

/// Adds a channel of a run to the sums of its columns and to the cost.
void accumulate(const Eigen::VectorXd& residuals, const ResidualBlock::Jacobian& jacobian,
                double inverse_scale, Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient,
                double& cost) {
  if (inverse_scale == 0.0) {
    return;
  }
  Eigen::VectorXd weights(residuals.size());
  for (Eigen::Index row = 0; row < residuals.size(); ++row) {
    const double z = residuals[row] * inverse_scale;
    weights[row] = weight(z) * square(inverse_scale);
    cost += loss(z);
  }
  add_squares(hessian, jacobian, weights);
  gradient.noalias() += jacobian.transpose() * weights.cwiseProduct(residuals);
}

/// @param wanted  The parameters that it is asked for, at least.
NormalEquations normal_equations(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                                 const std::vector<bool>& wanted, const ChannelScales& scales) {
  const Eigen::Index n = x.size();
  NormalEquations equations{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0.0};
  ResidualBlock block;
  for (std::size_t run = 0; run < problem.runs().size(); ++run) {
    problem.evaluate(run, x, wanted, block);
    const auto columns = static_cast<Eigen::Index>(block.columns.size());
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(columns, columns);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(columns);
    accumulate(block.difference, block.difference_jacobian, inverse(scales.difference), hessian,
               gradient, equations.cost);
    accumulate(block.velocity, block.velocity_jacobian, inverse(scales.velocity), hessian, gradient,
               equations.cost);
    scatter(equations.hessian, hessian, block.columns);
    for (Eigen::Index k = 0; k < columns; ++k) {
      if (const Eigen::Index at = block.columns[static_cast<std::size_t>(k)]; at >= 0) {
        equations.gradient[at] += gradient[k];
      }
    }
  }
  for (const auto& [i, mean, deviation] : problem.priors()) {
    const double z = (x[i] - mean) / deviation;
    equations.cost += square(z);
    equations.gradient[i] += z / deviation;
    equations.hessian(i, i) += 1.0 / square(deviation);
  }
  const double ages = sum_of_ages(problem, x);
  equations.cost += age_weight(problem) * square(ages);
  for (const Eigen::Index a : problem.ages()) {
    equations.gradient[a] += age_weight(problem) * ages;
    for (const Eigen::Index b : problem.ages()) {
      equations.hessian(a, b) += age_weight(problem);
    }
  }
  return equations;
}

/// The parameters that may move: free, and not pressed against a bound by the gradient.
std::vector<Eigen::Index> active_parameters(const Eigen::VectorXd& x,
                                            const NormalEquations& equations,
                                            const std::vector<bool>& free, const Bounds& bounds) {
  std::vector<Eigen::Index> active;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (!free[static_cast<std::size_t>(i)] || equations.hessian(i, i) <= 0.0) {
      continue;
    }
    const double slack = 1e-9 * (1.0 + std::abs(x[i]));
    const bool pressed_down = x[i] <= bounds.lower[i] + slack && equations.gradient[i] > 0.0;
    const bool pressed_up = x[i] >= bounds.upper[i] - slack && equations.gradient[i] < 0.0;
    if (!pressed_down && !pressed_up) {
      active.push_back(i);
    }
  }
  return active;
}

}  // namespace

double age_weight(const OutputErrorProblem& problem) {
  constexpr double tight = 0.01;  // of a run's share
  return 1.0 / square(tight * problem.age_deviation());
}

double cost_at(OutputErrorProblem& problem, const Eigen::VectorXd& x, const ChannelScales& scales) {
  ResidualBlock block;
  double cost = 0.0;
  for (std::size_t run = 0; run < problem.runs().size(); ++run) {
    problem.evaluate(run, x, block);
    for (const double residual : block.difference) {
      cost += loss(residual * inverse(scales.difference));
    }
    for (const double residual : block.velocity) {
      cost += loss(residual * inverse(scales.velocity));
    }
  }
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    cost += square((x[prior.parameter] - prior.mean) / prior.deviation);
  }
  return cost + age_weight(problem) * square(sum_of_ages(problem, x));
}

RobustFit minimize(OutputErrorProblem& problem, const Eigen::VectorXd& start,
                   const std::vector<bool>& free, const Bounds& bounds, const ChannelScales& scales,
                   int max_iterations, double tolerance, double worthwhile) {
  RobustFit fit;
  fit.x = start.cwiseMax(bounds.lower).cwiseMin(bounds.upper);
  double damping = 1e-3;
  bool rejected = false;
  NormalEquations equations = normal_equations(problem, fit.x, free, scales);
  fit.cost = equations.cost;
  while (fit.iterations < max_iterations) {
    ++fit.iterations;
    const std::vector<Eigen::Index> active = active_parameters(fit.x, equations, free, bounds);
    if (active.empty()) {
      fit.converged = true;
      break;
    }
    const auto n = static_cast<Eigen::Index>(active.size());
    Eigen::MatrixXd hessian = equations.hessian(active, active);
    const Eigen::VectorXd gradient = equations.gradient(active);
    const Eigen::VectorXd diagonal = hessian.diagonal();
    hessian.diagonal() += damping * diagonal;
    const Eigen::VectorXd step = detail::solve_symmetric(hessian, -gradient);
    Eigen::VectorXd trial = fit.x;
    for (Eigen::Index i = 0; i < n; ++i) {
      trial[active[static_cast<std::size_t>(i)]] += std::isfinite(step[i]) ? step[i] : 0.0;
    }
    trial = trial.cwiseMax(bounds.lower).cwiseMin(bounds.upper);
    // The fall of the quadratic model, -2 gᵀs - sᵀHs = -gᵀs + damping sᵀDs.
    const double promised = -gradient.dot(step) + damping * step.cwiseAbs2().dot(diagonal);
    // Where another step will follow, the derivatives of this one are found with its cost.
    const bool goes_on = !rejected && promised > 10.0 * tolerance;
    NormalEquations next;
    if (goes_on) {
      next = normal_equations(problem, trial, free, scales);
    }
    const double trial_cost = goes_on ? next.cost : cost_at(problem, trial, scales);
    rejected = !(trial_cost < fit.cost);
    if (!rejected) {
      const double gain = fit.cost - trial_cost;
      fit.x = trial;
      fit.cost = trial_cost;
      damping = std::max(1e-9, damping / 5.0);
      if (gain < tolerance) {
        fit.converged = true;
        break;
      }
      if (fit.iterations >= patience &&
          fit.cost - gain * (max_iterations - fit.iterations) > worthwhile) {
        break;
      }
      equations = goes_on ? std::move(next) : normal_equations(problem, fit.x, free, scales);
    } else {
      damping *= 8.0;
      // What was promised less than is asked for, and not kept, is not found with smaller steps.
      if (promised < tolerance || damping > 1e8) {
        fit.converged = true;
        break;
      }
    }
  }
  return fit;
}

std::vector<Score> scores(OutputErrorProblem& problem, const Eigen::VectorXd& x,
                          const std::vector<bool>& free, const Bounds& bounds,
                          const ChannelScales& scales,
                          const std::vector<std::vector<Eigen::Index>>& groups) {
  std::vector<bool> wanted = free;
  for (const std::vector<Eigen::Index>& group : groups) {
    for (const Eigen::Index k : group) {
      wanted[static_cast<std::size_t>(k)] = true;
    }
  }
  const NormalEquations equations = normal_equations(problem, x, wanted, scales);
  const std::vector<Eigen::Index> active = active_parameters(x, equations, free, bounds);
  const Eigen::MatrixXd hessian = equations.hessian(active, active);
  std::vector<Score> all;
  for (const std::vector<Eigen::Index>& group : groups) {
    const Eigen::MatrixXd cross = equations.hessian(active, group);
    const Eigen::MatrixXd own = equations.hessian(group, group);
    Eigen::MatrixXd left = own;
    for (Eigen::Index k = 0; k < cross.cols(); ++k) {
      const Eigen::VectorXd column = cross.col(k);
      left.col(k) -= cross.transpose() * detail::solve_symmetric(hessian, column);
    }
    Score score;
    if ((left.diagonal().array() > 1e-6 * own.diagonal().array()).all()) {
      const Eigen::VectorXd gradient = equations.gradient(group);
      score.step = -detail::solve_symmetric(left, gradient);
      score.gain = -gradient.dot(score.step);
    }
    all.push_back(std::move(score));
  }
  return all;
}

ChannelScales residual_scales(OutputErrorProblem& problem, const Eigen::VectorXd& x) {
  std::vector<double> differences;
  std::vector<double> velocities;
  ResidualBlock block;
  for (std::size_t run = 0; run < problem.runs().size(); ++run) {
    problem.evaluate(run, x, block);
    differences.insert(differences.end(), block.difference.begin(), block.difference.end());
    velocities.insert(velocities.end(), block.velocity.begin(), block.velocity.end());
  }
  const PreparedRecording& recording = problem.recording();
  ChannelScales scales{0.0, 0.0};
  if (!differences.empty()) {
    scales.difference = std::max(
        {mad_scale(differences), 0.1 * recording.position_quantum, 1e-7 * recording.top_speed});
  }
  if (!velocities.empty()) {
    scales.velocity = std::max(
        {mad_scale(velocities), 0.1 * recording.velocity_quantum, 1e-6 * recording.top_speed});
  }
  return scales;
}

}  // namespace flyball::identification
