#include <cmath>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "optimization/ocp/optimal_control_data.hpp"
#include "optimization/solver/kept_memory.hpp"

namespace flyball::optimization {

using detail::OptimalControlData;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using expression::Lagrangian;
using VectorRef = Eigen::Ref<const VectorXd>;

namespace {

constexpr int most_entries = 1000;
constexpr int most_intervals = 10'000'000;

constexpr ButcherTableau<4> runge_kutta_4{
    .A = {{{0.0, 0.0, 0.0, 0.0}, {0.5, 0.0, 0.0, 0.0}, {0.0, 0.5, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}}},
    .b = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0},
    .c = {0.0, 0.5, 0.5, 1.0},
    .order = 4};

void refuse(OptimalControlData& data, Error error) {
  if (!data.error) {
    data.error = std::move(error).in("optimal control");
  }
}

/// What a function computes of z = (x, p, u) and d, as expressions of a graph of its own.
struct Recording {
  detail::ExpressionGraph graph{};
  ExpressionVector x{}, p{}, u{}, d{};
  std::vector<Expression> out{};

  explicit Recording(const OptimalControlData& data) {
    const auto variables = [&](ExpressionVector& v, int count) {
      v.resize(count);
      for (int i = 0; i < count; ++i) {
        v(i) = Expression(&graph, graph.input());
      }
    };
    variables(x, data.states);
    variables(p, data.parameters);
    variables(u, data.inputs);
    variables(d, data.data_size);
  }

  /// The outputs and their derivatives by z.
  [[nodiscard]] Lagrangian lagrangian(const OptimalControlData& data) {
    std::vector<std::uint32_t> nodes;
    for (const Expression& y : out) {
      nodes.push_back(y.is_constant() ? graph.constant(y.constant()) : y.node());
    }
    return expression::lagrangian(graph.tape(nodes), static_cast<std::size_t>(data.size()));
  }
};

bool has_size(OptimalControlData& data, std::size_t got, std::size_t wanted,
              std::string_view name) {
  if (got == wanted) {
    return true;
  }
  refuse(data, Error(ArgumentError::wrong_shape)
                   .about(std::string(name))
                   .expected(flyball::detail::format("{} entries", wanted))
                   .got(flyball::detail::format("{} entries", got)));
  return false;
}

/// Bounds of consecutive rows at one stage, or at all.
void set_bounds(OptimalControlData& data, Index first, Index count, int stage,
                const VectorRef& lower, const VectorRef& upper, std::string_view name) {
  if (data.error ||
      !has_size(data, static_cast<std::size_t>(lower.size()), static_cast<std::size_t>(count),
                name) ||
      !has_size(data, static_cast<std::size_t>(upper.size()), static_cast<std::size_t>(count),
                name)) {
    return;
  }
  if (stage < -1 || stage > data.intervals) {
    refuse(data, Error(ArgumentError::out_of_range)
                     .about(flyball::detail::format("the stage of the bounds of the {}", name))
                     .expected(flyball::detail::format("0 to {}", data.intervals))
                     .got(flyball::detail::format("{}", stage)));
    return;
  }
  for (Index i = 0; i < count; ++i) {
    if (!(lower(i) <= upper(i)) || lower(i) == infinity || upper(i) == -infinity) {
      refuse(data, Error(ArgumentError::out_of_range)
                       .about(flyball::detail::format("the bounds of {} {}", name, i))
                       .expected("a lower bound that is not above the upper one")
                       .got(flyball::detail::format("{} to {}", lower(i), upper(i))));
      return;
    }
  }
  const Index begin = stage < 0 ? 0 : stage;
  const Index stages = stage < 0 ? data.intervals + 1 : 1;
  data.lower.block(first, begin, count, stages).colwise() = lower;
  data.upper.block(first, begin, count, stages).colwise() = upper;
}

/// Keeps what was recorded for the stages first … last.
void take_piece(OptimalControlData& data, std::optional<Lagrangian>& recorded,
                std::vector<OptimalControlData::Piece>& pieces, int first, int last) {
  if (first < 0 || last < first || last >= data.intervals) {
    refuse(data, Error(ArgumentError::out_of_range)
                     .about("the stages of a function")
                     .expected(flyball::detail::format("within 0 to {}", data.intervals - 1))
                     .got(flyball::detail::format("{} to {}", first, last)));
  } else if (recorded) {
    pieces.push_back({std::move(*recorded), first, last});
  }
}

}  // namespace

