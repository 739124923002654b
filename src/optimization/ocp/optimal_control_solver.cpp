#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/math/expression/tape_builder.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "optimization/ocp/optimal_control_data.hpp"
#include "optimization/ocp/stage_program.hpp"
#include "optimization/solver/interior_point.hpp"

namespace flyball::optimization {

using detail::InteriorPoint;
using detail::OptimalControlData;
using detail::StageProblem;
using detail::StageProgram;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using expression::Lagrangian;

namespace {

/// The barrier's first weight where none is given: large, so that the first steps look for a
/// trajectory rather than for its last digits.
constexpr double first_barrier = 30.0;
constexpr std::size_t most_named = 10;

Lagrangian nothing(const OptimalControlData& data) {
  expression::TapeBuilder builder(static_cast<std::size_t>(data.size() + data.data_size));
  const expression::Slot zero = builder.constant(0.0);
  return expression::lagrangian(builder.finish({&zero, 1}), static_cast<std::size_t>(data.size()));
}

/// Which piece a stage has, the last that covers it, counted from 1; 0: none.
std::size_t piece_at(const std::vector<OptimalControlData::Piece>& pieces, int stage) {
  for (std::size_t i = pieces.size(); i > 0; --i) {
    if (pieces[i - 1].first <= stage && stage <= pieces[i - 1].last) {
      return i;
    }
  }
  return 0;
}

/// Stages of one kind have the same functions.
StageProblem stages_of(const OptimalControlData& data) {
  StageProblem problem;
  const int N = data.intervals;
  problem.stages = static_cast<std::size_t>(N) + 1;
  problem.states = static_cast<std::size_t>(data.states + data.parameters);
  problem.inputs = static_cast<std::size_t>(data.inputs);
  problem.lower = data.lower;
  problem.upper = data.upper;
  problem.lower.bottomRightCorner(data.inputs, 1).setZero();
  problem.upper.bottomRightCorner(data.inputs, 1).setZero();
  problem.data = data.data;
  problem.objective_scale = 1.0 / (N + 1);
  std::map<std::vector<std::size_t>, std::size_t> known;
  std::vector<std::size_t> there(data.rows.size() + 3);
  for (int k = 0; k <= N; ++k) {
    const std::size_t own_dynamics = k < N ? piece_at(data.dynamics_at, k) : 0;
    const std::size_t own_cost = k < N ? piece_at(data.cost_at, k) : 0;
    there[data.rows.size()] = k == N ? 1 : 0;
    there[data.rows.size() + 1] = own_dynamics;
    there[data.rows.size() + 2] = own_cost;
    for (std::size_t r = 0; r < data.rows.size(); ++r) {
      there[r] = data.rows[r].first <= k && k <= data.rows[r].last ? 1 : 0;
    }
    const auto [found, is_new] = known.try_emplace(there, problem.kinds.size());
    if (is_new) {
      std::vector<Lagrangian> parts;
      if (k < N) {
        parts.push_back(own_dynamics > 0 ? data.dynamics_at[own_dynamics - 1].functions
                                         : *data.dynamics);
      }
      const std::optional<Lagrangian>& cost = k < N ? data.cost : data.terminal_cost;
      parts.push_back(own_cost > 0 ? data.cost_at[own_cost - 1].functions
                      : cost       ? *cost
                                   : nothing(data));
      for (std::size_t r = 0; r < data.rows.size(); ++r) {
        if (there[r] != 0) {
          parts.push_back(data.rows[r].functions);
        }
      }
      problem.kinds.push_back({expression::stack(parts), k < N});
    }
    problem.kind.push_back(found->second);
    for (std::size_t r = 0; r < data.rows.size(); ++r) {
      if (there[r] != 0) {
        const OptimalControlData::Row& row = data.rows[r];
        problem.row_lower.insert(problem.row_lower.end(), row.lower.begin(), row.lower.end());
        problem.row_upper.insert(problem.row_upper.end(), row.upper.begin(), row.upper.end());
      }
    }
  }
  return problem;
}

}  // namespace

struct OptimalControlSolver::Parts {
  explicit Parts(const OptimalControlData& stated)
      : data(stated), program(stages_of(stated)), solver(program) {}

  [[nodiscard]] std::string name_of_output(std::size_t stage, std::size_t output) const;
  void report_violations(OptimalControlSolution& solution) const;
  [[nodiscard]] OptimalControlSolution solution(SolveStatus status);

