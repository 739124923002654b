#include <flyball/study/identify_model.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/told.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using identification::ExperimentRun;
using identification::InputHold;

constexpr std::string_view job = "identify";
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A channel of the log for a coordinate of the model, and the factor into its unit.
struct Channel {
  const Signal* signal = nullptr;
  double factor = 1.0;
};

/// @param key  Of [fit], which says the channels.
Expected<Channel> channel_of(const Log& log, const std::string& name, const Coordinate& of,
                             std::string_view key) {
  const Signal* signal = log.find_signal(name);
  if (signal == nullptr) {
    std::vector<std::string_view> names;
    for (const Signal& one : log.signals) {
      names.push_back(one.name);
    }
    const std::string nearest = nearest_name(name, names);
    const std::string there = names.size() > 12 ? fmt::format("{} others are", names.size())
                                                : fmt::format("{}", fmt::join(names, ", "));
    return refusal(ArgumentError::unknown_name, job, fmt::format("\"{}\"", name))
        .got("not a channel of the log")
        .hint(fmt::format("{}say it in [fit]: {} = {{ {} = \"…\" }}; there {} {}",
                          nearest.empty() ? "" : fmt::format("did you mean \"{}\"? Or ", nearest),
                          key, of.name, names.size() == 1 ? "is" : "are", there));
  }
  Channel made{signal, 1.0};
  if (!signal->unit.empty() && !of.unit.empty()) {
    const auto given = parse_si_unit(signal->unit);
    const auto wanted = parse_si_unit(of.unit);
    if (given && wanted && given->dimension.fits(wanted->dimension)) {
      made.factor = given->factor;
    } else if (given && wanted) {
      return refusal(ArgumentError::wrong_unit, job, fmt::format("\"{}\" of the log", name))
          .got(fmt::format("in {}", signal->unit))
          .expected(fmt::format("in {}, as {} of the model is", of.unit, of.name));
    }
  }
  return made;
}

/// The value at a time: the last one before, or on the line to the next.
double value_at(const Channel& channel, double t, InputHold hold) {
  const std::vector<double>& time = channel.signal->time;
  const auto after = std::upper_bound(time.begin(), time.end(), t);
  if (after == time.begin()) {
    return nan;
  }
  const auto k = static_cast<std::size_t>(after - time.begin()) - 1;
  const std::vector<double>& value = channel.signal->value;
  double found = value[k];
  if (hold != InputHold::held && after != time.end() && *after > time[k]) {
    found += (t - time[k]) / (*after - time[k]) * (value[k + 1] - value[k]);
  }
  return channel.factor * found;
}

/// The value measured at a time, if one was.
double measured_at(const Channel& channel, double t, double apart) {
  const std::vector<double>& time = channel.signal->time;
  const auto next = std::lower_bound(time.begin(), time.end(), t - 0.25 * apart);
  return next != time.end() && *next <= t + 0.25 * apart
             ? channel.factor * channel.signal->value[static_cast<std::size_t>(next - time.begin())]
             : nan;
}

/// A stretch of the log's time; of NaN it is none.
struct Stretch {
  double from = nan;
  double to = nan;
  [[nodiscard]] bool holds(double t) const { return t >= from && t <= to; }
};

/// What a part of the log is cut from.
struct Part {
  std::string_view run;  ///< What its runs are called.
  const std::vector<std::string>& channels;
  std::string_view key;  ///< Of [fit], which says the channels.
  Stretch within{};
  Stretch without{};
};

class Cutter {
 public:
  Cutter(const Log& log, const ModelJob& of, std::vector<Diagnostic>& diagnostics)
      : log_(log), job_(of), diagnostics_(diagnostics) {}

