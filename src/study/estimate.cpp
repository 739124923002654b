#include <flyball/study/estimate.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "math/dense/dense.hpp"
#include "study/estimate_pass.hpp"
#include "study/model_runs.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using identification::ExperimentRun;

constexpr std::string_view job = "estimate";

Expected<void> check_noise(const ModelDescription& names, const VectorXd& noise) {
  for (Index i = 0; i < noise.size(); ++i) {
    const Coordinate& output = names.outputs[static_cast<std::size_t>(i)];
    if (std::isnan(noise(i))) {
      return refusal(ArgumentError::empty, job,
                     fmt::format("estimate.measurement_noise.{}", output.name))
          .got("not said")
          .expected("the standard deviation of a reading")
          .hint(fmt::format(
              "write [estimate] measurement_noise = {{ {} = \"0.01{}{}\" }}; --tune-noise "
              "finds the size from there",
              output.name, output.unit.empty() ? "" : " ", output.unit));
    }
  }
  return {};
}

InnovationTest test_of(const std::vector<EstimatedRun>& runs) {
  InnovationTest test;
  double sum = 0.0;
  double samples = 0.0;
  constexpr double confidence = 0.95;
  for (const EstimatedRun& run : runs) {
    for (std::size_t k = 0; k < run.nis.size(); ++k) {
      if (run.weight[k] > 0.0) {  // what a gate left out was no reading
        const auto entries = static_cast<double>(run.entries[k]);
        test.readings += run.entries[k];
        sum += run.nis[k];
        samples += 1.0;
        test.within += run.nis[k] <= chi_squared_quantile(confidence, entries) ? 1.0 : 0.0;
      }
    }
  }
  const auto readings = static_cast<double>(test.readings);
  if (test.readings > 0) {
    test.mean = sum / readings;
    test.within /= samples;
    test.low = chi_squared_quantile(0.5 - 0.5 * confidence, readings) / readings;
    test.high = chi_squared_quantile(0.5 + 0.5 * confidence, readings) / readings;
  }
  return test;
}

std::vector<identification::Whiteness> whiteness_of_outputs(const std::vector<EstimatedRun>& runs,
                                                            Index outputs) {
  std::vector<identification::Whiteness> all;
  for (Index i = 0; i < outputs; ++i) {
    std::vector<std::vector<double>> residuals;
    for (const EstimatedRun& run : runs) {
      // Innovations are white from one reading to the next, whatever time is between.
      std::vector<double>& row = residuals.emplace_back();
      for (const double value : VectorXd(run.innovations.row(i))) {
        if (!std::isnan(value)) {
          row.push_back(value);
        }
      }
    }
    all.push_back(identification::whiteness_of(residuals));
  }
  return all;
}

/// The states in the combination of which the readings told least, if they told hardly anything:
/// its variance beside that without a reading.
std::vector<std::string> unobserved_states(const EstimatePass& pass,
                                           const std::vector<Coordinate>& states) {
  constexpr double hardly = 0.9;
  constexpr double part = 0.3;  // of the largest one's
  std::vector<std::string> names;
  VectorXd size = pass.P_end_unmeasured.diagonal().cwiseMax(0.0).cwiseSqrt();
  if (!pass.P_end_unmeasured.allFinite()) {
    return names;  // an unstable model, which only readings hold
  }
  VectorXd inverse = VectorXd::Zero(size.size());
  for (Index i = 0; i < size.size(); ++i) {
    inverse(i) = size(i) > 0.0 ? 1.0 / size(i) : 0.0;  // what is known is not asked for
  }
  const auto scaled = [&](const MatrixXd& P) {
    return MatrixXd(inverse.asDiagonal() * P * inverse.asDiagonal());
  };
  MatrixXd open = scaled(pass.P_end_unmeasured);
  open.diagonal().array() += 1e-9;  // of combinations that are known
  const auto L = flyball::detail::cholesky_of(flyball::detail::symmetrized(open));
  if (!L) {
    return names;
  }
  const MatrixXd left = flyball::detail::solve_linear(*L, scaled(pass.P_end));
  const auto system = flyball::detail::symmetric_eigensystem_of(
      flyball::detail::symmetrized(flyball::detail::solve_linear(*L, left.transpose())));
  const Index last = size.size() - 1;
  if (!(system.values(last) > hardly)) {
    return names;
  }
  const VectorXd form =
      flyball::detail::solve_linear(L->transpose(), system.vectors.col(last)).cwiseAbs();
  for (Index i = 0; i <= last; ++i) {
    if (size(i) > 0.0 && form(i) >= part * form.maxCoeff()) {
      names.push_back(states[static_cast<std::size_t>(i)].name);
    }
  }
  return names;
}

