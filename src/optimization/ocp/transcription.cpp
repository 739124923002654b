#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "optimization/ocp/transcription.hpp"

namespace flyball::optimization::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

CollocationRule lobatto() {
  return {.shares = {0.0, 0.5, 1.0},
          .has_start = true,
          .a = {{5.0 / 24.0, 1.0 / 3.0, -1.0 / 24.0}, {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0}},
          .b = {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0}};
}

CollocationRule radau() {
  const double r = std::sqrt(6.0);
  return {.shares = {(4.0 - r) / 10.0, (4.0 + r) / 10.0, 1.0},
          .has_start = false,
          .a = {{(88.0 - 7.0 * r) / 360.0, (296.0 - 169.0 * r) / 1800.0, (-2.0 + 3.0 * r) / 225.0},
                {(296.0 + 169.0 * r) / 1800.0, (88.0 + 7.0 * r) / 360.0, (-2.0 - 3.0 * r) / 225.0},
                {(16.0 - r) / 36.0, (16.0 + r) / 36.0, 1.0 / 9.0}},
          .b = {(16.0 - r) / 36.0, (16.0 + r) / 36.0, 1.0 / 9.0}};
}

/// Whether a function of (x, u, T) looks at u.
bool depends_on_inputs(const expression::Tape& g, int n, int m) {
  std::vector<bool> is_input(g.size(), false);
  for (int i = n; i < n + m && static_cast<std::size_t>(i) < g.inputs(); ++i) {
    is_input[g.input_slot(static_cast<std::size_t>(i)).index] = true;
  }
  for (const expression::Node& node : g.nodes()) {
    const int operands = expression::operand_count(node.operation);
    if ((operands > 0 && is_input[node.a]) || (operands > 1 && is_input[node.b]) ||
        (operands > 2 && is_input[node.c])) {
      return true;
    }
  }
  for (const expression::Slot slot : g.output_slots()) {
    if (is_input[slot.index]) {
      return true;
    }
  }
  return false;
}

/// What a phase's functions are of a stage's variables.
class PhaseStages {
 public:
  PhaseStages(const ContinuousData& data, const TranscriptionLayout& layout, std::size_t phase)
      : data_(data), layout_(layout), phase_(phase) {}

  [[nodiscard]] const ContinuousPhase& phase() const { return data_.phases[phase_]; }
  [[nodiscard]] ExpressionVector durations(const ExpressionVector& p) const {
    ExpressionVector T(static_cast<Index>(data_.phases.size()));
    for (std::size_t i = 0; i < data_.phases.size(); ++i) {
      T(static_cast<Index>(i)) =
          layout_.duration[i] >= 0 ? p(layout_.duration[i]) : Expression(data_.phases[i].least);
    }
    return T;
  }
  /// Where an interval starts, after a jump if it is the phase's first.
  [[nodiscard]] ExpressionVector start(const ExpressionVector& x, const ExpressionVector& T,
                                       bool first) const {
    ExpressionVector at = x.head(layout_.n);
    if (first && phase().jump) {
      at = replay(*phase().jump, at, zero(), T);
    }
    return at;
  }
  [[nodiscard]] ExpressionVector zero() const {
    return ExpressionVector::Constant(layout_.m, Expression(0.0));
  }
  [[nodiscard]] ExpressionVector f(const ExpressionVector& x, const ExpressionVector& u,
                                   const ExpressionVector& T) const {
    return replay(*phase().derivative, x, u, T);
  }
  [[nodiscard]] Expression cost(const ExpressionVector& x, const ExpressionVector& u,
                                const ExpressionVector& T) const {
    return replay(*phase().running_cost, x, u, T)(0);
  }
  [[nodiscard]] Expression step(const ExpressionVector& T, const ExpressionVector& d) const {
    return T(static_cast<Index>(phase_)) * d(0);
  }
  /// Input and state at point j of collocation, -1 being the start.
  [[nodiscard]] ExpressionVector input_at(const ExpressionVector& x, const ExpressionVector& u,
                                          int j) const {
    return j < 0 ? ExpressionVector(x.tail(layout_.m))
                 : ExpressionVector(u.segment(j * layout_.m, layout_.m));
  }
  [[nodiscard]] ExpressionVector state_at(const ExpressionVector& u, int j) const {
    return u.segment(layout_.points() * layout_.m + j * layout_.n, layout_.n);
  }

