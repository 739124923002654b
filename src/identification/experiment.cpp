#include <algorithm>
#include <cmath>
#include <memory>

#include <flyball/identification/identification_error.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "identification/experiment.hpp"

namespace flyball::identification {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What a run's simulation gets wrong, over the standard deviations of the outputs.
class RunResiduals final : public optimization::ResidualBlock {
 public:
  RunResiduals(const Experiment& experiment, std::size_t run, InputHold hold, Index count,
               std::vector<Index> places)
      : ResidualBlock(count, std::move(places)),
        model_(experiment.model),
        parameters_(experiment.places),
        run_(experiment.runs[run]),
        states_(experiment.free_states[run]),
        output_std_(experiment.output_std),
        plan_(experiment.plan),
        hold_(hold) {}

  [[nodiscard]] bool evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J) const override {
    VectorXd p = model_.parameters();
    const auto free = static_cast<Index>(parameters_.size());
    for (Index j = 0; j < free; ++j) {
      p(parameters_[static_cast<std::size_t>(j)]) = x(j);
    }
    const auto model = model_.with_parameters(p);
    if (!model) {
      return false;
    }
    VectorXd initial = VectorXd::Zero(model_.states());
    for (std::size_t i = 0; i < run_.initial.size(); ++i) {
      initial(static_cast<Index>(i)) = run_.initial[i].value;
    }
    for (std::size_t j = 0; j < states_.size(); ++j) {
      initial(states_[j]) = x(free + static_cast<Index>(j));
    }
    const SensitivityBy by{parameters_, states_};
    const auto simulated =
        simulate_run(*model, run_, initial, hold_, plan_, J == nullptr ? nullptr : &by);
    if (!simulated) {
      return false;
    }
    const MatrixXd errors = output_errors(*model, run_, simulated->y);
    Index row = 0;
    for (Index k = 0; k < errors.cols(); ++k) {
      for (Index i = 0; i < errors.rows(); ++i) {
        if (std::isnan(run_.outputs(i, k))) {
          continue;
        }
        const double scale = 1.0 / output_std_[static_cast<std::size_t>(i)];
        r(row) = scale * errors(i, k);
        if (J != nullptr) {
          J->row(row) = scale * simulated->sensitivity.row(k * errors.rows() + i);
        }
        ++row;
      }
    }
    return true;
  }

 private:
  AnyModel model_;
  std::vector<Index> parameters_;
  ExperimentRun run_;
  std::vector<Index> states_;
  std::vector<double> output_std_;
  IntegrationPlan plan_;
  InputHold hold_;
};

Expected<void> check_run(const AnyModel& model, const ExperimentRun& run, std::string_view where) {
  const auto samples = static_cast<Index>(run.time.size());
  const std::string in = run.name.empty() ? std::string("the run") : "run " + run.name;
  FLYBALL_CHECK(
      Checks(where)
          .shape(run.inputs, model.inputs(), samples, in + ": inputs", "inputs x samples")
          .shape(run.outputs, model.outputs(), samples, in + ": outputs", "outputs x samples")
          .finite(run.inputs, in + ": inputs"));
  if (!run.initial.empty() && run.initial.size() != static_cast<std::size_t>(model.states())) {
    return refusal(ArgumentError::wrong_shape, where, in + ": the initial state")
        .got(detail::format("{} entries", run.initial.size()))
        .expected(detail::format("one a state ({})", model.states()));
  }
  for (std::size_t k = 0; k < run.time.size(); ++k) {
    if (!std::isfinite(run.time[k]) || (k > 0 && !(run.time[k] > run.time[k - 1]))) {
      return refusal(ArgumentError::out_of_range, where, in + ": time")
          .got(detail::format("{} at sample {}", format_number(run.time[k]), k + 1))
          .expected("finite and ascending");
    }
  }
  for (const InitialState& state : run.initial) {
    if (!std::isfinite(state.value) || !(state.std > 0.0) || !(state.lower <= state.upper)) {
      return refusal(ArgumentError::out_of_range, where, in + ": an initial state")
          .got(detail::format("{} ± {} within {} and {}", format_number(state.value),
                              format_number(state.std), format_number(state.lower),
                              format_number(state.upper)))
          .expected("finite, with a positive deviation and bounds in order");
    }
  }
  return {};
}

Index measured(const ExperimentRun& run) {
  return (run.outputs.array() == run.outputs.array()).count();
}

}  // namespace

Expected<void> check_options(const AnyModel& model, const PredictionErrorOptions& options,
                             std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .within(options.confidence, 1e-6, 1.0 - 1e-9, "confidence")
                    .within(options.starts, 1, 1e6, "starts")
                    .positive(options.integration_error, "integration_error"));
  if (!options.output_std.empty() &&
      options.output_std.size() != static_cast<std::size_t>(model.outputs())) {
    return refusal(ArgumentError::wrong_shape, where, "output_std")
        .got(detail::format("{} entries", options.output_std.size()))
        .expected(detail::format("one an output ({})", model.outputs()));
  }
  for (const double std : options.output_std) {
    FLYBALL_CHECK(check_positive(std, where, "output_std"));
  }
  return {};
}

