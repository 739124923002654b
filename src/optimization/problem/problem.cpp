#include <flyball/optimization/problem/problem.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "optimization/problem/flat_problem.hpp"
#include "optimization/problem/kinks.hpp"
#include "optimization/problem/sparse_program.hpp"
#include "optimization/solver/interior_point.hpp"
#include "optimization/solver/kept_memory.hpp"
#include "optimization/solver/quadratic_method.hpp"

namespace flyball::optimization {

using detail::ExpressionGraph;
using detail::FlatProblem;
using detail::InteriorPoint;
using detail::QuadraticMethod;
using detail::SparseProgram;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::size_t most_violations = 10;
/// As for optimal control problems: the first steps look for a trajectory.
constexpr double first_barrier_of_stages = 30.0;
/// Where a general problem is not solved in so many steps from the usual barrier, it is tried
/// again: a small one keeps near the start what the barrier's own pull would lead astray, a large
/// one looks farther.
constexpr int patience = 300;
constexpr double other_barriers[] = {1e-6, 1e3};

}  // namespace

ErrorInfo error_info(ProblemError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"no_variables", "there is nothing to decide", ErrorKind::misuse},
      {"wrong_shape", "shapes do not fit", ErrorKind::misuse},
      {"other_problem", "it belongs to another problem", ErrorKind::misuse},
      {"not_finite", "a number is NaN or infinite", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "problem", rows);
}

struct Problem::Parts {
  ExpressionGraph graph{};
  Expression cost{};
  double sign = 1.0;
  Constraints constraints{};
  struct Named {
    std::size_t first;
    std::string name;
  };
  std::vector<Named> names{};
  std::optional<Error> error{};
  detail::KinkFree kink_free{};
  bool is_lifted = false;  // whether it is that which is solved

  [[nodiscard]] const Expression& stated_cost() const { return is_lifted ? kink_free.cost : cost; }
  [[nodiscard]] const Constraints& stated_constraints() const {
    return is_lifted ? kink_free.constraints : constraints;
  }

  std::unique_ptr<SparseProgram> program{};
  std::unique_ptr<InteriorPoint> general{};
  std::unique_ptr<QuadraticMethod> quadratic{};
  bool is_warm = false;
  int cold_iterations = 0;                  // of the general method's last cold start
  SolverCounts counts{};                    // of the general method's attempts
  std::vector<double> solved_parameters{};  // of the program's numbers

  void refuse(Error problem_error) {
    if (!error) {
      error = std::move(problem_error).in("problem");
    }
  }
  [[nodiscard]] std::string name_of(std::size_t constraint) const;
  void report(ProblemSolution& solution, const FlatProblem& flat) const;
  [[nodiscard]] SolveStatus solve_general(const SolverOptions& options,
                                          FunctionRef<bool(const Iteration&)> watch,
                                          const VectorXd& begin);
  /// @param flat  The problem's numbers; null: they are those of the program.
  [[nodiscard]] ProblemSolution run(FlatProblem* flat, const SolverOptions& options,
                                    FunctionRef<bool(const Iteration&)> watch);
};

Problem::Problem() {
  detail::keep_freed_memory();
  parts_ = std::make_unique<Parts>();
}
Problem::Problem(Problem&&) noexcept = default;
Problem& Problem::operator=(Problem&&) noexcept = default;
Problem::~Problem() = default;

Expression Problem::decision_variable() {
  parts_->is_warm = false;
  parts_->program.reset();
  return {&parts_->graph, parts_->graph.input()};
}

ExpressionMatrix Problem::decision_variable(Index rows, Index columns) {
  if (rows <= 0 || columns <= 0) {
    return {};
  }
  ExpressionMatrix X(rows, columns);
  for (Index i = 0; i < X.size(); ++i) {
    X(i) = decision_variable();
  }
  return X;
}

Expression Problem::parameter(double value) {
  return {&parts_->graph, parts_->graph.parameter(value)};
}

ExpressionMatrix Problem::parameter(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  ExpressionMatrix P(values.rows(), values.cols());
  for (Index j = 0; j < values.cols(); ++j) {
    for (Index i = 0; i < values.rows(); ++i) {
      P(i, j) = parameter(values(i, j));
    }
  }
  return P;
}

void Problem::minimize(const Expression& cost) {
  if (!cost.is_constant() && cost.graph() != &parts_->graph) {
    parts_->refuse(Error(ProblemError::other_problem).about("the cost"));
    return;
  }
  parts_->cost = cost;
  parts_->sign = 1.0;
  parts_->program.reset();
}

void Problem::maximize(const Expression& gain) {
  minimize(gain);
  parts_->sign = -1.0;
}