void notice_passes(const Estimation& result, const std::vector<EstimatePass>& passes,
                   std::vector<Diagnostic>& all) {
  const auto longest = std::max_element(
      passes.begin(), passes.end(),
      [](const auto& a, const auto& b) { return a.run.time.size() < b.run.time.size(); });
  const auto unobserved = unobserved_states(*longest, result.model.names().states);
  if (!unobserved.empty()) {
    warn(all, "not_observed",
         "the readings tell hardly anything of {}: at the end it is as uncertain as without them",
         unobserved.size() == 1 ? unobserved.front()
                                : "a combination of " + text::enumerate(unobserved));
  }
  std::size_t not_moved = 0;
  std::size_t missing = 0;
  std::size_t left_out = 0;
  std::size_t limited = 0;
  constexpr double hardly = 0.1;
  for (const EstimatePass& pass : passes) {
    not_moved += pass.not_moved;
    limited += pass.limited;
    missing += static_cast<std::size_t>(pass.run.measured.array().isNaN().colwise().all().count());
    left_out +=
        static_cast<std::size_t>(std::count_if(pass.run.weight.begin(), pass.run.weight.end(),
                                               [](double weight) { return weight < hardly; }));
  }
  if (not_moved > 0) {
    warn(all, "left_the_numbers",
         "{} of the model left the numbers that there are, and the estimate stayed",
         text::count(not_moved, "prediction"));
  }
  if (limited > 0) {
    note(all, "at_a_limit",
         "at {} the estimate had left the limits of the states and was brought back",
         text::count(limited, "sample"));
  }
  if (std::any_of(passes.begin(), passes.end(), [](const auto& pass) { return pass.is_stiff; })) {
    warn(all, "stiff",
         "the model is so fast against the time between samples that 1000 steps of Runge and "
         "Kutta are too few: give its fast part as an equilibrium");
  }
  if (missing > 0) {
    note(all, "missing_readings", "at {} nothing is measured: the model alone tells",
         fmt::format("{} of the log", text::count(missing, "time")));
  }
  if (left_out > 0) {
    note(all, "outliers", "{} counted for less than a tenth, as they did not fit",
         text::count(left_out, "sample"));
  }
}

void notice(const Estimation& result, std::vector<Diagnostic>& all) {
  const ModelDescription& names = result.model.names();
  if (result.settings.process_noise.isZero(0.0)) {
    note(all, "no_process_noise",
         "no state has process noise, so that the filter trusts the model more and more; say how "
         "far states err: [estimate] process_noise = {{ {} = \"…\" }}",
         names.states.back().name);
  }
  const InnovationTest& test = result.nis;
  if (test.readings > 0 && !test.passed()) {
    warn(all, test.mean > 1.0 ? "innovations_too_large" : "innovations_too_small",
         "the innovations squared are {} times as large as the filter takes them for, where chance "
         "explains {} to {}: the noises are too {}{}",
         text::number(test.mean, 3), text::number(test.low, 3), text::number(test.high, 3),
         test.mean > 1.0 ? "small, or the model lacks something" : "large",
         result.tuned ? "" : "; --tune-noise finds them");
  }
  for (std::size_t i = 0; i < result.whiteness.size(); ++i) {
    if (result.whiteness[i].p_value < 0.01) {
      note(all, "innovations_not_white",
           "the innovations of {} can still be predicted from themselves: the model or the sizes "
           "of the noises to each other are wrong, and the bands are too narrow or too wide",
           names.outputs[i].name);
    }
  }
}