OptimalControlProblem::OptimalControlProblem(int states, int inputs, int intervals, int parameters,
                                             int data)
    : data_(std::make_unique<OptimalControlData>()) {
  detail::keep_freed_memory();
  OptimalControlData& d = *data_;
  for (const auto& [value, name, least, most] :
       {std::tuple{states, "states", 1, most_entries},
        std::tuple{inputs, "inputs", 0, most_entries},
        std::tuple{intervals, "intervals", 1, most_intervals},
        std::tuple{parameters, "parameters", 0, most_entries},
        std::tuple{data, "data", 0, most_entries}}) {
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
  d.intervals = intervals;
  d.parameters = parameters;
  d.data_size = data;
  d.lower = MatrixXd::Constant(d.size(), intervals + 1, -infinity);
  d.upper = MatrixXd::Constant(d.size(), intervals + 1, infinity);
  d.start = MatrixXd::Zero(d.size(), intervals + 1);
  d.data = MatrixXd::Zero(data, intervals + 1);
}

OptimalControlProblem::OptimalControlProblem(const OptimalControlProblem& other)
    : data_(std::make_unique<OptimalControlData>(*other.data_)) {}
OptimalControlProblem::OptimalControlProblem(OptimalControlProblem&&) noexcept = default;
OptimalControlProblem& OptimalControlProblem::operator=(const OptimalControlProblem& other) {
  if (this != &other) {
    data_ = std::make_unique<OptimalControlData>(*other.data_);
  }
  return *this;
}
OptimalControlProblem& OptimalControlProblem::operator=(OptimalControlProblem&&) noexcept = default;
OptimalControlProblem::~OptimalControlProblem() = default;

int OptimalControlProblem::states() const noexcept {
  return data_->states;
}
int OptimalControlProblem::inputs() const noexcept {
  return data_->inputs;
}
int OptimalControlProblem::intervals() const noexcept {
  return data_->intervals;
}
int OptimalControlProblem::parameters() const noexcept {
  return data_->parameters;
}
ButcherTableauView OptimalControlProblem::default_method() noexcept {
  return runge_kutta_4;
}

void OptimalControlProblem::record_dynamics(detail::StageFunction f) {
  Recording recording(*data_);
  f(recording.x, recording.u, recording.p, recording.d, recording.out);
  if (!has_size(*data_, recording.out.size(), static_cast<std::size_t>(data_->states),
                "what the dynamics return")) {
    return;
  }
  for (int i = 0; i < data_->parameters; ++i) {
    recording.out.push_back(recording.p(i));
  }
  data_->dynamics = recording.lagrangian(*data_);
}

void OptimalControlProblem::record_derivative(detail::StageFunction f, double duration,
                                              int free_duration, const ButcherTableauView& method) {
  if (free_duration >= data_->parameters || (free_duration < 0 && !(duration > 0.0)) ||
      !std::isfinite(duration)) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the duration")
                       .expected("a positive number, or an entry of the parameters")
                       .got(free_duration >= 0 ? flyball::detail::format("entry {}", free_duration)
                                               : flyball::detail::format("{}", duration)));
    return;
  }
  Recording recording(*data_);
  f(recording.x, recording.u, recording.p, recording.d, recording.out);
  if (!has_size(*data_, recording.out.size(), static_cast<std::size_t>(data_->states),
                "what the derivative returns")) {
    return;
  }
  // Over free time the derivative is taken by the share of the time that has passed.
  double total = duration;
  if (free_duration >= 0) {
    for (Expression& y : recording.out) {
      y = y * recording.p(free_duration);
    }
    total = 1.0;
  }
  for (int i = 0; i < data_->parameters; ++i) {
    recording.out.emplace_back(0.0);
  }
  data_->dynamics =
      expression::runge_kutta_step(recording.lagrangian(*data_), method, total / data_->intervals);
}

void OptimalControlProblem::record_cost(detail::StageFunction f, bool terminal) {
  Recording recording(*data_);
  f(recording.x, recording.u, recording.p, recording.d, recording.out);
  if (has_size(*data_, recording.out.size(), 1,
               terminal ? "the terminal cost" : "the stage cost")) {
    (terminal ? data_->terminal_cost : data_->cost) = recording.lagrangian(*data_);
  }
}

void OptimalControlProblem::record_dynamics_at(detail::StageFunction f, int first, int last) {
  std::optional<Lagrangian> all = std::move(data_->dynamics);
  data_->dynamics.reset();
  record_dynamics(f);
  take_piece(*data_, data_->dynamics, data_->dynamics_at, first, last);
  data_->dynamics = std::move(all);
}

void OptimalControlProblem::record_derivative_at(detail::StageFunction f, double step, int first,
                                                 int last, const ButcherTableauView& method) {
  std::optional<Lagrangian> all = std::move(data_->dynamics);
  data_->dynamics.reset();
  record_derivative(f, step * data_->intervals, -1, method);
  take_piece(*data_, data_->dynamics, data_->dynamics_at, first, last);
  data_->dynamics = std::move(all);
}

void OptimalControlProblem::record_cost_at(detail::StageFunction f, int first, int last) {
  std::optional<Lagrangian> all = std::move(data_->cost);
  data_->cost.reset();
  record_cost(f, false);
  take_piece(*data_, data_->cost, data_->cost_at, first, last);
  data_->cost = std::move(all);
}