void Problem::subject_to(const Constraints& constraints, std::string_view name) {
  Parts& parts = *parts_;
  parts.is_lifted = false;  // until it is solved again
  if (!name.empty()) {
    parts.names.push_back({parts.constraints.size(), std::string(name)});
  } else if (!parts.names.empty() && !parts.names.back().name.empty()) {
    parts.names.push_back({parts.constraints.size(), {}});
  }
  for (const Constraint& constraint : constraints) {
    if (!constraint.value.is_constant() && constraint.value.graph() != &parts.graph) {
      parts.refuse(
          Error(ProblemError::other_problem).about(parts.name_of(parts.constraints.size())));
    }
    if (constraint.value.is_constant() && std::isnan(constraint.value.constant())) {
      parts.refuse(Error(ProblemError::wrong_shape)
                       .about(parts.name_of(parts.constraints.size()))
                       .hint("compare matrices of one shape, and keep slices within theirs"));
    }
    parts.constraints.push_back(constraint);
  }
  parts.program.reset();
}

std::string Problem::Parts::name_of(std::size_t constraint) const {
  if (constraint >= constraints.size() && is_lifted) {
    return "an absolute value, minimum or maximum";
  }
  const auto after =
      std::upper_bound(names.begin(), names.end(), constraint,
                       [](std::size_t c, const Named& named) { return c < named.first; });
  if (after == names.begin() || std::prev(after)->name.empty()) {
    return flyball::detail::format("constraint {}", constraint);
  }
  const Named& named = *std::prev(after);
  const std::size_t end = after == names.end() ? constraints.size() : after->first;
  return end - named.first > 1
             ? flyball::detail::format("{}, entry {}", named.name, constraint - named.first)
             : named.name;
}

/// The constraints that the variables' values do not satisfy.
void Problem::Parts::report(ProblemSolution& solution, const FlatProblem& flat) const {
  std::vector<std::uint32_t> nodes;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    if (!constraints[i].value.is_constant()) {
      nodes.push_back(constraints[i].value.node());
      numbers.push_back(i);
    }
  }
  const expression::Tape tape = graph.tape(nodes);
  std::vector<double> work(tape.size());
  std::vector<double> values(nodes.size());
  tape.prepare<double>(graph.parameter_values, work);
  tape.evaluate<double>(graph.values, values, work);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double amount = constraints[numbers[i]].equality ? std::abs(values[i]) : -values[i];
    if (amount > 1e-6 || std::isnan(amount)) {
      solution.violations.push_back({numbers[i], name_of(numbers[i]), amount});
    }
  }
  if (flat.impossible >= 0 && solution.violations.empty()) {
    const auto constraint = static_cast<std::size_t>(flat.impossible);
    solution.violations.push_back({constraint, name_of(constraint), flat.impossible_by});
  }
  std::stable_sort(solution.violations.begin(), solution.violations.end(),
                   [](const ConstraintViolation& a, const ConstraintViolation& b) {
                     return a.amount > b.amount;
                   });
  if (solution.violations.size() > most_violations) {
    solution.violations.resize(most_violations);
  }
  if (solution.message.empty()) {  // else it says why already
    solution.message = std::string(to_string(solution.status));
  }
  if (!solution.violations.empty()) {
    solution.message +=
        flyball::detail::format(": {} is violated by {:.3g}", solution.violations.front().name,
                                solution.violations.front().amount);
  }
}

/// The filter method from where it stands, and where that fails from the variables' values with
/// other barriers, within the limits of the options.
SolveStatus Problem::Parts::solve_general(const SolverOptions& options,
                                          FunctionRef<bool(const Iteration&)> watch,
                                          const VectorXd& begin) {
  using Clock = std::chrono::steady_clock;
  const auto since = Clock::now();
  counts = {};
  SolverOptions attempt = options;
  const auto run = [&](double barrier, int most) {
    attempt.first_barrier = barrier;
    attempt.max_iterations = std::min(most, options.max_iterations - counts.iterations);
    const double seconds = std::chrono::duration<double>(Clock::now() - since).count();
    attempt.time_limit = std::max(0.0, options.time_limit - seconds);
    const SolveStatus status = general->run(attempt, watch);
    const SolverCounts& of = general->counts();
    counts.iterations += of.iterations;
    counts.restorations += of.restorations;
    counts.factorizations += of.factorizations;
    counts.evaluations += of.evaluations;
    counts.corrections += of.corrections;
    return status;
  };
  const auto failed = [&](SolveStatus status) {
    return (status == SolveStatus::no_progress || status == SolveStatus::iteration_limit) &&
           counts.iterations < options.max_iterations;
  };
  const bool free = options.first_barrier <= 0.0 && program->stages() == 0;
  SolveStatus status = run(options.first_barrier, is_warm ? 50 + 5 * cold_iterations
                                                  : free  ? patience
                                                          : options.max_iterations);
  if (is_warm && status != SolveStatus::solved && status != SolveStatus::stopped &&
      status != SolveStatus::time_limit && counts.iterations < options.max_iterations) {
    general->start(program->start(graph.values));
    const bool along = options.first_barrier <= 0.0 && program->stages() > 0;
    status = run(along ? first_barrier_of_stages : options.first_barrier,
                 free ? patience : options.max_iterations);
  } else if (!is_warm) {
    cold_iterations = counts.iterations;
  }
  for (const double barrier : other_barriers) {
    if (!free || !failed(status)) {
      break;
    }
    general->start(begin.size() > 0 ? begin : program->start(graph.values));
    const bool is_last = barrier == std::end(other_barriers)[-1];
    status = run(barrier, is_last ? options.max_iterations : patience);
  }
  return status;
}