Expected<Experiment> Experiment::create(const AnyModel& model,
                                        const std::vector<ExperimentRun>& runs,
                                        const std::vector<FreeParameter>& parameters,
                                        std::string_view where) {
  Experiment made(model);
  made.runs = runs;
  made.free = parameters;
  const std::vector<Parameter>& known = model.names().parameters;
  for (const FreeParameter& one : parameters) {
    const auto found = std::find_if(known.begin(), known.end(), [&](const Parameter& parameter) {
      return parameter.name == one.name;
    });
    if (found == known.end()) {
      std::vector<std::string> names;
      for (const Parameter& parameter : known) {
        names.push_back(parameter.name);
      }
      return refusal(ArgumentError::unknown_name, where, detail::format("\"{}\"", one.name))
          .got("not a parameter of the model")
          .expected(names.empty() ? "one, but the model has none" : text::enumerate(names));
    }
    made.places.push_back(static_cast<Index>(found - known.begin()));
  }
  auto next = static_cast<Index>(parameters.size());
  Index count = 0;
  for (const ExperimentRun& run : runs) {
    FLYBALL_CHECK(check_run(model, run, where));
    made.first.push_back(next);
    made.free_states.emplace_back();
    for (std::size_t i = 0; i < run.initial.size(); ++i) {
      if (run.initial[i].is_free) {
        made.free_states.back().push_back(static_cast<Index>(i));
        ++next;
      }
    }
    count += measured(run);
  }
  if (count == 0) {
    return refusal(IdentificationError::no_data, where, "the recording")
        .got("without a measured output")
        .hint("record an output of the model");
  }
  for (Index p = 0; p < model.outputs(); ++p) {
    double sum = 0.0;
    double squares = 0.0;
    double samples = 0.0;
    for (const ExperimentRun& run : runs) {
      for (const double y : run.outputs.row(p)) {
        if (!std::isnan(y)) {
          sum += y;
          samples += 1.0;
        }
      }
    }
    const double mean = samples > 0.0 ? sum / samples : 0.0;
    for (const ExperimentRun& run : runs) {
      for (const double y : run.outputs.row(p)) {
        squares += std::isnan(y) ? 0.0 : (y - mean) * (y - mean);
      }
    }
    made.spread.push_back(samples > 0.0 ? std::sqrt(squares / samples) : 0.0);
  }
  return made;
}

Index Experiment::unknowns() const noexcept {
  auto count = static_cast<Index>(free.size());
  for (const auto& of_run : free_states) {
    count += static_cast<Index>(of_run.size());
  }
  return count;
}

VectorXd Experiment::start() const {
  VectorXd x(unknowns());
  for (std::size_t j = 0; j < places.size(); ++j) {
    x(static_cast<Index>(j)) =
        std::clamp(model.parameters()(places[j]), free[j].lower, free[j].upper);
  }
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for (std::size_t j = 0; j < free_states[r].size(); ++j) {
      const InitialState& state = runs[r].initial[static_cast<std::size_t>(free_states[r][j])];
      x(first[r] + static_cast<Index>(j)) = std::clamp(state.value, state.lower, state.upper);
    }
  }
  return x;
}

bool Experiment::has_priors() const noexcept {
  const bool of_states = std::any_of(runs.begin(), runs.end(), [](const ExperimentRun& run) {
    return std::any_of(run.initial.begin(), run.initial.end(),
                       [](const InitialState& one) { return one.is_free && one.std < infinity; });
  });
  return of_states || std::any_of(free.begin(), free.end(),
                                  [](const FreeParameter& one) { return one.std < infinity; });
}

AnyModel Experiment::model_at(const VectorXd& x) const {
  VectorXd p = model.parameters();
  for (std::size_t j = 0; j < places.size(); ++j) {
    p(places[j]) = x(static_cast<Index>(j));
  }
  return model.with_parameters(p).value_or(model);
}

VectorXd Experiment::initial_of(std::size_t run, const VectorXd& x) const {
  VectorXd initial = VectorXd::Zero(model.states());
  for (std::size_t i = 0; i < runs[run].initial.size(); ++i) {
    initial(static_cast<Index>(i)) = runs[run].initial[i].value;
  }
  for (std::size_t j = 0; j < free_states[run].size(); ++j) {
    initial(free_states[run][j]) = x(first[run] + static_cast<Index>(j));
  }
  return initial;
}