void notice_tuning(const ModelDescription& names, const TunedNoise& tuned,
                   const VectorXd& process_noise, std::vector<Diagnostic>& all) {
  if (!tuned.fit.converged || !tuned.settled) {
    warn(all, "no_convergence", "the noises may still move: {}",
         tuned.fit.converged
             ? "each linearisation of the model along the smoothed path gives others"
             : fmt::format("the search ended with {} of the log-likelihood to be gained",
                           text::number(tuned.fit.expected_gain, 2)));
  }
  const auto tell = [&](const NoiseDeviation& one, const std::string& name, std::string_view kind) {
    if (one.vanishes) {
      warn(
          all, "noise_vanishes",
          "the log is ever more likely the smaller the {} noise of {} is, as where readings repeat "
          "exactly: it ends at a millionth of the one given",
          kind, name);
    } else if (one.is_negligible) {
      note(all, "noise_not_seen", "the log is as likely without {} noise of {}", kind, name);
    } else if (one.is_free && !std::isfinite(one.relative_error)) {
      warn(all, "not_determined", "the log does not determine the {} noise of {}", kind, name);
    }
  };
  std::size_t next = 0;
  for (Index i = 0; i < process_noise.size(); ++i) {
    if (process_noise(i) > 0.0) {
      tell(tuned.fit.process[next++], names.states[static_cast<std::size_t>(i)].name, "process");
    }
  }
  for (std::size_t i = 0; i < tuned.fit.measurement.size(); ++i) {
    tell(tuned.fit.measurement[i], names.outputs[i].name, "measurement");
  }
}

}  // namespace

ExpectedAll<Estimation> estimate(const Log& log, const Project& project) {
  std::vector<Diagnostic> diagnostics = log.diagnostics;
  const auto refuse = [&](Error error) { return refused(job, std::move(error), diagnostics); };
  if (!project.model_job) {
    return refuse(refusal(ArgumentError::empty, {}, "the project").got("without a [model]"));
  }
  const ModelJob& of = *project.model_job;
  const FitSection& said = project.fit;
  Estimation result(of.model);
  result.log = log.source;
  result.project = project.path;
  result.settings = of.estimate;
  if (auto checked = check_noise(of.model.names(), of.estimate.measurement_noise); !checked) {
    return refuse(std::move(checked).error());
  }
  const auto runs = RunCutter(log, of, job, diagnostics)
                        .cut({.run = "run",
                              .channels = of.fit.channels,
                              .key = "channels",
                              .within = {said.from.value_or(-infinity), said.to.value_or(infinity)},
                              .every_channel = true});
  if (!runs) {
    return refuse(runs.error());
  }
  const identification::InputHold hold = of.fit.options.hold;
  if (of.estimate.tune) {
    auto tuned = tune_noise(of.model, *runs, result.settings, hold);
    if (!tuned) {
      return refuse(std::move(tuned).error());
    }
    notice_tuning(of.model.names(), *tuned, of.estimate.process_noise, diagnostics);
    result.relinearizations = tuned->relinearizations;
    result.tuned = std::move(tuned->fit);
  }
  auto passes = estimate_runs(of.model, *runs, result.settings, hold, result.settings.smoother);
  if (!passes) {
    return refuse(std::move(passes).error());
  }
  notice_passes(result, *passes, diagnostics);
  for (EstimatePass& pass : *passes) {
    result.log_likelihood += pass.log_likelihood;
    result.runs.push_back(std::move(pass.run));
  }
  result.nis = test_of(result.runs);
  result.whiteness = whiteness_of_outputs(result.runs, of.model.outputs());
  notice(result, diagnostics);
  result.diagnostics = std::move(diagnostics);
  return result;
}

}  // namespace flyball::study