  /// The end of steps of Runge and Kutta's method, and the cost on the way.
  [[nodiscard]] ExpressionVector shoot(ExpressionVector x, const ExpressionVector& u,
                                       const ExpressionVector& T, const Expression& whole,
                                       Expression* total) const {
    const Expression h = whole / static_cast<double>(layout_.steps);
    const auto plus = [&](const ExpressionVector& k, double share) {
      ExpressionVector y = x;
      for (Index i = 0; i < y.size(); ++i) {
        y(i) = x(i) + h * share * k(i);
      }
      return y;
    };
    for (int s = 0; s < layout_.steps; ++s) {
      const ExpressionVector k1 = f(x, u, T);
      const ExpressionVector x2 = plus(k1, 0.5);
      const ExpressionVector k2 = f(x2, u, T);
      const ExpressionVector x3 = plus(k2, 0.5);
      const ExpressionVector k3 = f(x3, u, T);
      const ExpressionVector x4 = plus(k3, 1.0);
      const ExpressionVector k4 = f(x4, u, T);
      if (total != nullptr) {
        *total += h / 6.0 *
                  (cost(x, u, T) + 2.0 * cost(x2, u, T) + 2.0 * cost(x3, u, T) + cost(x4, u, T));
      }
      for (Index i = 0; i < x.size(); ++i) {
        x(i) = x(i) + h / 6.0 * (k1(i) + 2.0 * k2(i) + 2.0 * k3(i) + k4(i));
      }
    }
    return x;
  }

 private:
  const ContinuousData& data_;
  const TranscriptionLayout& layout_;
  std::size_t phase_;
};

/// Writes a problem, phase by phase.
class Transcriber {
 public:
  Transcriber(const ContinuousData& data, const TranscriptionLayout& layout,
              OptimalControlProblem& problem)
      : data_(data), layout_(layout), problem_(problem) {}

  void phase(std::size_t i) {
    const PhaseStages stages(data_, layout_, i);
    const int begin = layout_.first[i];
    const int last = layout_.first[i + 1] - 1;
    // The first and the last interval of a phase may differ from the rest.
    std::vector<std::pair<int, int>> pieces;
    const bool own_first = stages.phase().jump.has_value();
    const bool own_last = layout_.is_collocation() && i + 1 < data_.phases.size();
    int from = begin;
    if (own_first) {
      pieces.emplace_back(begin, begin);
      ++from;
    }
    const int to = own_last ? last - 1 : last;
    if (from <= to) {
      pieces.emplace_back(from, to);
    }
    if (own_last && !(own_first && begin == last)) {
      pieces.emplace_back(last, last);
    }
    for (const auto& [a, b] : pieces) {
      const bool at_first = own_first && a == begin;
      const bool at_last = own_last && b == last;
      if (layout_.is_collocation()) {
        collocate(stages, a, b, at_first, at_last);
      } else {
        shoot(stages, a, b, at_first);
      }
    }
    for (const ContinuousRow& row : stages.phase().path) {
      path(stages, row, named(i, row.name), begin, last);
    }
    ends(stages, i, begin, last);
  }

 private:
  using Vector = ExpressionVector;

  [[nodiscard]] std::string named(std::size_t i, const std::string& name) const {
    return data_.phases.size() > 1 ? flyball::detail::format("phase {}: {}", i, name) : name;
  }