ProblemSolution Problem::Parts::run(FlatProblem* flat, const SolverOptions& options,
                                    FunctionRef<bool(const Iteration&)> watch) {
  ProblemSolution solution;
  if (flat != nullptr && (!program || !program->update(*flat))) {
    program = std::make_unique<SparseProgram>(std::move(*flat));
    general.reset();
    quadratic.reset();
    is_warm = false;
  }
  SparseProgram& p = *program;
  const FlatProblem& stated = p.flat();
  const double direction = stated.sign;
  solution.cost_degree = stated.cost_degree;
  solution.equality_degree = stated.equality_degree;
  solution.inequality_degree = stated.inequality_degree;
  SolveStatus status = SolveStatus::no_progress;
  const VectorXd* w = nullptr;
  const VectorXd* lambda = nullptr;
  const VectorXd* zl = nullptr;
  const VectorXd* zu = nullptr;
  const auto take = [&](const auto& method) {
    w = &method.w();
    lambda = &method.lambda();
    zl = &method.lower_multipliers();
    zu = &method.upper_multipliers();
    solution.counts = method.counts();
    solution.infeasibility = method.last().infeasibility;
    solution.optimality = method.last().optimality;
    solution.complementarity = method.last().complementarity;
    solution.cost = direction * method.objective() / p.objective_scale();
  };
  if (is_lifted && !is_warm) {
    kink_free.start(graph);
  }
  const auto is_users = [&](int number) {
    return static_cast<std::size_t>(number) < constraints.size();
  };
  const VectorXd begin = is_warm ? VectorXd() : p.start(graph.values);
  if (p.is_quadratic()) {
    if (!quadratic) {
      quadratic = std::make_unique<QuadraticMethod>(p);
    }
    status = quadratic->run(options, watch, is_warm);
    if (is_warm && status != SolveStatus::solved && status != SolveStatus::stopped &&
        status != SolveStatus::time_limit) {
      status = quadratic->run(options, watch, false);
    }
    solution.method = stated.cost_degree == Degree::quadratic
                          ? "quadratic program, Mehrotra's predictor-corrector method"
                          : "linear program, Mehrotra's predictor-corrector method";
    take(*quadratic);
    if (status == SolveStatus::infeasible) {
      solution.certificate.setZero(static_cast<Index>(constraints.size()));
      for (int r = 0; r < p.constraints(); ++r) {
        if (const auto number = stated.constraint[static_cast<std::size_t>(r)]; is_users(number)) {
          solution.certificate(number) = quadratic->certificate()(r) * p.row_scale(r);
        }
      }
    } else if (status == SolveStatus::unbounded) {
      solution.certificate = quadratic->certificate().head(static_cast<Index>(graph.inputs()));
      Index kept = 0;
      for (std::size_t i = 0; is_lifted && i < graph.inputs(); ++i) {
        if (!kink_free.is_own(graph, i)) {
          solution.certificate(kept++) = solution.certificate(static_cast<Index>(i));
        }
      }
      solution.certificate.conservativeResize(is_lifted ? kept : solution.certificate.size());
    }
  }
  if (status == SolveStatus::no_progress) {  // not quadratic, or not convex
    if (!general) {
      general = std::make_unique<InteriorPoint>(p);
      is_warm = false;
    }
    if (is_warm) {
      is_warm = general->warm_start(0.0);
    }
    if (!is_warm) {
      general->start(begin.size() > 0 ? begin : p.start(graph.values));
    }
    SolverOptions chosen = options;
    if (chosen.first_barrier <= 0.0 && p.stages() > 0 && !is_warm) {
      chosen.first_barrier = first_barrier_of_stages;
    }
    status = solve_general(chosen, watch, begin);
    solution.method = "filter interior-point method";
    take(*general);
    solution.counts = counts;
  }
  if (p.stages() > 0) {
    solution.method += flyball::detail::format(" along {} stages", p.stages());
  }
  solution.status = status;
  if (status == SolveStatus::not_finite) {
    const SparseProgram::Fault fault = p.find_fault(*w);
    const std::string what = fault.row == -2 ? std::string("a number")
                             : fault.row < 0
                                 ? std::string("the cost")
                                 : name_of(static_cast<std::size_t>(
                                       stated.constraint[static_cast<std::size_t>(fault.row)]));
    solution.message = (fault.derivative ? "a derivative of " : "") + what + " is not finite";
  }
  if (status == SolveStatus::no_progress && general) {
    const int kink = p.find_kink(*w);
    if (kink > -2) {
      const std::string what = kink < 0 ? std::string("the cost")
                                        : name_of(static_cast<std::size_t>(
                                              stated.constraint[static_cast<std::size_t>(kink)]));
      solution.message = flyball::detail::format(
          "no progress: {} has a kink near where this ended; a variable t with -t <= y and y <= t "
          "is "
          "smooth where |y| and sqrt(y^2) are not",
          what);
    }
  }
  std::copy_n(w->data(), graph.inputs(), graph.values.begin());
  is_warm = status == SolveStatus::solved;
  // Multipliers: L = f - Σ λᵢ cᵢ, those of inequalities not negative.
  solution.multipliers.setZero(static_cast<Index>(constraints.size()));
  for (int r = 0; r < p.constraints(); ++r) {
    if (const auto number = stated.constraint[static_cast<std::size_t>(r)]; is_users(number)) {
      solution.multipliers(number) = -(*lambda)(r)*p.row_scale(r) / p.objective_scale();
    }
  }
  for (std::size_t i = 0; i < graph.inputs(); ++i) {
    const auto k = static_cast<Index>(i);
    if (stated.lower[i] == stated.upper[i]) {
      continue;
    }
    if (stated.lower_from[i] >= 0 && is_users(stated.lower_from[i])) {
      solution.multipliers(stated.lower_from[i]) =
          (*zl)(k) / stated.lower_slope[i] / p.objective_scale();
    }
    if (stated.upper_from[i] >= 0 && is_users(stated.upper_from[i])) {
      solution.multipliers(stated.upper_from[i]) =
          -(*zu)(k) / stated.upper_slope[i] / p.objective_scale();
    }
  }
  return solution;
}

