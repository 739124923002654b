#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/optimization/ocp/continuous_solution.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "optimization/ocp/continuous_data.hpp"
#include "optimization/ocp/transcription.hpp"

namespace flyball::optimization {

using detail::ContinuousData;
using detail::ContinuousPhase;
using detail::TranscriptionLayout;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_optimal_control = "optimal control";

/// A phase's derivative in numbers.
class Slope {
 public:
  Slope(const expression::Tape& tape, const VectorXd& durations)
      : tape_(tape), durations_(durations), values_(tape.size()) {
    tape_.prepare<double>({}, values_);
  }
  [[nodiscard]] VectorXd operator()(const VectorXd& x, const VectorXd& u) {
    VectorXd inputs(x.size() + u.size() + durations_.size());
    inputs << x, u, durations_;
    VectorXd out(x.size());
    tape_.evaluate<double>({inputs.data(), tape_.inputs()},
                           {out.data(), static_cast<std::size_t>(out.size())}, values_);
    return out;
  }

 private:
  const expression::Tape& tape_;
  const VectorXd& durations_;
  std::vector<double> values_;
};

/// Linear between columns; shares rise.
VectorXd interpolate(const VectorXd& shares, const MatrixXd& values, double share) {
  const Index count = shares.size();
  Index i = 0;
  while (i + 2 < count && share > shares(i + 1)) {
    ++i;
  }
  const double a = std::clamp((share - shares(i)) / (shares(i + 1) - shares(i)), 0.0, 1.0);
  return (1.0 - a) * values.col(i) + a * values.col(i + 1);
}

/// Straight between what is fixed, by the share of the whole duration.
VectorXd straight(const ContinuousData& data, std::size_t phase, double share) {
  VectorXd x = VectorXd::Zero(data.states);
  const double now = static_cast<double>(phase) + share;
  for (Index i = 0; i < x.size(); ++i) {
    double before = -1.0;
    double value_before = 0.0;
    if (!std::isnan(data.start(i))) {
      before = 0.0;
      value_before = data.start(i);
    }
    double after = -1.0;
    double value_after = 0.0;
    for (std::size_t p = 0; p < data.phases.size(); ++p) {
      const double value = data.phases[p].end(i);
      const auto at = static_cast<double>(p + 1);
      if (std::isnan(value)) {
        continue;
      }
      if (at <= now) {
        before = at;
        value_before = value;
      } else if (after < 0.0) {
        after = at;
        value_after = value;
      }
    }
    if (before < 0.0 || after < 0.0) {
      x(i) = before >= 0.0 ? value_before : after >= 0.0 ? value_after : 0.0;
    } else {
      x(i) = value_before + (value_after - value_before) * (now - before) / (after - before);
    }
  }
  return x;
}

/// Slopes at the ends of intervals, and how far each is from what an integrator finds.
Expected<void> measure(const ContinuousData& data, std::vector<PhaseTrajectory>& phases) {
  VectorXd durations(static_cast<Index>(phases.size()));
  VectorXd size = VectorXd::Ones(data.states);
  for (std::size_t i = 0; i < phases.size(); ++i) {
    durations(static_cast<Index>(i)) = phases[i].duration;
    size = size.cwiseMax((phases[i].states.cwiseAbs().rowwise().maxCoeff().array() + 1.0).matrix());
  }
  for (std::size_t i = 0; i < phases.size(); ++i) {
    PhaseTrajectory& t = phases[i];
    Slope f(*data.phases[i].derivative, durations);
    const Index N = t.times.size() - 1;
    t.start_slopes.resize(data.states, N);
    t.end_slopes.resize(data.states, N);
    t.errors.resize(N);
    const Index shares = t.input_shares.size();
    for (Index k = 0; k < N; ++k) {
      const double h = t.times(k + 1) - t.times(k);
      const MatrixXd u = t.inputs.middleCols(k * shares, shares);
      const auto input = [&](double s) { return detail::parabola(t.input_shares, u, s); };
      t.start_slopes.col(k) = f(t.states.col(k), input(0.0));
      t.end_slopes.col(k) = f(t.states.col(k + 1), input(1.0));
      const auto rate = [&](double s, const VectorXd& x) -> VectorXd { return h * f(x, input(s)); };
      const auto end =
          integrate(rate, 0.0, VectorXd(t.states.col(k)), 1.0,
                    IntegrationOptions{.relative_tolerance = 1e-11, .absolute_tolerance = 1e-12});
      t.errors(k) =
          end ? ((end->final_state() - t.states.col(k + 1)).array() / size.array()).abs().maxCoeff()
              : std::numeric_limits<double>::infinity();
    }
  }
  return {};
}

/// Intervals with too large an error in parts. @return whether any is.
bool divide(std::vector<VectorXd>& widths, const std::vector<PhaseTrajectory>& phases, int order,
            const TranscriptionOptions& options) {
  bool any = false;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    std::vector<double> finer;
    for (Index k = 0; k < widths[i].size(); ++k) {
      const double ratio = phases[i].errors(k) / options.error_tolerance;
      int parts = 1;
      if (ratio > 1.0) {
        const double wanted = std::pow(std::min(ratio, 1e12), 1.0 / (order + 1));
        parts = std::clamp(static_cast<int>(std::ceil(wanted)), 2, 4);
      }
      any = any || parts > 1;
      for (int part = 0; part < parts; ++part) {
        finer.push_back(widths[i](k) / parts);
      }
    }
    if (static_cast<int>(finer.size()) > options.max_intervals) {
      return false;
    }
    widths[i] = Eigen::Map<const VectorXd>(finer.data(), static_cast<Index>(finer.size())).eval();
  }
  return any;
}