  Expected<std::vector<ExperimentRun>> cut(const Part& part) {
    const ModelDescription& names = job_.model.names();
    std::vector<Channel> inputs;
    std::vector<Channel> outputs;
    for (std::size_t i = 0; i < part.channels.size(); ++i) {
      const bool is_input = i < names.inputs.size();
      const Coordinate& of = is_input ? names.inputs[i] : names.outputs[i - names.inputs.size()];
      FLYBALL_TRY(const Channel found, channel_of(log_, part.channels[i], of, part.key));
      (is_input ? inputs : outputs).push_back(found);
    }
    const Signal& clock = *outputs.front().signal;
    std::vector<double> times;
    std::vector<double> apart;
    for (const double t : clock.time) {
      if (part.within.holds(t) && !part.without.holds(t)) {
        if (!times.empty()) {
          apart.push_back(t - times.back());
        }
        times.push_back(t);
      }
    }
    if (times.size() < 2) {
      return refusal(ArgumentError::out_of_range, job,
                     fmt::format("the part of the log for the {}", part.run))
          .got(fmt::format("{} of {}", text::count(times.size(), "sample"), clock.name))
          .expected("two samples at least")
          .hint(
              clock.time.empty()
                  ? "the channel is empty"
                  : fmt::format(
                        "the log has it from {} to {}{}", text::seconds(clock.time.front()),
                        text::seconds(clock.time.back()),
                        std::isnan(part.without.from) ? "" : "; what is kept aside is not fitted"));
    }
    const auto middle = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
    std::nth_element(apart.begin(), middle, apart.end());
    const double interval = *middle;
    std::vector<ExperimentRun> runs;
    std::size_t first = 0;
    constexpr double jump = 20.0;  // intervals, from where a new run begins
    for (std::size_t k = 1; k <= times.size(); ++k) {
      if (k == times.size() || times[k] - times[k - 1] > jump * interval ||
          (times[k - 1] < part.without.from && times[k] > part.without.to)) {
        add_run({times.begin() + static_cast<std::ptrdiff_t>(first),
                 times.begin() + static_cast<std::ptrdiff_t>(k)},
                inputs, outputs, interval, runs);
        first = k;
      }
    }
    if (runs.empty()) {
      return refusal(ArgumentError::out_of_range, job,
                     fmt::format("the part of the log for the {}", part.run))
          .got("without two times at which every input has a value");
    }
    for (std::size_t r = 0; r < runs.size(); ++r) {
      runs[r].name =
          runs.size() == 1 ? std::string(part.run) : fmt::format("{} {}", part.run, r + 1);
    }
    return runs;
  }

 private:
  void add_run(const std::vector<double>& times, const std::vector<Channel>& inputs,
               const std::vector<Channel>& outputs, double interval,
               std::vector<ExperimentRun>& runs) {
    const auto rows = [](const std::vector<Channel>& list) {
      return static_cast<Index>(list.size());
    };
    ExperimentRun run;
    run.initial = job_.fit.initial;
    run.inputs.resize(rows(inputs), static_cast<Index>(times.size()));
    run.outputs.resize(rows(outputs), static_cast<Index>(times.size()));
    Index count = 0;
    for (const double t : times) {
      bool whole = true;
      for (Index i = 0; i < rows(inputs); ++i) {
        run.inputs(i, count) =
            value_at(inputs[static_cast<std::size_t>(i)], t, job_.fit.options.hold);
        whole = whole && !std::isnan(run.inputs(i, count));
      }
      if (!whole || (count > 0 && !(t > run.time.back()))) {
        ++dropped_;
        continue;
      }
      for (Index i = 0; i < rows(outputs); ++i) {
        run.outputs(i, count) = measured_at(outputs[static_cast<std::size_t>(i)], t, interval);
      }
      run.time.push_back(t);
      ++count;
    }
    run.inputs.conservativeResize(Eigen::NoChange, count);
    run.outputs.conservativeResize(Eigen::NoChange, count);
    if (count > 1) {
      runs.push_back(std::move(run));
    }
    if (dropped_ > 0) {
      warn(diagnostics_, "rows_without_input",
           "{} without a value of every input before them, or repeated, were dropped",
           text::count(dropped_, "sample"));
      dropped_ = 0;
    }
  }

  const Log& log_;
  const ModelJob& job_;
  std::vector<Diagnostic>& diagnostics_;
  std::size_t dropped_ = 0;
};

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
  const auto refuse = [&](Error error) { return refused(job, std::move(error), diagnostics); };
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
  Cutter cutter(log, of, diagnostics);
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