  void shoot(const PhaseStages& stages, int a, int b, bool at_first) {
    if (!at_first && layout_.steps == 1) {
      problem_.set_derivative(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
            const Vector T = stages.durations(p);
            Vector slope = stages.f(x, u, T);
            const Expression h = stages.step(T, d);
            for (Expression& e : slope) {
              e = h * e;
            }
            return slope;
          },
          1.0, a, b);
    } else {
      problem_.set_dynamics(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
            const Vector T = stages.durations(p);
            return stages.shoot(stages.start(x, T, at_first), u, T, stages.step(T, d), nullptr);
          },
          a, b);
    }
    if (stages.phase().running_cost) {
      problem_.set_stage_cost(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
            const Vector T = stages.durations(p);
            Expression total = 0.0;
            (void)stages.shoot(stages.start(x, T, at_first), u, T, stages.step(T, d), &total);
            return total;
          },
          a, b);
    }
  }

  void collocate(const PhaseStages& stages, int a, int b, bool at_first, bool at_last) {
    const CollocationRule& rule = layout_.rule;
    const int s = layout_.points();
    const int offset = rule.has_start ? 1 : 0;
    problem_.set_dynamics(
        [&](const Vector& /*x*/, const Vector& u, const Vector& /*p*/, const Vector& /*d*/) {
          Vector next(layout_.states);
          next.head(layout_.n) = stages.state_at(u, s - 1);
          if (rule.has_start) {
            next.tail(layout_.m) =
                at_last ? Vector(u.tail(layout_.m)) : stages.input_at(u, u, s - 1);
          }
          return next;
        },
        a, b);
    problem_.add_constraint(
        [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
          const Vector T = stages.durations(p);
          const Vector start = stages.start(x, T, at_first);
          const Expression h = stages.step(T, d);
          std::vector<Vector> f;
          if (rule.has_start) {
            f.push_back(stages.f(start, stages.input_at(x, u, -1), T));
          }
          for (int j = 0; j < s; ++j) {
            f.push_back(stages.f(stages.state_at(u, j), stages.input_at(x, u, j), T));
          }
          Vector rows(s * layout_.n);
          for (int j = 0; j < s; ++j) {
            const Vector at = stages.state_at(u, j);
            for (int i = 0; i < layout_.n; ++i) {
              Expression sum = 0.0;
              for (std::size_t l = 0; l < f.size(); ++l) {
                sum += rule.a[static_cast<std::size_t>(j)][l] * f[l](i);
              }
              rows(j * layout_.n + i) = start(i) + h * sum - at(i);
            }
          }
          return rows;
        },
        VectorXd::Zero(s * layout_.n), VectorXd::Zero(s * layout_.n), a, b,
        "collocation of the dynamics");
    if (stages.phase().running_cost) {
      problem_.set_stage_cost(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
            const Vector T = stages.durations(p);
            Expression sum = 0.0;
            if (rule.has_start) {
              sum += rule.b[0] *
                     stages.cost(stages.start(x, T, at_first), stages.input_at(x, u, -1), T);
            }
            for (int j = 0; j < s; ++j) {
              sum += rule.b[static_cast<std::size_t>(j + offset)] *
                     stages.cost(stages.state_at(u, j), stages.input_at(x, u, j), T);
            }
            return stages.step(T, d) * sum;
          },
          a, b);
    }
  }

  /// A path constraint where its points are, each point once.
  void path(const PhaseStages& stages, const ContinuousRow& row, const std::string& name, int begin,
            int last) {
    const bool mixed = depends_on_inputs(row.g, layout_.n, layout_.m);
    const bool jumps = stages.phase().jump.has_value();
    const auto at_start = [&](int a, int b, bool first) {
      if (a > b) {
        return;
      }
      problem_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& /*d*/) {
            const Vector T = stages.durations(p);
            const Vector input = layout_.rule.has_start     ? Vector(x.tail(layout_.m))
                                 : layout_.is_collocation() ? stages.zero()
                                                            : Vector(u);
            return replay(row.g, stages.start(x, T, first), input, T);
          },
          row.lower, row.upper, a, b, name);
    };
    const auto at_starts = [&](int b) {
      at_start(begin, jumps ? begin : b, true);
      if (jumps) {
        at_start(begin + 1, b, false);
      }
    };
    if (!layout_.is_collocation()) {
      at_starts(mixed ? last : last + 1);
      if (mixed) {
        problem_.add_constraint(
            [&](const Vector& x, const Vector& u, const Vector& p, const Vector& d) {
              const Vector T = stages.durations(p);
              const Vector start = stages.start(x, T, jumps && begin == last);
              return replay(row.g, stages.shoot(start, u, T, stages.step(T, d), nullptr), u, T);
            },
            row.lower, row.upper, last, last, name);
      }
      return;
    }
    if (layout_.rule.has_start || !mixed) {
      at_starts(layout_.rule.has_start ? last : begin);
    }
    for (int j = 0; j < layout_.points(); ++j) {
      const bool is_next_start = layout_.rule.has_start && j + 1 == layout_.points();
      problem_.add_constraint(
          [&](const Vector& x, const Vector& u, const Vector& p, const Vector& /*d*/) {
            return replay(row.g, stages.state_at(u, j), stages.input_at(x, u, j),
                          stages.durations(p));
          },
          row.lower, row.upper, is_next_start ? last : begin, last, name);
    }
  }

  void ends(const PhaseStages& stages, std::size_t i, int begin, int last) {
    const auto at = [&](const ContinuousRow& row, int stage, bool first) {
      problem_.add_constraint(
          [&](const Vector& x, const Vector& /*u*/, const Vector& p, const Vector& /*d*/) {
            const Vector T = stages.durations(p);
            return replay(row.g, stages.start(x, T, first), stages.zero(), T);
          },
          row.lower, row.upper, stage, stage, named(i, row.name));
    };
    for (const ContinuousRow& row : stages.phase().start_rows) {
      at(row, begin, true);
    }
    for (const ContinuousRow& row : stages.phase().end_rows) {
      at(row, last + 1, false);
    }
  }

  const ContinuousData& data_;
  const TranscriptionLayout& layout_;
  OptimalControlProblem& problem_;
};