/// " (phase 1, 0.35 s)" of a stage.
std::string place_of(const TranscriptionLayout& layout, const std::vector<PhaseTrajectory>& phases,
                     int stage) {
  std::size_t i = 0;
  while (i + 1 < phases.size() && stage >= layout.first[i + 1]) {
    ++i;
  }
  const VectorXd& times = phases[i].times;
  const double t = times(std::clamp<Index>(stage - layout.first[i], 0, times.size() - 1));
  return phases.size() > 1 ? flyball::detail::format(" (phase {}, {} s)", i, format_number(t, 4))
                           : flyball::detail::format(" ({} s)", format_number(t, 4));
}

Expected<void> check(const ContinuousData& data, const TranscriptionOptions& options) {
  if (data.error) {
    return tl::unexpected(*data.error);
  }
  for (std::size_t i = 0; i < data.phases.size(); ++i) {
    const ContinuousPhase& phase = data.phases[i];
    if (!phase.derivative) {
      return tl::unexpected(Error(ArgumentError::empty)
                                .in(std::string(in_optimal_control))
                                .about(flyball::detail::format("the derivative of phase {}", i))
                                .hint("call set_derivative"));
    }
    if (phase.shared_with < 0 && !(phase.most > 0.0)) {
      return tl::unexpected(Error(ArgumentError::empty)
                                .in(std::string(in_optimal_control))
                                .about(flyball::detail::format("the duration of phase {}", i))
                                .hint("call set_duration or free_duration"));
    }
  }
  return Checks(in_optimal_control)
      .within(options.intervals, 1, options.max_intervals, "the intervals of a phase")
      .within(options.shooting_steps, 1, 1000, "the steps of an interval")
      .not_negative(options.error_tolerance, "the error tolerance")
      .within(options.max_refinements, 0, 100, "the refinements of the mesh")
      .within(options.max_intervals, 1, 10'000'000, "the most intervals of a phase");
}

}  // namespace

namespace detail {

VectorXd parabola(const VectorXd& shares, const MatrixXd& values, double s) {
  if (shares.size() == 1) {
    return values.col(0);
  }
  VectorXd sum = VectorXd::Zero(values.rows());
  for (Index j = 0; j < shares.size(); ++j) {
    double weight = 1.0;
    for (Index l = 0; l < shares.size(); ++l) {
      weight *= l == j ? 1.0 : (s - shares(l)) / (shares(j) - shares(l));
    }
    sum += weight * values.col(j);
  }
  return sum;
}

}  // namespace detail

std::string_view to_string(Transcription method) {
  switch (method) {
    case Transcription::runge_kutta:
      return "Runge-Kutta";
    case Transcription::multiple_shooting:
      return "multiple shooting";
    case Transcription::hermite_simpson:
      return "Hermite-Simpson";
    case Transcription::radau:
      return "Radau";
  }
  return "";
}

int order_of(Transcription method) noexcept {
  return method == Transcription::radau ? 5 : 4;
}

namespace {

Index interval_at(const VectorXd& times, double t) {
  const auto* const end = times.data() + times.size();
  const auto after = std::upper_bound(times.data(), end, t) - times.data();
  return std::clamp<Index>(after - 1, 0, times.size() - 2);
}

}  // namespace

VectorXd PhaseTrajectory::input(double t) const {
  const Index k = interval_at(times, t);
  const double h = times(k + 1) - times(k);
  const double s = h > 0.0 ? std::clamp((t - times(k)) / h, 0.0, 1.0) : 0.0;
  return detail::parabola(input_shares,
                          inputs.middleCols(k * input_shares.size(), input_shares.size()), s);
}

