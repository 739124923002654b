#include <flyball/optimization/ocp/continuous_problem.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "optimization/ocp/continuous_data.hpp"

namespace flyball::optimization {

using detail::ContinuousData;
using detail::ContinuousPhase;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using VectorRef = Eigen::Ref<const VectorXd>;

namespace {

constexpr int largest_size = 200;
constexpr int most_phases = 1000;

void refuse(ContinuousData& data, Error error) {
  if (!data.error) {
    data.error = std::move(error).in("optimal control");
  }
}

bool has_size(ContinuousData& data, Index got, Index wanted, std::string_view what) {
  if (got != wanted) {
    refuse(data, Error(ArgumentError::wrong_shape)
                     .about(std::string(what))
                     .expected(flyball::detail::format("{} entries", wanted))
                     .got(flyball::detail::format("{} entries", got)));
  }
  return got == wanted;
}

bool are_bounds(ContinuousData& data, const VectorRef& lower, const VectorRef& upper, Index count,
                std::string_view what) {
  if (!has_size(data, lower.size(), count,
                flyball::detail::format("the lower bound of {}", what)) ||
      !has_size(data, upper.size(), count,
                flyball::detail::format("the upper bound of {}", what))) {
    return false;
  }
  for (Index i = 0; i < count; ++i) {
    if (!(lower(i) <= upper(i)) || lower(i) == infinity || upper(i) == -infinity) {
      refuse(data, Error(ArgumentError::out_of_range)
                       .about(flyball::detail::format("the bounds of {}, entry {}", what, i))
                       .expected("a lower bound that is not above the upper one")
                       .got(flyball::detail::format("{} to {}", lower(i), upper(i))));
      return false;
    }
  }
  return true;
}

}  // namespace

namespace detail {

ExpressionVector replay(const expression::Tape& tape, const ExpressionVector& x,
                        const ExpressionVector& u, const ExpressionVector& T) {
  using expression::Operation;
  std::vector<Expression> inputs;
  for (const ExpressionVector* v : {&x, &u, &T}) {
    inputs.insert(inputs.end(), v->begin(), v->end());
  }
  ExpressionGraph* graph = nullptr;
  for (const Expression& e : inputs) {
    graph = graph != nullptr ? graph : e.graph();
  }
  std::vector<Expression> values;
  values.reserve(tape.size());
  const auto node_of = [&](const Expression& e) {
    return e.is_constant() ? graph->constant(e.constant()) : e.node();
  };
  std::size_t next_input = 0;
  for (const expression::Node& node : tape.nodes()) {
    const int operands = expression::operand_count(node.operation);
    if (node.operation == Operation::constant) {
      values.emplace_back(node.value());
      continue;
    }
    if (node.operation == Operation::input) {
      values.push_back(next_input < inputs.size() ? inputs[next_input] : Expression(0.0));
      ++next_input;
      continue;
    }
    const Expression a = operands > 0 ? values[node.a] : Expression(0.0);
    const Expression b = operands > 1 ? values[node.b] : Expression(0.0);
    const Expression c = operands > 2 ? values[node.c] : Expression(0.0);
    if (a.is_constant() && b.is_constant() && c.is_constant()) {
      values.emplace_back(
          expression::apply<double>(node.operation, a.constant(), b.constant(), c.constant()));
      continue;
    }
    switch (node.operation) {
      case Operation::add:
        values.push_back(a + b);
        break;
      case Operation::subtract:
        values.push_back(a - b);
        break;
      case Operation::multiply:
        values.push_back(a * b);
        break;
      case Operation::divide:
        values.push_back(a / b);
        break;
      default:
        values.emplace_back(graph, operands == 1 ? graph->unary(node.operation, node_of(a))
                                   : operands == 2
                                       ? graph->binary(node.operation, node_of(a), node_of(b))
                                       : graph->select(node_of(a), node_of(b), node_of(c)));
    }
  }
  ExpressionVector result(static_cast<Index>(tape.outputs()));
  Index i = 0;
  for (const expression::Slot slot : tape.output_slots()) {
    result(i++) = values[slot.index];
  }
  return result;
}

}  // namespace detail

ContinuousProblem::ContinuousProblem(int states, int inputs, int phases)
    : data_(std::make_unique<ContinuousData>()) {
  ContinuousData& d = *data_;
  for (const auto& [value, name, least, most] : {std::tuple{states, "states", 1, largest_size},
                                                 std::tuple{inputs, "inputs", 0, largest_size},
                                                 std::tuple{phases, "phases", 1, most_phases}}) {
    if (value < least || value > most) {
      refuse(d, Error(ArgumentError::out_of_range)
                    .about(flyball::detail::format("the number of {}", name))
                    .expected(flyball::detail::format("{} to {}", least, most))
                    .got(flyball::detail::format("{}", value)));
      return;
    }
  }
  d.states = states;
  d.inputs = inputs;
  d.start = VectorXd::Constant(states, std::numeric_limits<double>::quiet_NaN());
  ContinuousPhase phase;
  phase.state_lower = VectorXd::Constant(states, -infinity);
  phase.state_upper = VectorXd::Constant(states, infinity);
  phase.input_lower = VectorXd::Constant(inputs, -infinity);
  phase.input_upper = VectorXd::Constant(inputs, infinity);
  phase.end = d.start;
  d.phases.assign(static_cast<std::size_t>(phases), phase);
}

ContinuousProblem::ContinuousProblem(const ContinuousProblem& other)
    : data_(std::make_unique<ContinuousData>(*other.data_)) {}
ContinuousProblem::ContinuousProblem(ContinuousProblem&&) noexcept = default;
ContinuousProblem& ContinuousProblem::operator=(const ContinuousProblem& other) {
  if (this != &other) {
    data_ = std::make_unique<ContinuousData>(*other.data_);
  }
  return *this;
}
ContinuousProblem& ContinuousProblem::operator=(ContinuousProblem&&) noexcept = default;
ContinuousProblem::~ContinuousProblem() = default;

int ContinuousProblem::states() const noexcept {
  return data_->states;
}
int ContinuousProblem::inputs() const noexcept {
  return data_->inputs;
}
int ContinuousProblem::phases() const noexcept {
  return static_cast<int>(data_->phases.size());
}

std::pair<int, int> ContinuousProblem::range(int phase, std::string_view what) {
  if (data_->error) {
    return {0, 0};
  }
  if (phase < -1 || phase >= phases()) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about(flyball::detail::format("the phase of {}", what))
                       .expected(flyball::detail::format("0 to {}, or -1 for all", phases() - 1))
                       .got(flyball::detail::format("{}", phase)));
    return {0, 0};
  }
  return phase < 0 ? std::pair{0, phases()} : std::pair{phase, phase + 1};
}