Expected<ProblemSolution> Problem::solve(const SolverOptions& options) {
  return solve(options, [](const Iteration&) { return false; });
}

Expected<ProblemSolution> Problem::solve(const SolverOptions& options,
                                         FunctionRef<bool(const Iteration&)> watch) {
  const auto begin = std::chrono::steady_clock::now();
  Parts& parts = *parts_;
  if (parts.error) {
    return tl::unexpected(*parts.error);
  }
  if (parts.graph.inputs() == 0) {
    return tl::unexpected(
        Error(ProblemError::no_variables).in("problem").hint("make some with decision_variable"));
  }
  for (std::size_t i = 0; i < parts.graph.inputs(); ++i) {
    if (!std::isfinite(parts.graph.values[i]) && !parts.kink_free.is_own(parts.graph, i)) {
      return tl::unexpected(
          Error(ProblemError::not_finite).in("problem").about("a variable's start"));
    }
  }
  ProblemSolution solution;
  std::vector<Iteration> rows;
  FlatProblem flat;
  const bool same = parts.solved_parameters == parts.graph.parameter_values;
  parts.solved_parameters.clear();  // until the program has the numbers
  if (!parts.program) {
    parts.is_lifted = parts.graph.has_kinks() &&
                      parts.kink_free.state(parts.graph, parts.cost, parts.sign, parts.constraints);
  }
  const Expression& cost = parts.stated_cost();
  const Constraints& constraints = parts.stated_constraints();
  const bool is_new =
      !parts.program || (!same && !parts.program->renew(parts.graph, cost, constraints));
  if (is_new) {
    flat = detail::flatten(parts.graph, cost, parts.sign, constraints);
    if (flat.not_finite != -1) {
      return tl::unexpected(
          Error(ProblemError::not_finite)
              .in("problem")
              .about(flat.not_finite == -2
                         ? std::string("the cost")
                         : parts.name_of(static_cast<std::size_t>(flat.not_finite))));
    }
    if (flat.impossible >= 0) {
      solution.status = SolveStatus::infeasible;
      solution.method = "presolve";
      parts.report(solution, flat);
      return solution;
    }
  }
  parts.solved_parameters = parts.graph.parameter_values;
  const auto look = [&](const Iteration& row) {
    rows.push_back(row);
    return watch(row);
  };
  solution = parts.run(is_new ? &flat : nullptr, options, look);
  solution.iterations = std::move(rows);
  if (!solution.solved() && solution.status != SolveStatus::not_finite) {
    parts.report(solution, parts.program->flat());
  }
  solution.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return solution;
}

}  // namespace flyball::optimization