  OptimalControlData data;
  StageProgram program;
  InteriorPoint solver;
  bool has_solution = false;
  int patience = 0;  // with a warm start, before it is begun anew
};

OptimalControlSolver::OptimalControlSolver(std::unique_ptr<Parts> parts)
    : parts_(std::move(parts)) {}
OptimalControlSolver::OptimalControlSolver(OptimalControlSolver&&) noexcept = default;
OptimalControlSolver& OptimalControlSolver::operator=(OptimalControlSolver&&) noexcept = default;
OptimalControlSolver::~OptimalControlSolver() = default;

Expected<OptimalControlSolver> OptimalControlSolver::make(const OptimalControlProblem& problem) {
  const OptimalControlData& data = *problem.data_;
  if (data.error) {
    return tl::unexpected(*data.error);
  }
  bool has_dynamics = true;
  for (int k = 0; k < data.intervals && !data.dynamics && has_dynamics; ++k) {
    has_dynamics = piece_at(data.dynamics_at, k) > 0;
  }
  if (!has_dynamics) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in("optimal control")
                              .about("the problem's dynamics")
                              .hint("call set_dynamics or set_derivative"));
  }
  return OptimalControlSolver(std::make_unique<Parts>(data));
}

/// What a number of a stage is called: a state that follows, the cost, or a constraint's entry.
std::string OptimalControlSolver::Parts::name_of_output(std::size_t stage,
                                                        std::size_t output) const {
  const StageProblem& problem = program.problem();
  const std::size_t before = problem.kinds[problem.kind[stage]].has_dynamics ? problem.states : 0;
  if (output < before) {
    return output < static_cast<std::size_t>(data.states)
               ? flyball::detail::format("dynamics of state {}", output)
               : flyball::detail::format("parameter {}",
                                         output - static_cast<std::size_t>(data.states));
  }
  if (output == before) {
    return stage + 1 < problem.stages ? "stage cost" : "terminal cost";
  }
  std::size_t row = output - before - 1;
  for (const OptimalControlData::Row& rows : data.rows) {
    if (rows.first <= static_cast<int>(stage) && static_cast<int>(stage) <= rows.last) {
      if (row < static_cast<std::size_t>(rows.lower.size())) {
        return rows.lower.size() > 1 ? flyball::detail::format("{}, entry {}", rows.name, row)
                                     : rows.name;
      }
      row -= static_cast<std::size_t>(rows.lower.size());
    }
  }
  return "constraint";
}

void OptimalControlSolver::Parts::report_violations(OptimalControlSolution& solution) const {
  const StageProblem& problem = program.problem();
  const VectorXd& c = solver.constraint_values();
  const double limit = 1e-6;
  for (std::size_t k = 0; k < problem.stages; ++k) {
    const std::size_t before = problem.kinds[problem.kind[k]].has_dynamics ? problem.states : 0;
    for (std::size_t i = 0; i < before; ++i) {
      const double amount = std::abs(c(static_cast<Index>(k * problem.states + i)));
      if (amount > limit) {
        solution.violations.push_back({name_of_output(k, i), static_cast<int>(k), amount});
      }
    }
    const std::size_t first = program.first_row()[k];
    for (std::size_t r = first; r < program.first_row()[k + 1]; ++r) {
      const double amount = std::abs(c(static_cast<Index>(program.defects() + r)));
      if (amount > limit) {
        solution.violations.push_back(
            {name_of_output(k, before + 1 + r - first), static_cast<int>(k), amount});
      }
    }
  }
  std::stable_sort(solution.violations.begin(), solution.violations.end(),
                   [](const Violation& a, const Violation& b) { return a.amount > b.amount; });
  if (solution.violations.size() > most_named) {
    solution.violations.resize(most_named);
  }
}

OptimalControlSolution OptimalControlSolver::Parts::solution(SolveStatus status) {
  OptimalControlSolution result;
  const StageProblem& problem = program.problem();
  const auto size = static_cast<Index>(data.size());
  const auto stages = static_cast<Index>(problem.stages);
  const Eigen::Map<const MatrixXd> z(solver.w().data(), size, stages);
  result.states = z.topRows(data.states);
  result.parameters = z.col(0).segment(data.states, data.parameters);
  result.inputs = z.bottomLeftCorner(data.inputs, stages - 1);
  const Eigen::Map<const MatrixXd> lambda(solver.lambda().data(), data.states + data.parameters,
                                          stages - 1);
  result.costates = lambda.topRows(data.states) / problem.objective_scale;
  result.cost = solver.objective() / problem.objective_scale;
  result.status = status;
  result.infeasibility = solver.last().infeasibility;
  result.optimality = solver.last().optimality;
  result.complementarity = solver.last().complementarity;
  result.counts = solver.counts();
  has_solution = result.solved();
  if (status == SolveStatus::not_finite) {
    const StageProgram::Fault fault = program.find_fault(solver.w());
    result.message = fault.found ? flyball::detail::format(
                                       "{}{} is not finite at stage {}",
                                       fault.derivative ? "a derivative of " : "",
                                       name_of_output(fault.stage, fault.output), fault.stage)
                                 : std::string("a number is not finite");
    return result;
  }
  if (!result.solved()) {
    report_violations(result);
    result.message = std::string(to_string(status));
    if (!result.violations.empty()) {
      const Violation& worst = result.violations.front();
      result.message += flyball::detail::format(": {} at stage {} is violated by {:.3g}",
                                                worst.name, worst.stage, worst.amount);
    }
  }
  return result;
}