expression::Tape ContinuousProblem::record(detail::StageFunction f, int rows,
                                           std::string_view what) {
  detail::ExpressionGraph graph;
  ExpressionVector x(data_->states), u(data_->inputs), T(phases()), nothing;
  for (ExpressionVector* v : {&x, &u, &T}) {
    for (Expression& e : *v) {
      e = Expression(&graph, graph.input());
    }
  }
  std::vector<Expression> out;
  f(x, u, T, nothing, out);
  if (rows >= 0) {
    (void)has_size(*data_, static_cast<Index>(out.size()), rows, what);
  }
  std::vector<std::uint32_t> nodes;
  for (const Expression& y : out) {
    nodes.push_back(y.is_constant() ? graph.constant(y.constant()) : y.node());
  }
  return graph.tape(nodes);
}

void ContinuousProblem::take_derivative(const expression::Tape& f, int phase) {
  const auto [first, end] = range(phase, "the derivative");
  if (!has_size(*data_, static_cast<Index>(f.outputs()), data_->states,
                "what the derivative returns")) {
    return;
  }
  if (f.parameters() != 0 || f.inputs() > static_cast<std::size_t>(data_->states + data_->inputs)) {
    refuse(*data_, Error(ArgumentError::wrong_shape)
                       .about("the derivative's tape")
                       .expected("one of the states and inputs alone, its parameters made numbers")
                       .got(flyball::detail::format("one of {} inputs and {} parameters",
                                                    f.inputs(), f.parameters())));
    return;
  }
  for (int i = first; i < end; ++i) {
    data_->phases[static_cast<std::size_t>(i)].derivative = f;
  }
}

