#include <flyball/optimization/factor_graph.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/core/argument.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "optimization/normal_equations.hpp"

namespace flyball::optimization {

ErrorInfo error_info(FactorGraphError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"no_factors", "there is nothing to minimise", ErrorKind::misuse},
      {"no_start", "a residual is not finite where the variables start", ErrorKind::no_answer},
      {"not_determined", "a variable can move without changing the cost", ErrorKind::no_answer},
  };
  return flyball::detail::info_of(code, "factor_graph", rows);
}

std::string_view to_string(FactorGraphStop stop) {
  switch (stop) {
    case FactorGraphStop::optimal:
      return "optimal";
    case FactorGraphStop::rounding:
      return "rounding";
    case FactorGraphStop::iteration_limit:
      return "iteration_limit";
  }
  return "unknown";
}

namespace detail {

namespace {

constexpr std::string_view in_factor_graph = "FactorGraph";

Expected<void> check_graph(const GraphFunctions& graph) {
  if (graph.factors.empty()) {
    return refusal(FactorGraphError::no_factors, in_factor_graph, "the graph")
        .got(flyball::detail::format("{} variables and no residual", graph.sizes.size()))
        .expected("at least one residual (add_factor)");
  }
  for (std::size_t f = 0; f < graph.factors.size(); ++f) {
    for (int i = 0; i < graph.factors[f].count; ++i) {
      const int link = graph.links[graph.factors[f].first_link + static_cast<std::size_t>(i)];
      if (link < 0 || static_cast<std::size_t>(link) >= graph.sizes.size()) {
        return refusal(ArgumentError::out_of_range, in_factor_graph,
                       flyball::detail::format("factor {}", f))
            .got("a variable that was not added to this graph")
            .expected("what `add` returned");
      }
    }
  }
  return {};
}

Refusal not_finite(const GraphFunctions& graph, std::size_t factor) {
  std::string of;
  for (int i = 0; i < graph.factors[factor].count; ++i) {
    of += flyball::detail::format(
        "{}{}", i == 0 ? "" : ", ",
        graph.links[graph.factors[factor].first_link + static_cast<std::size_t>(i)]);
  }
  return refusal(FactorGraphError::no_start, in_factor_graph,
                 flyball::detail::format("factor {}", factor))
      .got(flyball::detail::format("a residual or a derivative that is not finite, of the "
                                   "variables {}",
                                   of))
      .expected("finite numbers at the start")
      .hint("start the variables where the residual has a derivative");
}

Refusal not_determined(const NormalEquations& equations, Index entry) {
  const int variable = equations.variable_of(entry);
  return refusal(FactorGraphError::not_determined, in_factor_graph,
                 flyball::detail::format("variable {}", variable))
      .got("a direction in which no residual changes")
      .expected("every direction seen by a residual")
      .hint("fix one variable, or add a residual that holds it, such as a prior");
}

}  // namespace

double graph_cost(const GraphFunctions& graph) {
  if (std::any_of(graph.links.begin(), graph.links.end(), [](int link) { return link < 0; })) {
    return std::numeric_limits<double>::quiet_NaN();  // a variable of another graph
  }
  double cost = 0.0;
  std::vector<double> r;
  for (std::size_t f = 0; f < graph.factors.size(); ++f) {
    const auto& factor = graph.factors[f];
    r.resize(static_cast<std::size_t>(factor.rows));
    graph.evaluate(f, r.data(), nullptr);
    double square = 0.0;
    for (const double entry : r) {
      square += entry * entry;
    }
    cost += factor.loss(square).value;
  }
  return cost;
}

Expected<FactorGraphResult> solve_graph(GraphFunctions& graph, const FactorGraphOptions& options) {
  FLYBALL_CHECK(Checks(in_factor_graph)
                    .within(options.max_iterations, 0, 1e9, "max_iterations")
                    .positive(options.tolerance, "tolerance"));
  FLYBALL_CHECK(check_graph(graph));
  NormalEquations equations(graph);
  std::size_t failed = 0;
  if (!equations.linearize(failed)) {
    return not_finite(graph, failed);
  }
  FactorGraphResult result;
  result.unknowns = equations.unknowns();
  result.start_cost = result.cost = equations.cost();
  if (equations.unknowns() == 0) {
    result.stop = FactorGraphStop::optimal;
    result.converged = true;
    return result;
  }
  graph.keep_start();
  VectorXd step;
  if (!equations.solve(1e-3, step)) {
    return not_determined(equations, equations.lost_pivot());
  }
  constexpr double cost_noise = 1e-13;
  constexpr double least_damping = 1e-15;  // Gauss and Newton's method, while it lowers the cost.

  double damping = least_damping;
  double growth = 2.0;
  bool done = false;
  while (!done && result.iterations < options.max_iterations) {
    ++result.iterations;
    ++result.factorizations;
    double next = std::numeric_limits<double>::infinity();
    double predicted = 0.0;
    if (equations.solve(damping, step)) {
      const double slope = -equations.gradient().dot(step);
      predicted = slope + equations.damping_part(damping, step);
      result.optimality = result.cost > 0.0 ? std::sqrt(std::max(0.0, slope) / result.cost) : 0.0;
      if (result.optimality <= options.tolerance) {
        result.stop = FactorGraphStop::optimal;
        break;
      }
      graph.keep();
      graph.move(step);
      next = graph_cost(graph);
      if (!(next <= result.cost)) {
        graph.move(VectorXd::Zero(step.size()));
      }
    }
    if (next <= result.cost) {
      const double gain = predicted > 0.0 ? (result.cost - next) / predicted : 1.0;
      const bool level = result.cost - next <= cost_noise * result.cost;
      damping *= gain > 0.9 ? 0.01 : std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3.0));
      damping = std::max(damping, least_damping);
      growth = 2.0;
      if (!equations.linearize(failed)) {
        // The cost is finite here and its derivative is not: what was reached before stays.
        graph.move(VectorXd::Zero(step.size()));
        result.stop = FactorGraphStop::rounding;
        break;
      }
      result.cost = next;
      if (level && result.optimality < 1e-6) {
        result.stop = FactorGraphStop::rounding;
        done = true;
      }
    } else {
      damping = std::max(damping, 1e-12) * growth;
      growth *= 2.0;
      if (damping > 1e16) {
        result.stop = FactorGraphStop::rounding;
        done = true;
      }
    }
  }
  result.converged = result.stop == FactorGraphStop::optimal ||
                     (result.stop == FactorGraphStop::rounding && result.optimality < 1e-3);
  result.factor_nonzeros = equations.factor_nonzeros();
  if (const Index lost = equations.lost_pivot(); lost >= 0) {
    graph.back_to_start();
    return not_determined(equations, lost);
  }
  return result;
}

Expected<std::vector<Eigen::MatrixXd>> graph_covariances(GraphFunctions& graph) {
  FLYBALL_CHECK(check_graph(graph));
  NormalEquations equations(graph);
  std::size_t failed = 0;
  if (!equations.linearize(failed)) {
    return not_finite(graph, failed);
  }
  if (equations.unknowns() == 0) {
    return std::vector<Eigen::MatrixXd>(graph.sizes.size());
  }
  if (const Index lost = equations.lost_pivot(); lost >= 0) {
    return not_determined(equations, lost);
  }
  return equations.inverse_blocks();
}

}  // namespace detail

}  // namespace flyball::optimization