/// Bounds of all stages, what is fixed, and which inputs do not exist.
void set_bounds(const ContinuousData& data, const TranscriptionLayout& layout,
                OptimalControlProblem& problem) {
  const int n = layout.n;
  const int m = layout.m;
  const std::size_t phases = data.phases.size();
  const int N = layout.intervals();
  MatrixXd lower = MatrixXd::Constant(layout.states, N + 1, -infinity);
  MatrixXd upper = MatrixXd::Constant(layout.states, N + 1, infinity);
  for (std::size_t i = 0; i < phases; ++i) {
    const ContinuousPhase& phase = data.phases[i];
    const int from = layout.first[i] + (phase.jump ? 1 : 0);
    for (int k = from; k <= layout.first[i + 1]; ++k) {
      lower.col(k).head(n) = lower.col(k).head(n).cwiseMax(phase.state_lower);
      upper.col(k).head(n) = upper.col(k).head(n).cwiseMin(phase.state_upper);
    }
    if (layout.rule.has_start) {
      const int end = i + 1 == phases ? layout.first[i + 1] + 1 : layout.first[i + 1];
      for (int k = layout.first[i]; k < end; ++k) {
        lower.col(k).tail(m) = phase.input_lower;
        upper.col(k).tail(m) = phase.input_upper;
      }
    }
  }
  for (int k = 0; k <= N; ++k) {
    problem.bound_state(k, lower.col(k), upper.col(k));
  }
  VectorXd fixed = VectorXd::Constant(layout.states, nan);
  fixed.head(n) = data.start;
  problem.fix_state(0, fixed);
  for (std::size_t i = 0; i < phases; ++i) {
    fixed.head(n) = data.phases[i].end;
    problem.fix_state(layout.first[i + 1], fixed);
  }
  const int points = layout.points();
  for (std::size_t i = 0; i < phases; ++i) {
    const ContinuousPhase& phase = data.phases[i];
    VectorXd low = VectorXd::Constant(layout.inputs, -infinity);
    VectorXd high = VectorXd::Constant(layout.inputs, infinity);
    if (!layout.is_collocation()) {
      low = phase.input_lower;
      high = phase.input_upper;
    }
    for (int j = 0; j < points; ++j) {
      low.segment(j * m, m) = phase.input_lower;
      high.segment(j * m, m) = phase.input_upper;
      if (j + 1 < points) {  // the last is a state
        low.segment(points * m + j * n, n) = phase.state_lower;
        high.segment(points * m + j * n, n) = phase.state_upper;
      }
    }
    const bool extra = layout.is_collocation() && layout.rule.has_start && phases > 1;
    for (int k = layout.first[i]; k < layout.first[i + 1]; ++k) {
      if (extra) {
        const bool used = k + 1 == layout.first[i + 1] && i + 1 < phases;
        low.tail(m) = used ? data.phases[i + 1].input_lower : VectorXd(VectorXd::Zero(m));
        high.tail(m) = used ? data.phases[i + 1].input_upper : VectorXd(VectorXd::Zero(m));
      }
      problem.bound_input(k, low, high);
    }
  }
}

}  // namespace