void ContinuousProblem::record_derivative(detail::StageFunction f, int phase) {
  const auto [first, end] = range(phase, "the derivative");
  for (int i = first; i < end; ++i) {
    data_->phases[static_cast<std::size_t>(i)].derivative =
        i == first ? record(f, data_->states, "what the derivative returns")
                   : data_->phases[static_cast<std::size_t>(first)].derivative;
  }
}

void ContinuousProblem::record_running_cost(detail::StageFunction f, int phase) {
  const auto [first, end] = range(phase, "the running cost");
  for (int i = first; i < end; ++i) {
    data_->phases[static_cast<std::size_t>(i)].running_cost = record(f, 1, "the running cost");
  }
}

void ContinuousProblem::record_final_cost(detail::StageFunction f) {
  data_->final_cost = record(f, 1, "the final cost");
}

void ContinuousProblem::record_path(detail::StageFunction g, const VectorRef& lower,
                                    const VectorRef& upper, std::string name, int phase) {
  const auto [first, end] = range(phase, "a path constraint");
  if (name.empty()) {
    name = "path constraint";
  }
  for (int i = first; i < end; ++i) {
    expression::Tape tape = record(g, -1, name);
    if (are_bounds(*data_, lower, upper, static_cast<Index>(tape.outputs()), name)) {
      data_->phases[static_cast<std::size_t>(i)].path.push_back(
          {std::move(tape), lower, upper, name});
    }
  }
}

void ContinuousProblem::record_end(detail::StageFunction g, const VectorRef& lower,
                                   const VectorRef& upper, int phase, End where, std::string name) {
  const auto [first, end] = range(phase, "an end constraint");
  if (name.empty()) {
    name = "end constraint";
  }
  for (int i = first; i < end; ++i) {
    expression::Tape tape = record(g, -1, name);
    if (are_bounds(*data_, lower, upper, static_cast<Index>(tape.outputs()), name)) {
      ContinuousPhase& p = data_->phases[static_cast<std::size_t>(i)];
      (where == End::start ? p.start_rows : p.end_rows)
          .push_back({std::move(tape), lower, upper, name});
    }
  }
}

void ContinuousProblem::record_jump(detail::StageFunction j, int phase) {
  if (phase < 1 || phase >= phases()) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the phase of a jump")
                       .expected(flyball::detail::format("1 to {}", phases() - 1))
                       .got(flyball::detail::format("{}", phase)));
    return;
  }
  data_->phases[static_cast<std::size_t>(phase)].jump =
      record(j, data_->states, "what the jump returns");
}

void ContinuousProblem::keep_out(int i, int j, const Eigen::Vector2d& center, double radius,
                                 std::string name, int phase) {
  if (i < 0 || j < 0 || i >= states() || j >= states()) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the states that an obstacle keeps out")
                       .expected(flyball::detail::format("0 to {}", states() - 1))
                       .got(flyball::detail::format("{} and {}", i, j)));
    return;
  }
  if (!(radius > 0.0) || !std::isfinite(radius) || !center.allFinite()) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("an obstacle")
                       .expected("a finite centre and a positive radius")
                       .got(flyball::detail::format("({}, {}), {}", center(0), center(1), radius)));
    return;
  }
  add_path_constraint(
      [&](const auto& x) {
        const auto a = x(i) - center(0);
        const auto b = x(j) - center(1);
        return (a * a + b * b) / (radius * radius);
      },
      VectorXd::Constant(1, 1.0), VectorXd::Constant(1, infinity),
      name.empty() ? std::string("obstacle") : std::move(name), phase);
}

void ContinuousProblem::bound_states(const VectorRef& lower, const VectorRef& upper, int phase) {
  const auto [first, end] = range(phase, "the states' bounds");
  if (are_bounds(*data_, lower, upper, data_->states, "the states")) {
    for (int i = first; i < end; ++i) {
      data_->phases[static_cast<std::size_t>(i)].state_lower = lower;
      data_->phases[static_cast<std::size_t>(i)].state_upper = upper;
    }
  }
}

void ContinuousProblem::bound_inputs(const VectorRef& lower, const VectorRef& upper, int phase) {
  const auto [first, end] = range(phase, "the inputs' bounds");
  if (are_bounds(*data_, lower, upper, data_->inputs, "the inputs")) {
    for (int i = first; i < end; ++i) {
      data_->phases[static_cast<std::size_t>(i)].input_lower = lower;
      data_->phases[static_cast<std::size_t>(i)].input_upper = upper;
    }
  }
}

