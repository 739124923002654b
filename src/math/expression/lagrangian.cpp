#include <flyball/math/expression/lagrangian.hpp>

#include <map>
#include <optional>
#include <utility>

namespace flyball::expression {

namespace {

using Term = std::optional<Slot>;  // nothing: a structural zero
using Terms = std::vector<std::vector<Term>>;

Term plus(TapeBuilder& builder, Term a, Term b) {
  return a && b ? Term(builder.binary(Operation::add, *a, *b)) : a ? a : b;
}
Term times(TapeBuilder& builder, Term a, Term b) {
  return a && b ? Term(builder.binary(Operation::multiply, *a, *b)) : std::nullopt;
}

std::vector<Slot> all_parameters(TapeBuilder& builder, const Tape& tape) {
  std::vector<Slot> slots;
  for (std::size_t k = 0; k < tape.parameters(); ++k) {
    slots.push_back(builder.parameter(k));
  }
  return slots;
}

std::vector<Slot> all_inputs(TapeBuilder& builder, std::size_t count) {
  std::vector<Slot> slots;
  for (std::size_t k = 0; k < count; ++k) {
    slots.push_back(builder.input(k));
  }
  return slots;
}

/// What a Lagrangian's tape computes at some point, sorted.
struct Parts {
  std::vector<Slot> values;
  Terms jacobian;  // rows x columns
  Terms hessian;   // columns x columns, the lower triangle
};

Parts parts_at(TapeBuilder& builder, const Lagrangian& f, std::span<const Slot> inputs) {
  const std::vector<Slot> out = replay(builder, f.tape, inputs, all_parameters(builder, f.tape));
  Parts parts{{out.begin(), out.begin() + static_cast<std::ptrdiff_t>(f.rows)},
              Terms(f.rows, std::vector<Term>(f.columns)),
              Terms(f.columns, std::vector<Term>(f.columns))};
  for (std::size_t k = 0; k < f.jacobian.size(); ++k) {
    parts.jacobian[f.jacobian[k].row][f.jacobian[k].column] = out[f.rows + k];
  }
  for (std::size_t k = 0; k < f.hessian.size(); ++k) {
    parts.hessian[f.hessian[k].row][f.hessian[k].column] = out[f.rows + f.jacobian.size() + k];
  }
  return parts;
}

/// The tape of the parts; `result` has its sizes.
Lagrangian finish(const TapeBuilder& builder, Lagrangian result, const Parts& parts) {
  std::vector<Slot> outputs = parts.values;
  const auto is_zero = [&](const Term& term) {
    return !term || builder.constant_value(*term) == 0.0;
  };
  for (std::size_t i = 0; i < result.rows; ++i) {
    for (std::size_t j = 0; j < result.columns; ++j) {
      if (!is_zero(parts.jacobian[i][j])) {
        result.jacobian.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
        outputs.push_back(*parts.jacobian[i][j]);
      }
    }
  }
  for (std::size_t i = 0; i < result.columns; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      if (!is_zero(parts.hessian[i][j])) {
        result.hessian.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
        outputs.push_back(*parts.hessian[i][j]);
      }
    }
  }
  result.tape = builder.finish(outputs);
  return result;
}

}  // namespace

std::vector<Slot> replay(TapeBuilder& builder, const Tape& tape, std::span<const Slot> inputs,
                         std::span<const Slot> parameters) {
  std::vector<Slot> slots;
  slots.reserve(tape.size());
  for (Node node : tape.nodes()) {
    if (node.operation == Operation::input) {
      slots.push_back(inputs[node.a]);
      continue;
    }
    if (node.operation == Operation::parameter) {
      slots.push_back(parameters[node.a]);
      continue;
    }
    const int operands = operand_count(node.operation);
    node.a = operands > 0 ? slots[node.a].index : node.a;
    node.b = operands > 1 ? slots[node.b].index : node.b;
    node.c = operands > 2 ? slots[node.c].index : node.c;
    slots.push_back(builder.node(node));
  }
  std::vector<Slot> outputs;
  for (const Slot output : tape.output_slots()) {
    outputs.push_back(slots[output.index]);
  }
  return outputs;
}