TranscriptionLayout::TranscriptionLayout(const ContinuousData& data,
                                         const TranscriptionOptions& options,
                                         std::vector<VectorXd> of_phases)
    : n(data.states), m(data.inputs), method(options.method), widths(std::move(of_phases)) {
  first.push_back(0);
  for (std::size_t i = 0; i < data.phases.size(); ++i) {
    first.push_back(first.back() + static_cast<int>(widths[i].size()));
    const ContinuousPhase& phase = data.phases[i];
    if (phase.shared_with >= 0) {
      duration.push_back(duration[static_cast<std::size_t>(phase.shared_with)]);
    } else {
      duration.push_back(phase.least < phase.most ? durations++ : -1);
    }
  }
  switch (method) {
    case Transcription::runge_kutta:
      break;
    case Transcription::multiple_shooting:
      steps = options.shooting_steps;
      break;
    case Transcription::hermite_simpson:
      rule = lobatto();
      break;
    case Transcription::radau:
      rule = radau();
      break;
  }
  states = n + (rule.has_start ? m : 0);
  inputs = is_collocation() ? points() * (n + m) : m;
  if (rule.has_start && data.phases.size() > 1) {
    inputs += m;
  }
}

OptimalControlProblem transcribe(const ContinuousData& data, const TranscriptionLayout& layout) {
  const int N = layout.intervals();
  OptimalControlProblem problem(layout.states, layout.inputs, N, layout.durations, 1);
  Transcriber transcriber(data, layout, problem);
  for (std::size_t i = 0; i < data.phases.size(); ++i) {
    transcriber.phase(i);
  }
  const PhaseStages any(data, layout, 0);
  problem.set_terminal_cost([&](const ExpressionVector& x, const ExpressionVector& /*u*/,
                                const ExpressionVector& p, const ExpressionVector& /*d*/) {
    const ExpressionVector T = any.durations(p);
    Expression cost = 0.0;
    if (data.final_cost) {
      cost += replay(*data.final_cost, x.head(layout.n), any.zero(), T)(0);
    }
    for (const Expression& duration : T) {
      cost += data.time_weight * duration;
    }
    return cost;
  });
  set_bounds(data, layout, problem);
  VectorXd least(layout.durations), most(layout.durations);
  MatrixXd widths = MatrixXd::Zero(1, N + 1);
  for (std::size_t i = 0; i < data.phases.size(); ++i) {
    if (layout.duration[i] >= 0 && data.phases[i].shared_with < 0) {
      least(layout.duration[i]) = data.phases[i].least;
      most(layout.duration[i]) = data.phases[i].most;
    }
    widths.block(0, layout.first[i], 1, layout.widths[i].size()) = layout.widths[i].transpose();
  }
  problem.bound_parameters(least, most);
  problem.set_data(widths);
  return problem;
}