OptimalControlSolution OptimalControlSolver::solve(const SolverOptions& options) {
  return solve(options, [](const Iteration&) { return false; });
}

OptimalControlSolution OptimalControlSolver::solve(const SolverOptions& options,
                                                   FunctionRef<bool(const Iteration&)> watch) {
  const auto begin = std::chrono::steady_clock::now();
  Parts& parts = *parts_;
  parts.solver.start(parts.program.start(parts.data.start));
  SolverOptions with_barrier = options;
  if (with_barrier.first_barrier <= 0.0) {
    with_barrier.first_barrier = first_barrier;
  }
  const SolveStatus status = parts.solver.run(with_barrier, watch);
  parts.patience = 50 + 5 * parts.solver.counts().iterations;
  OptimalControlSolution result = parts.solution(status);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

OptimalControlSolution OptimalControlSolver::resolve(const SolverOptions& options) {
  Parts& parts = *parts_;
  const auto begin = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  if (!parts.has_solution || !parts.solver.warm_start(std::max(0.0, options.first_barrier))) {
    return solve(options);
  }
  SolverOptions attempt = options;
  attempt.max_iterations = std::min(options.max_iterations, parts.patience);
  const SolveStatus status = parts.solver.run(attempt, [](const Iteration&) { return false; });
  const SolverCounts counts = parts.solver.counts();
  if (status == SolveStatus::solved || status == SolveStatus::time_limit ||
      counts.iterations >= options.max_iterations) {
    OptimalControlSolution result = parts.solution(status);
    result.seconds = seconds();
    return result;
  }
  attempt.max_iterations = options.max_iterations - counts.iterations;
  attempt.time_limit = std::max(0.0, options.time_limit - seconds());
  OptimalControlSolution result = solve(attempt);
  result.counts.iterations += counts.iterations;
  result.counts.restorations += counts.restorations;
  result.counts.factorizations += counts.factorizations;
  result.counts.evaluations += counts.evaluations;
  result.counts.corrections += counts.corrections;
  result.seconds = seconds();
  return result;
}

Expected<void> OptimalControlSolver::fix_initial_state(const Eigen::Ref<const VectorXd>& state) {
  Parts& parts = *parts_;
  FLYBALL_CHECK(Checks("fix_initial_state")
                    .shape(state, parts.data.states, 1, "state", "states x 1")
                    .finite(state, "state"));
  StageProblem& problem = parts.program.problem();
  for (Index i = 0; i < parts.data.states; ++i) {
    if (problem.lower(i, 0) != problem.upper(i, 0)) {
      return tl::unexpected(Error(ArgumentError::out_of_range)
                                .in("fix_initial_state")
                                .about(flyball::detail::format("state {}", i))
                                .expected("one that the problem fixed")
                                .got("free at the first stage"));
    }
  }
  problem.lower.col(0).head(parts.data.states) = state;
  problem.upper.col(0).head(parts.data.states) = state;
  parts.program.refresh();
  return {};
}

Expected<void> OptimalControlSolver::set_data(const Eigen::Ref<const MatrixXd>& data) {
  Parts& parts = *parts_;
  FLYBALL_CHECK(
      Checks("set_data")
          .shape(data, parts.data.data_size, parts.data.intervals + 1, "data", "entries x (N + 1)")
          .finite(data, "data"));
  parts.program.problem().data = data;
  parts.program.refresh();
  return {};
}

Expected<void> OptimalControlSolver::set_start(const Eigen::Ref<const MatrixXd>& states,
                                               const Eigen::Ref<const MatrixXd>& inputs) {
  OptimalControlData& data = parts_->data;
  FLYBALL_CHECK(Checks("set_start")
                    .shape(states, data.states, data.intervals + 1, "states", "states x (N + 1)")
                    .shape(inputs, data.inputs, data.intervals, "inputs", "inputs x N")
                    .finite(states, "states")
                    .finite(inputs, "inputs"));
  data.start.topRows(data.states) = states;
  data.start.bottomLeftCorner(data.inputs, data.intervals) = inputs;
  return {};
}

Expected<OptimalControlSolution> solve(const OptimalControlProblem& problem,
                                       const SolverOptions& options) {
  FLYBALL_TRY(OptimalControlSolver solver, OptimalControlSolver::make(problem));
  return solver.solve(options);
}

}  // namespace flyball::optimization