VectorXd PhaseTrajectory::state(double t) const {
  const Index k = interval_at(times, t);
  const double h = times(k + 1) - times(k);
  const double s = h > 0.0 ? std::clamp((t - times(k)) / h, 0.0, 1.0) : 0.0;
  const double r = 1.0 - s;
  return r * r * (1.0 + 2.0 * s) * states.col(k) + s * s * (1.0 + 2.0 * r) * states.col(k + 1) +
         h * s * r * (r * start_slopes.col(k) - s * end_slopes.col(k));
}

Expected<ContinuousSolution> solve(const ContinuousProblem& problem,
                                   const TranscriptionOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const ContinuousData& data = problem.data();
  FLYBALL_CHECK(check(data, options));
  std::vector<VectorXd> widths(
      data.phases.size(),
      VectorXd::Constant(options.intervals, 1.0 / static_cast<double>(options.intervals)));
  ContinuousSolution result;
  for (int round = 0;; ++round) {
    const TranscriptionLayout layout(data, options, widths);
    OptimalControlProblem transcribed = detail::transcribe(data, layout);
    VectorXd durations(static_cast<Index>(data.phases.size()));
    for (std::size_t i = 0; i < data.phases.size(); ++i) {
      const int shared = data.phases[i].shared_with;
      durations(static_cast<Index>(i)) = round > 0 ? result.phases[i].duration
                                         : shared >= 0
                                             ? data.phases[static_cast<std::size_t>(shared)].guess
                                             : data.phases[i].guess;
    }
    const auto first_state = [&](std::size_t i, double share) -> VectorXd {
      const ContinuousPhase& phase = data.phases[i];
      return phase.guess_shares.size() > 0
                 ? interpolate(phase.guess_shares, phase.guess_states, share)
                 : straight(data, i, share);
    };
    const auto first_input = [&](std::size_t i, double share) -> VectorXd {
      const ContinuousPhase& phase = data.phases[i];
      return phase.guess_shares.size() > 0
                 ? interpolate(phase.guess_shares, phase.guess_inputs, share)
                 : VectorXd(VectorXd::Zero(data.inputs));
    };
    const auto found_state = [&](std::size_t i, double share) -> VectorXd {
      const PhaseTrajectory& t = result.phases[i];
      return t.state(t.times(0) + share * t.duration);
    };
    const auto found_input = [&](std::size_t i, double share) -> VectorXd {
      const PhaseTrajectory& t = result.phases[i];
      return t.input(t.times(0) + share * t.duration);
    };
    SolverOptions solver_options = options.solver;
    solver_options.time_limit = std::max(0.0, options.solver.time_limit - elapsed());
    if (round == 0) {
      detail::set_start(transcribed, layout, first_state, first_input, durations);
    } else {
      detail::set_start(transcribed, layout, found_state, found_input, durations);
      solver_options.first_barrier = 1e-2;
    }
    FLYBALL_TRY_IN(in_optimal_control, OptimalControlSolver solver,
                   OptimalControlSolver::make(transcribed));
    const OptimalControlSolution found = solver.solve(solver_options);
    result.phases = detail::trajectory_of(data, layout, found);
    result.cost = found.cost;
    result.status = found.status;
    result.violations = found.violations;
    result.message = found.message;
    if (!found.violations.empty()) {
      result.message += place_of(layout, result.phases, found.violations.front().stage);
    }
    result.counts.iterations += found.counts.iterations;
    result.counts.restorations += found.counts.restorations;
    result.counts.factorizations += found.counts.factorizations;
    result.counts.evaluations += found.counts.evaluations;
    result.counts.corrections += found.counts.corrections;
    result.refinements = round;
    FLYBALL_CHECK(measure(data, result.phases));
    result.largest_error = 0.0;
    result.duration = 0.0;
    for (const PhaseTrajectory& phase : result.phases) {
      result.largest_error = std::max(result.largest_error, phase.errors.maxCoeff());
      result.duration += phase.duration;
    }
    result.accurate =
        options.error_tolerance <= 0.0 || result.largest_error <= options.error_tolerance;
    if (result.accurate || !result.solved() || round >= options.max_refinements ||
        !divide(widths, result.phases, order_of(options.method), options)) {
      break;
    }
  }
  if (result.solved() && !result.accurate) {
    result.message =
        flyball::detail::format("the mesh's error is {:.2g} after {} refinements, more than {:.2g}",
                                result.largest_error, result.refinements, options.error_tolerance);
  }
  result.seconds = elapsed();
  return result;
}

}  // namespace flyball::optimization