optimization::LeastSquaresProblem Experiment::problem(const PredictionErrorOptions& options) const {
  const Index n = unknowns();
  optimization::LeastSquaresProblem made;
  made.start = start();
  made.loss = options.loss;
  made.lower = VectorXd::Constant(n, -infinity);
  made.upper = VectorXd::Constant(n, infinity);
  made.prior_mean = VectorXd::Zero(n);
  made.prior_std = VectorXd::Constant(n, infinity);
  std::vector<Index> shared;
  for (std::size_t j = 0; j < free.size(); ++j) {
    const auto place = static_cast<Index>(j);
    shared.push_back(place);
    made.lower(place) = free[j].lower;
    made.upper(place) = free[j].upper;
    made.prior_mean(place) = free[j].mean;
    made.prior_std(place) = free[j].std;
    made.names.push_back(free[j].name);
  }
  for (std::size_t r = 0; r < runs.size(); ++r) {
    std::vector<Index> own = shared;
    for (std::size_t j = 0; j < free_states[r].size(); ++j) {
      const Index place = first[r] + static_cast<Index>(j);
      const auto at = static_cast<std::size_t>(free_states[r][j]);
      const InitialState& state = runs[r].initial[at];
      own.push_back(place);
      made.lower(place) = state.lower;
      made.upper(place) = state.upper;
      made.prior_mean(place) = state.value;
      made.prior_std(place) = state.std;
      made.names.push_back(detail::format("the initial {}{}", model.names().states[at].name,
                                          runs.size() == 1 ? "" : " of run " + runs[r].name));
    }
    made.blocks.push_back(
        std::make_shared<RunResiduals>(*this, r, options.hold, measured(runs[r]), std::move(own)));
  }
  return made;
}

Expected<RunFit> run_fit(const AnyModel& model, const ExperimentRun& run, const VectorXd& initial,
                         InputHold hold, const IntegrationPlan& plan) {
  auto simulated = simulate_run(model, run, initial, hold, plan);
  if (!simulated) {
    return refusal(ArgumentError::not_finite, "simulate_run",
                   detail::format("the simulation of run {}", run.name))
        .got("not finite");
  }
  RunFit made{.name = run.name, .initial = initial, .simulated = std::move(simulated->y)};
  made.residuals = -output_errors(model, run, made.simulated);
  for (Index p = 0; p < model.outputs(); ++p) {
    double sum = 0.0;
    double errors = 0.0;
    double count = 0.0;
    for (Index k = 0; k < made.residuals.cols(); ++k) {
      if (const double error = made.residuals(p, k); !std::isnan(error)) {
        sum += run.outputs(p, k);
        errors += error * error;
        count += 1.0;
      }
    }
    double squares = 0.0;
    for (Index k = 0; k < made.residuals.cols(); ++k) {
      if (!std::isnan(made.residuals(p, k))) {
        const double off = run.outputs(p, k) - sum / count;
        squares += off * off;
      }
    }
    const double rmse = std::sqrt(errors / std::max(1.0, count));
    const double nrmse = squares > 0.0 ? std::sqrt(errors / squares) : infinity;
    made.outputs.push_back({rmse, nrmse, 1.0 - nrmse});
  }
  return made;
}

std::vector<std::string> words_of(const Experiment& experiment,
                                  const optimization::LeastSquaresResult& result) {
  std::vector<std::string> sentences;
  const optimization::LeastSquaresProblem problem = experiment.problem({});
  for (Index k = 0; k < result.undetermined.cols(); ++k) {
    // In each parameter's own unit, then as a share of it.
    std::vector<std::pair<Index, double>> parts;
    double largest = 0.0;
    for (Index i = 0; i < result.x.size(); ++i) {
      const double scale = result.scales(i) > 0.0 ? result.scales(i) : 1.0;
      const double share =
          result.undetermined(i, k) * scale / (result.x(i) != 0.0 ? std::abs(result.x(i)) : 1.0);
      if (std::abs(result.undetermined(i, k)) > 0.02) {
        parts.emplace_back(i, share);
        largest = std::max(largest, std::abs(share));
      }
    }
    if (parts.size() == 1) {
      sentences.push_back(
          detail::format("{} does not change anything that was measured",
                         problem.names[static_cast<std::size_t>(parts.front().first)]));
      continue;
    }
    std::vector<std::string> moves;
    const double sign = parts.empty() || parts.front().second >= 0.0 ? 1.0 : -1.0;
    for (const auto& [place, share] : parts) {
      const double percent = sign * share / largest;
      moves.push_back(detail::format("{} by {}{} %", problem.names[static_cast<std::size_t>(place)],
                                     percent < 0.0 ? "-" : "+",
                                     text::number(std::abs(percent), 2)));
    }
    sentences.push_back(
        detail::format("changing {} changes nothing that was measured", text::enumerate(moves)));
  }
  return sentences;
}

}  // namespace flyball::identification