void OptimalControlProblem::record_constraint(detail::StageFunction f, const VectorRef& lower,
                                              const VectorRef& upper, int first, int last,
                                              std::string name) {
  Recording recording(*data_);
  f(recording.x, recording.u, recording.p, recording.d, recording.out);
  if (name.empty()) {
    name = flyball::detail::format("constraint {}", data_->rows.size());
  }
  if (!has_size(*data_, static_cast<std::size_t>(lower.size()), recording.out.size(),
                "the lower bound of " + name) ||
      !has_size(*data_, static_cast<std::size_t>(upper.size()), recording.out.size(),
                "the upper bound of " + name)) {
    return;
  }
  if (first < 0 || last < first || last > data_->intervals) {
    refuse(*data_, Error(ArgumentError::out_of_range)
                       .about("the stages of " + name)
                       .expected(flyball::detail::format("within 0 to {}", data_->intervals))
                       .got(flyball::detail::format("{} to {}", first, last)));
    return;
  }
  for (Index i = 0; i < lower.size(); ++i) {
    if (!(lower(i) <= upper(i)) || lower(i) == infinity || upper(i) == -infinity) {
      refuse(*data_, Error(ArgumentError::out_of_range)
                         .about(flyball::detail::format("the bounds of {}, entry {}", name, i))
                         .expected("a lower bound that is not above the upper one")
                         .got(flyball::detail::format("{} to {}", lower(i), upper(i))));
      return;
    }
  }
  data_->rows.push_back({recording.lagrangian(*data_), lower, upper, first, last, std::move(name)});
}

void OptimalControlProblem::bound_states(const VectorRef& lower, const VectorRef& upper) {
  set_bounds(*data_, 0, data_->states, -1, lower, upper, "state");
}
void OptimalControlProblem::bound_inputs(const VectorRef& lower, const VectorRef& upper) {
  set_bounds(*data_, data_->states + data_->parameters, data_->inputs, -1, lower, upper, "input");
}
void OptimalControlProblem::bound_state(int stage, const VectorRef& lower, const VectorRef& upper) {
  set_bounds(*data_, 0, data_->states, std::max(stage, -2) == -1 ? -2 : stage, lower, upper,
             "state");
}
void OptimalControlProblem::bound_input(int stage, const VectorRef& lower, const VectorRef& upper) {
  set_bounds(*data_, data_->states + data_->parameters, data_->inputs,
             stage == -1 || stage >= data_->intervals ? -2 : stage, lower, upper, "input");
}
void OptimalControlProblem::bound_parameters(const VectorRef& lower, const VectorRef& upper) {
  set_bounds(*data_, data_->states, data_->parameters, 0, lower, upper, "parameter");
}

void OptimalControlProblem::fix_state(int stage, const VectorRef& state) {
  if (data_->error || !has_size(*data_, static_cast<std::size_t>(state.size()),
                                static_cast<std::size_t>(data_->states), "the state to fix")) {
    return;
  }
  VectorXd lower = VectorXd::Constant(data_->states, -infinity);
  VectorXd upper = VectorXd::Constant(data_->states, infinity);
  if (stage >= 0 && stage <= data_->intervals) {
    lower = data_->lower.col(stage).head(data_->states);
    upper = data_->upper.col(stage).head(data_->states);
  }
  for (Index i = 0; i < state.size(); ++i) {
    if (std::isinf(state(i))) {
      refuse(*data_,
             Error(ArgumentError::not_finite).about(flyball::detail::format("state {} to fix", i)));
      return;
    }
    if (!std::isnan(state(i))) {
      lower(i) = upper(i) = state(i);
    }
  }
  bound_state(stage, lower, upper);
}

void OptimalControlProblem::set_start(const Eigen::Ref<const MatrixXd>& states,
                                      const Eigen::Ref<const MatrixXd>& inputs) {
  const Checks checks =
      Checks("set_start")
          .shape(states, data_->states, data_->intervals + 1, "states", "states x (N + 1)")
          .shape(inputs, data_->inputs, data_->intervals, "inputs", "inputs x N")
          .finite(states, "states")
          .finite(inputs, "inputs");
  if (!checks) {
    refuse(*data_, checks.error());
    return;
  }
  data_->start.topRows(data_->states) = states;
  data_->start.bottomLeftCorner(data_->inputs, data_->intervals) = inputs;
}

void OptimalControlProblem::set_parameter_start(const VectorRef& parameters) {
  if (has_size(*data_, static_cast<std::size_t>(parameters.size()),
               static_cast<std::size_t>(data_->parameters), "the parameters' start")) {
    data_->start.middleRows(data_->states, data_->parameters).colwise() = parameters;
  }
}

void OptimalControlProblem::set_data(const Eigen::Ref<const MatrixXd>& data) {
  const Checks checks =
      Checks("set_data")
          .shape(data, data_->data_size, data_->intervals + 1, "data", "entries x (N + 1)")
          .finite(data, "data");
  if (!checks) {
    refuse(*data_, checks.error());
    return;
  }
  data_->data = data;
}

}  // namespace flyball::optimization