void set_start(OptimalControlProblem& problem, const TranscriptionLayout& layout,
               FunctionRef<VectorXd(std::size_t, double)> x,
               FunctionRef<VectorXd(std::size_t, double)> u, const VectorXd& durations) {
  const int n = layout.n;
  const int m = layout.m;
  const int N = layout.intervals();
  MatrixXd states = MatrixXd::Zero(layout.states, N + 1);
  MatrixXd inputs = MatrixXd::Zero(layout.inputs, N);
  for (std::size_t i = 0; i + 1 < layout.first.size(); ++i) {
    double share = 0.0;
    for (int k = layout.first[i]; k < layout.first[i + 1]; ++k) {
      const double width = layout.widths[i](k - layout.first[i]);
      states.col(k).head(n) = x(i, share);
      if (layout.rule.has_start) {
        states.col(k).tail(m) = u(i, share);
      }
      if (!layout.is_collocation()) {
        inputs.col(k) = u(i, share + 0.5 * width);
      }
      for (int j = 0; j < layout.points(); ++j) {
        const std::size_t point = static_cast<std::size_t>(j) + (layout.rule.has_start ? 1 : 0);
        const double there = share + width * layout.rule.shares[point];
        inputs.col(k).segment(j * m, m) = u(i, there);
        inputs.col(k).segment(layout.points() * m + j * n, n) = x(i, there);
      }
      share += width;
    }
  }
  const std::size_t last = layout.first.size() - 2;
  states.col(N).head(n) = x(last, 1.0);
  if (layout.rule.has_start) {
    states.col(N).tail(m) = u(last, 1.0);
  }
  problem.set_start(states, inputs);
  VectorXd p(layout.durations);
  for (std::size_t i = layout.duration.size(); i > 0; --i) {
    if (layout.duration[i - 1] >= 0) {
      p(layout.duration[i - 1]) = durations(static_cast<Index>(i - 1));
    }
  }
  problem.set_parameter_start(p);
}

std::vector<PhaseTrajectory> trajectory_of(const ContinuousData& data,
                                           const TranscriptionLayout& layout,
                                           const OptimalControlSolution& solution) {
  const int n = layout.n;
  const int m = layout.m;
  std::vector<PhaseTrajectory> phases;
  double begin = 0.0;
  for (std::size_t i = 0; i < data.phases.size(); ++i) {
    const ContinuousPhase& phase = data.phases[i];
    PhaseTrajectory t;
    t.duration = layout.duration[i] >= 0 ? solution.parameters(layout.duration[i]) : phase.least;
    const auto N = layout.widths[i].size();
    const int from = layout.first[i];
    t.times.resize(N + 1);
    t.times(0) = begin;
    for (Index k = 0; k < N; ++k) {
      t.times(k + 1) = t.times(k) + t.duration * layout.widths[i](k);
    }
    begin += t.duration;
    t.times(N) = begin;
    t.states = solution.states.block(0, from, n, N + 1);
    if (phase.jump) {
      VectorXd inputs = VectorXd::Zero(n + m + static_cast<Index>(data.phases.size()));
      inputs.head(n) = t.states.col(0);
      std::vector<double> values(phase.jump->size());
      VectorXd after(n);
      phase.jump->prepare<double>({}, values);
      const std::span<const double> given(inputs.data(), phase.jump->inputs());
      phase.jump->evaluate<double>(given, {after.data(), static_cast<std::size_t>(n)}, values);
      t.states.col(0) = after;
    }
    if (!layout.is_collocation()) {
      t.input_shares = VectorXd::Zero(1);
      t.inputs = solution.inputs.middleCols(from, N);
    } else {
      const auto shares = static_cast<Index>(layout.rule.shares.size());
      t.input_shares = Eigen::Map<const VectorXd>(layout.rule.shares.data(), shares);
      t.inputs.resize(m, N * shares);
      for (Index k = 0; k < N; ++k) {
        Index to = k * shares;
        if (layout.rule.has_start) {
          t.inputs.col(to++) = solution.states.col(from + k).tail(m);
        }
        for (int j = 0; j < layout.points(); ++j) {
          t.inputs.col(to++) = solution.inputs.col(from + k).segment(j * m, m);
        }
      }
    }
    phases.push_back(std::move(t));
  }
  return phases;
}

}  // namespace flyball::optimization::detail