void ContinuousProblem::fix_start(const VectorRef& state) {
  if (has_size(*data_, state.size(), data_->states, "the start")) {
    if (state.array().isInf().any()) {
      refuse(*data_, Error(ArgumentError::not_finite).about("the start"));
    }
    data_->start = state;
  }
}

void ContinuousProblem::fix_end(const VectorRef& state, int phase) {
  const auto [first, end] = range(phase < 0 ? phases() - 1 : phase, "an end to fix");
  if (has_size(*data_, state.size(), data_->states, "the end") && end > first) {
    if (state.array().isInf().any()) {
      refuse(*data_, Error(ArgumentError::not_finite).about("the end"));
    }
    data_->phases[static_cast<std::size_t>(first)].end = state;
  }
}

void ContinuousProblem::set_duration(double seconds, int phase) {
  free_duration(seconds, seconds, seconds, phase);
}

void ContinuousProblem::free_duration(double least, double most, double guess, int phase) {
  const auto [first, end] = range(phase, "a duration");
  if (!(least > 0.0 && least <= most) || !std::isfinite(most)) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("a phase's duration")
                       .expected("bounds that are positive, finite and in order, in seconds")
                       .got(flyball::detail::format("{} to {}", least, most)));
    return;
  }
  for (int i = first; i < end; ++i) {
    ContinuousPhase& p = data_->phases[static_cast<std::size_t>(i)];
    p.least = least;
    p.most = most;
    p.guess = std::isfinite(guess) ? std::clamp(guess, least, most) : 0.5 * (least + most);
    p.shared_with = -1;
  }
}

void ContinuousProblem::share_duration(int phase, int other) {
  if (other < 0 || phase <= other || phase >= phases()) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the phases that share a duration")
                       .expected("a phase, and one before it")
                       .got(flyball::detail::format("{} and {}", phase, other)));
    return;
  }
  const int root = data_->phases[static_cast<std::size_t>(other)].shared_with;
  data_->phases[static_cast<std::size_t>(phase)].shared_with = root >= 0 ? root : other;
}

void ContinuousProblem::minimize_time(double weight) {
  if (!(weight >= 0.0) || !std::isfinite(weight)) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the weight of time")
                       .expected("a finite number that is not negative")
                       .got(flyball::detail::format("{}", weight)));
    return;
  }
  data_->time_weight = weight;
}

void ContinuousProblem::set_guess(const VectorRef& shares, const Eigen::Ref<const MatrixXd>& states,
                                  const Eigen::Ref<const MatrixXd>& inputs, int phase) {
  const auto [first, end] = range(phase, "a guess");
  const bool ordered = [&] {
    for (Index i = 0; i + 1 < shares.size(); ++i) {
      if (!(shares(i) < shares(i + 1))) {
        return false;
      }
    }
    return shares.size() >= 2;
  }();
  const bool with_inputs = inputs.size() > 0;
  if (!ordered || !shares.allFinite() || !states.allFinite() ||
      (with_inputs && !inputs.allFinite()) || states.rows() != data_->states ||
      states.cols() != shares.size() ||
      (with_inputs && (inputs.rows() != data_->inputs || inputs.cols() != shares.size()))) {
    refuse(*data_, Error(ArgumentError::wrong_shape)
                       .about("a guess")
                       .expected(flyball::detail::format(
                           "two or more rising shares, finite states {} x shares "
                           "and inputs {} x shares",
                           data_->states, data_->inputs))
                       .got(flyball::detail::format("{} shares, states {} x {}, inputs {} x {}",
                                                    shares.size(), states.rows(), states.cols(),
                                                    inputs.rows(), inputs.cols())));
    return;
  }
  for (int i = first; i < end; ++i) {
    ContinuousPhase& p = data_->phases[static_cast<std::size_t>(i)];
    p.guess_shares = shares;
    p.guess_states = states;
    p.guess_inputs = with_inputs ? MatrixXd(inputs) : MatrixXd::Zero(data_->inputs, shares.size());
  }
}

}  // namespace flyball::optimization
