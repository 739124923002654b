// Bounds, and other numbers of a flat problem whose parameters have changed.
#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/problem/flat_problem.hpp"
#include "optimization/problem/flat_walk.hpp"

namespace flyball::optimization::detail {

namespace {

void note_impossible(FlatProblem& flat, int number, double by) {
  if (flat.impossible < 0) {
    flat.impossible = number;
    flat.impossible_by = by;
  }
}

/// The numbers of a term, and what its parts are multiplied by. @return whether all is finite.
bool renew_term(FlatProblem& flat, std::size_t of_shape, std::size_t term,
                const std::vector<Part>& parts) {
  Shape& shape = flat.shapes[of_shape];
  const std::uint32_t* const nodes = shape.data_nodes.data() + term * shape.numbers;
  double* const data = shape.data.data() + term * shape.numbers;
  std::size_t part = 0;
  double check = 0.0;
  for (std::size_t i = 0; i < shape.numbers; ++i) {
    data[i] = nodes[i] == factor_of_part ? parts[part++].factor : flat.numbers[nodes[i]];
    check += data[i];
  }
  shape.factors[term] = parts.size() > 1 ? 1.0 : parts.front().factor;
  return std::isfinite(check + shape.factors[term]);
}

}  // namespace

void state_bound(FlatProblem& flat, const BoundStatement& bound) {
  const double slope = bound.slope;
  if (slope == 0.0) {
    const double by = bound.equality ? std::abs(bound.offset) : -bound.offset;
    if (by > 1e-9 * std::max(1.0, std::abs(bound.offset))) {
      note_impossible(flat, bound.number, by);
    }
    return;
  }
  const auto i = static_cast<std::size_t>(bound.variable);
  const double at = -bound.offset / slope;
  if ((bound.equality || slope > 0.0) && at >= flat.lower[i]) {
    flat.lower[i] = at;
    flat.lower_from[i] = bound.number;
    flat.lower_slope[i] = slope;
  }
  if ((bound.equality || slope < 0.0) && at <= flat.upper[i]) {
    flat.upper[i] = at;
    flat.upper_from[i] = bound.number;
    flat.upper_slope[i] = slope;
  }
  const double crossed = flat.lower[i] - flat.upper[i];
  if (crossed > 0.0) {
    if (crossed > 1e-9 * std::max(1.0, std::abs(flat.lower[i]))) {
      note_impossible(flat, bound.number, crossed);
    }
    flat.lower[i] = flat.upper[i];
  }
}

bool renew_numbers(const ExpressionGraph& graph, const Expression& cost,
                   const Constraints& constraints, FlatProblem& flat) {
  if (flat.structure_is_parametric) {
    return false;
  }
  flat.impossible = -1;
  for (const std::uint32_t i : flat.parametric_nodes) {
    flat.numbers[i] = number_of(graph, i, flat.numbers);
  }
  std::vector<Part> stack;
  std::vector<Part> parts;
  bool is_finite = true;
  if (flat.cost_is_parametric) {
    std::fill(flat.cost_coefficients.begin(), flat.cost_coefficients.end(), 0.0);
    flat.cost_offset = 0.0;
    std::size_t next = 0;
    take_apart(
        graph, flat.numbers, stack, Part{cost.node(), flat.sign}, flat.cost_offset,
        [&](int variable, double c) {
          flat.cost_coefficients[static_cast<std::size_t>(variable)] += c;
          is_finite = is_finite && std::isfinite(c);
        },
        [&](const Part& part) {
          const FlatProblem::Term& at = flat.cost_terms[next++];
          parts.assign(1, part);
          is_finite = renew_term(flat, at.shape, at.term, parts) && is_finite;
        });
    is_finite = is_finite && std::isfinite(flat.cost_offset);
  }
  std::vector<int> place(flat.parametric.empty() ? 0 : static_cast<std::size_t>(flat.variables));
  bool bounds_changed = false;
  for (const ParametricConstraint& at : flat.parametric) {
    const std::uint32_t root = constraints[static_cast<std::size_t>(at.number)].value.node();
    double offset = 0.0;
    parts.clear();
    const auto keep = [&](const Part& part) { parts.push_back(part); };
    if (at.row < 0) {
      double slope = 0.0;
      take_apart(
          graph, flat.numbers, stack, Part{root, 1.0}, offset,
          [&](int /*variable*/, double c) { slope += c; }, keep);
      flat.bounds[at.bound].slope = slope;
      flat.bounds[at.bound].offset = offset;
      bounds_changed = true;
      is_finite = is_finite && std::isfinite(slope + offset);
      continue;
    }
    const auto row = static_cast<std::size_t>(at.row);
    for (int e = flat.row_start[row]; e < flat.row_start[row + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      place[static_cast<std::size_t>(flat.columns[entry])] = e;
      flat.coefficients[entry] = 0.0;
    }
    take_apart(
        graph, flat.numbers, stack, Part{root, 1.0}, offset,
        [&](int variable, double c) {
          const int e = place[static_cast<std::size_t>(variable)];
          flat.coefficients[static_cast<std::size_t>(e)] += c;
          is_finite = is_finite && std::isfinite(c);
        },
        keep);
    flat.offsets[row] = offset;
    is_finite = is_finite && std::isfinite(offset);
    if (at.shape >= 0) {
      is_finite = renew_term(flat, static_cast<std::size_t>(at.shape), at.term, parts) && is_finite;
    }
  }
  if (bounds_changed) {
    std::fill(flat.lower.begin(), flat.lower.end(), -infinity);
    std::fill(flat.upper.begin(), flat.upper.end(), infinity);
    std::fill(flat.lower_from.begin(), flat.lower_from.end(), -1);
    std::fill(flat.upper_from.begin(), flat.upper_from.end(), -1);
    for (const BoundStatement& bound : flat.bounds) {
      state_bound(flat, bound);
    }
  }
  return is_finite && flat.impossible < 0;
}

}  // namespace flyball::optimization::detail