Lagrangian lagrangian(const Tape& function, std::size_t variables) {
  Lagrangian result;
  result.rows = function.outputs();
  result.columns = variables;
  result.others = function.inputs() - variables;
  const std::size_t inputs = function.inputs();
  std::vector<Slot> columns;

  // ∂(μᵀy)/∂v against the tape, then its derivatives along it.
  TapeBuilder sum(inputs + result.rows, function.parameters());
  const std::vector<Slot> y =
      replay(sum, function, all_inputs(sum, inputs), all_parameters(sum, function));
  Term total;
  for (std::size_t i = 0; i < result.rows; ++i) {
    total = plus(sum, total, sum.binary(Operation::multiply, sum.input(inputs + i), y[i]));
  }
  const Slot weighted = total ? *total : sum.constant(0.0);
  const Tape scalar = sum.finish({&weighted, 1});
  for (std::size_t k = 0; k < variables; ++k) {
    columns.push_back(scalar.input_slot(k));
  }
  const Derivatives gradient = differentiate(scalar, columns, Accumulation::reverse);
  TapeBuilder slopes(inputs + result.rows, function.parameters());
  std::vector<Slot> gradient_slots =
      replay(slopes, gradient.tape, all_inputs(slopes, inputs + result.rows),
             all_parameters(slopes, function));
  gradient_slots.erase(gradient_slots.begin());
  const Tape gradient_tape = slopes.finish(gradient_slots);
  columns.clear();
  for (std::size_t k = 0; k < variables; ++k) {
    columns.push_back(gradient_tape.input_slot(k));
  }
  const Derivatives bends = differentiate(gradient_tape, columns, Accumulation::forward);

  columns.clear();
  for (std::size_t k = 0; k < variables; ++k) {
    columns.push_back(function.input_slot(k));
  }
  const Derivatives jacobian = differentiate(function, columns, Accumulation::forward);

  TapeBuilder builder(inputs + result.rows, function.parameters());
  const std::vector<Slot> in = all_inputs(builder, inputs + result.rows);
  const std::vector<Slot> parameters = all_parameters(builder, function);
  const std::vector<Slot> first = replay(builder, jacobian.tape, in, parameters);
  const std::vector<Slot> second = replay(builder, bends.tape, in, parameters);
  Parts parts{{first.begin(), first.begin() + static_cast<std::ptrdiff_t>(result.rows)},
              Terms(result.rows, std::vector<Term>(variables)),
              Terms(variables, std::vector<Term>(variables))};
  for (std::size_t k = 0; k < jacobian.entries.size(); ++k) {
    parts.jacobian[jacobian.entries[k].row][jacobian.entries[k].column] = first[result.rows + k];
  }
  for (std::size_t k = 0; k < bends.entries.size(); ++k) {
    const std::size_t row = gradient.entries[bends.entries[k].row].column;
    const std::size_t column = bends.entries[k].column;
    if (row >= column) {
      parts.hessian[row][column] = second[bends.rows + k];
    }
  }
  return finish(builder, std::move(result), parts);
}

Lagrangian stack(std::span<const Lagrangian> functions) {
  Lagrangian result;
  std::size_t parameters = 0;
  for (const Lagrangian& f : functions) {
    result.rows += f.rows;
    result.columns = std::max(result.columns, f.columns);
    result.others = std::max(result.others, f.others);
    parameters = std::max(parameters, f.tape.parameters());
  }
  const std::size_t inputs = result.columns + result.others;
  TapeBuilder builder(inputs + result.rows, parameters);
  Parts parts{{}, {}, Terms(result.columns, std::vector<Term>(result.columns))};
  for (const Lagrangian& f : functions) {
    std::vector<Slot> in = all_inputs(builder, f.columns + f.others);
    for (std::size_t i = 0; i < f.rows; ++i) {
      in.push_back(builder.input(inputs + parts.values.size() + i));
    }
    Parts own = parts_at(builder, f, in);
    parts.values.insert(parts.values.end(), own.values.begin(), own.values.end());
    for (std::vector<Term>& row : own.jacobian) {
      row.resize(result.columns);
      parts.jacobian.push_back(std::move(row));
    }
    for (std::size_t i = 0; i < f.columns; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        parts.hessian[i][j] = plus(builder, parts.hessian[i][j], own.hessian[i][j]);
      }
    }
  }
  return finish(builder, std::move(result), parts);
}

