#include <flyball/study/identify_model.hpp>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/model_runs.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using identification::ExperimentRun;

constexpr std::string_view this_job = "identify";

/// Parameters whose own value is not in their range, which is where the search starts.
void notice_starts(const ModelJob& of, std::vector<Diagnostic>& all) {
  for (const Parameter& parameter : of.model.description().parameters) {
    for (const identification::FreeParameter& free : of.fit.free) {
      if (free.name == parameter.name &&
          !(parameter.value >= free.lower && parameter.value <= free.upper)) {
        note(all, "start_moved",
             "[model] has {} outside the range that [fit] gives it; the search starts at its end",
             free.name);
      }
    }
  }
}

/// What the fit itself is to be told of.
void notice(const ModelIdentification& result, std::vector<Diagnostic>& all) {
  using optimization::Bound;
  const identification::PredictionErrorFit& fit = result.fit;
  if (!fit.minimum.converged) {
    warn(all, "no_convergence",
         "the search ended ({}) before its optimum: the parameters may still move",
         to_string(fit.minimum.stop));
  }
  for (const identification::FittedParameter& one : fit.parameters) {
    if (one.bound == Bound::lower || one.bound == Bound::upper) {
      warn(all, "at_bound",
           "{} is at the {} end of its range, which the log would have it beyond: the range or "
           "the model is wrong",
           one.name, one.bound == Bound::lower ? "lower" : "upper");
    }
  }
  for (const std::string& sentence : fit.undetermined) {
    warn(all, "not_determined", "{}; fix one of them, or measure more", sentence);
  }
  if (fit.start_costs.size() > 1 && fit.agreeing_starts == 1) {
    warn(all, "starts_disagree",
         "of {} starts one alone ended at the best fit; more starts may find a better one",
         fit.start_costs.size());
  }
  for (std::size_t p = 0; p < fit.whiteness.size(); ++p) {
    if (!fit.whiteness[p].is_white()) {
      note(all, "residuals_not_white",
           "what the simulation leaves of {} can still be predicted from itself: the model lacks "
           "something; the intervals are those of errors that last {}",
           fit.model.names().outputs[p].name,
           text::count(static_cast<std::size_t>(fit.correlated_samples), "sample"));
    }
  }
}

}  // namespace

Expected<Log> read_model_log(const std::string& path, const Project& project) {
  const bool is_table = !path.ends_with(".wpilog") && !path.ends_with(".json");
  if (!project.fit.period || !is_table) {
    return read_log(path).map_error([&](Error error) {
      return error.is(LogError::no_time)
                 ? std::move(error).hint(
                       "name the column of time \"Time (s)\" in the header, or say "
                       "what is between rows: [fit] period = \"20 ms\"")
                 : std::move(error);
    });
  }
  return read_file(path).and_then(
      [&](const std::string& text) { return parse_csv(text, path, *project.fit.period); });
}

ExpectedAll<ModelIdentification> identify_model(const Log& log, const Project& project) {
  std::vector<Diagnostic> diagnostics = log.diagnostics;
  const auto refuse = [&](Error error) { return refused(this_job, std::move(error), diagnostics); };
  if (!project.model_job) {
    return refuse(refusal(ArgumentError::empty, {}, "the project").got("without a [model]"));
  }
  const ModelJob& of = *project.model_job;
  const FitSection& said = project.fit;
  if (of.fit.free.empty() && said.free_initial.empty()) {
    return refuse(
        refusal(ArgumentError::empty, {}, "[fit]")
            .got("without anything to look for")
            .hint(fmt::format("say what is free, such as [fit] free = {{ {} = \"free\" }}",
                              of.model.names().parameters.empty()
                                  ? "k"
                                  : of.model.names().parameters.front().name)));
  }
  notice_starts(of, diagnostics);
  RunCutter cutter(log, of, this_job, diagnostics);
  const bool other_channels = !of.fit.validation_channels.empty();
  const bool keeps_aside = other_channels || said.validation_from || said.validation_to;
  const Stretch validation{said.validation_from.value_or(-infinity),
                           said.validation_to.value_or(infinity)};
  auto runs = cutter.cut({"fit",
                          of.fit.channels,
                          "channels",
                          {said.from.value_or(-infinity), said.to.value_or(infinity)},
                          keeps_aside && !other_channels ? validation : Stretch{}});
  if (!runs) {
    return refuse(std::move(runs).error());
  }
  std::vector<ExperimentRun> aside;
  if (keeps_aside) {
    auto cut =
        cutter.cut({"validation", other_channels ? of.fit.validation_channels : of.fit.channels,
                    other_channels ? "validation_channels" : "channels", validation});
    if (!cut) {
      return refuse(std::move(cut).error());
    }
    aside = *std::move(cut);
  }
  auto fit = identification::fit_model(of.model, *runs, of.fit.free, of.fit.options);
  if (!fit) {
    return refuse(std::move(fit).error());
  }
  ModelIdentification result(*std::move(fit));
  result.log = log.source;
  result.project = project.path;
  result.name = of.model.names().name;
  result.confidence = of.fit.options.confidence;
  result.runs = *std::move(runs);
  for (ExperimentRun& run : aside) {
    for (std::size_t i = 0; said.same_initial && i < run.initial.size(); ++i) {
      run.initial[i] = {.value = result.fit.runs.front().initial(static_cast<Index>(i))};
    }
    auto predicted = identification::validate(result.fit, run, of.fit.options);
    if (!predicted) {
      return refuse(std::move(predicted).error());
    }
    result.validation.push_back(*std::move(predicted));
  }
  result.validation_runs = std::move(aside);
  notice(result, diagnostics);
  result.diagnostics = std::move(diagnostics);
  return result;
}

}  // namespace flyball::study