Lagrangian runge_kutta_step(const Lagrangian& f, const ButcherTableauView& tableau, double step) {
  const std::size_t n = f.rows;
  const std::size_t columns = f.columns;
  const std::size_t inputs = columns + f.others;
  const std::size_t stages = tableau.stages;
  TapeBuilder builder(inputs + n, f.tape.parameters());
  const std::vector<Slot> v = all_inputs(builder, inputs);
  const auto scaled = [&](double factor, Term term) -> Term {
    return factor == 0.0 ? std::nullopt : times(builder, builder.constant(factor), term);
  };

  // Forward: kᵢ, Wᵢ = ∂(point of stage i)/∂v and ∂kᵢ/∂v = Jᵢ Wᵢ. Only the first n rows of Wᵢ are
  // not those of the identity.
  const Slot zero = builder.constant(0.0);
  std::vector<std::vector<Slot>> points(stages);
  std::vector<Parts> k(stages);
  std::vector<Terms> W(stages), slopes(stages);
  const auto identity = [&](std::size_t i, std::size_t j) -> Term {
    return i == j ? Term(builder.constant(1.0)) : std::nullopt;
  };
  const auto combine = [&](std::size_t stage_count, auto&& weight, std::size_t i) {
    std::pair<Term, std::vector<Term>> sum{Term(v[i]), std::vector<Term>(columns)};
    for (std::size_t column = 0; column < columns; ++column) {
      sum.second[column] = identity(i, column);
    }
    for (std::size_t s = 0; s < stage_count; ++s) {
      const double h = step * weight(s);
      sum.first = plus(builder, sum.first, scaled(h, k[s].values[i]));
      for (std::size_t column = 0; column < columns; ++column) {
        sum.second[column] = plus(builder, sum.second[column], scaled(h, slopes[s][i][column]));
      }
    }
    return sum;
  };
  for (std::size_t s = 0; s < stages; ++s) {
    points[s] = v;
    W[s].assign(columns, std::vector<Term>(columns));
    for (std::size_t i = 0; i < columns; ++i) {
      if (i < n) {
        auto [value, row] = combine(s, [&](std::size_t j) { return tableau.A[s * stages + j]; }, i);
        points[s][i] = *value;
        W[s][i] = std::move(row);
      } else {
        W[s][i][i] = identity(i, i);
      }
    }
    std::vector<Slot> in = points[s];
    in.resize(inputs + n, zero);
    k[s] = parts_at(builder, f, in);
    slopes[s].assign(n, std::vector<Term>(columns));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t column = 0; column < columns; ++column) {
        Term sum;
        for (std::size_t j = 0; j < columns; ++j) {
          sum = plus(builder, sum, times(builder, k[s].jacobian[i][j], W[s][j][column]));
        }
        slopes[s][i][column] = sum;
      }
    }
  }
  Parts parts{{}, {}, Terms(columns, std::vector<Term>(columns))};
  for (std::size_t i = 0; i < n; ++i) {
    auto [value, row] = combine(stages, [&](std::size_t s) { return tableau.b[s]; }, i);
    parts.values.push_back(*value);
    parts.jacobian.push_back(std::move(row));
  }

  // Backward: the adjoints of the kᵢ, and what each stage adds to the Hessian.
  std::vector<std::vector<Term>> adjoint(stages, std::vector<Term>(n));
  for (std::size_t s = stages; s-- > 0;) {
    std::vector<Slot> in = points[s];
    for (std::size_t i = 0; i < n; ++i) {
      Term sum = scaled(step * tableau.b[s], builder.input(inputs + i));
      for (std::size_t t = s + 1; t < stages; ++t) {
        const double h = step * tableau.A[t * stages + s];
        for (std::size_t j = 0; j < n && h != 0.0; ++j) {
          sum = plus(builder, sum, scaled(h, times(builder, k[t].jacobian[j][i], adjoint[t][j])));
        }
      }
      adjoint[s][i] = sum;
      in.push_back(sum ? *sum : zero);
    }
    const Terms bend = parts_at(builder, f, in).hessian;
    const auto entry = [&](std::size_t i, std::size_t j) {
      return i >= j ? bend[i][j] : bend[j][i];
    };
    for (std::size_t column = 0; column < columns; ++column) {
      std::vector<Term> bent(columns);  // Hᵢ Wᵢ, one column
      for (std::size_t i = 0; i < columns; ++i) {
        for (std::size_t j = 0; j < columns; ++j) {
          bent[i] = plus(builder, bent[i], times(builder, entry(i, j), W[s][j][column]));
        }
      }
      for (std::size_t row = column; row < columns; ++row) {
        for (std::size_t i = 0; i < columns; ++i) {
          parts.hessian[row][column] =
              plus(builder, parts.hessian[row][column], times(builder, W[s][i][row], bent[i]));
        }
      }
    }
  }
  Lagrangian result;
  result.rows = n;
  result.columns = columns;
  result.others = f.others;
  return finish(builder, std::move(result), parts);
}

Tape values_of(const Lagrangian& function) {
  const std::size_t inputs = function.columns + function.others;
  TapeBuilder builder(inputs, function.tape.parameters());
  std::vector<Slot> in = all_inputs(builder, inputs);
  in.resize(inputs + function.rows, builder.constant(0.0));
  std::vector<Slot> out =
      replay(builder, function.tape, in, all_parameters(builder, function.tape));
  out.resize(function.rows);
  return builder.finish(out);
}

}  // namespace flyball::expression
