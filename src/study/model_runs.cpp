#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/core/unit_algebra.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/model_runs.hpp"

namespace flyball::study {

/// A channel of the log for a coordinate of the model, and the factor into its unit.
struct RunCutter::Channel {
  const Signal* signal = nullptr;
  double factor = 1.0;

  /// The value at a time: the last one before, or on the line to the next.
  [[nodiscard]] double value_at(double t, identification::InputHold hold) const;
  /// The value measured at a time, if one was. @param apart  s, how far off it may be.
  [[nodiscard]] double measured_at(double t, double apart) const;
};

namespace {

using Eigen::Index;
using identification::ExperimentRun;
using identification::InputHold;

/// Times within the part, and what is usually between two of them.
struct Clock {
  std::vector<double> times{};
  double interval = 0.0;
};

Clock clock_of(const Signal& signal, const Part& part) {
  Clock clock;
  std::vector<double> apart;
  for (const double t : signal.time) {
    if (part.within.holds(t) && !part.without.holds(t)) {
      if (!clock.times.empty()) {
        apart.push_back(t - clock.times.back());
      }
      clock.times.push_back(t);
    }
  }
  if (!apart.empty()) {
    const auto middle = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
    std::nth_element(apart.begin(), middle, apart.end());
    clock.interval = *middle;
  }
  return clock;
}

/// The times of both, each once; the longer interval.
void merge(Clock& clock, Clock other) {
  std::vector<double> all;
  std::set_union(clock.times.begin(), clock.times.end(), other.times.begin(), other.times.end(),
                 std::back_inserter(all));
  clock.times = std::move(all);
  clock.interval = std::max(clock.interval, other.interval);
}

}  // namespace

Expected<RunCutter::Channel> RunCutter::channel_of(const std::string& name, const Coordinate& of,
                                                   std::string_view key) const {
  const Signal* signal = log_.find_signal(name);
  if (signal == nullptr) {
    std::vector<std::string_view> names;
    for (const Signal& one : log_.signals) {
      names.push_back(one.name);
    }
    const std::string nearest = nearest_name(name, names);
    const std::string there = names.size() > 12 ? fmt::format("{} others are", names.size())
                                                : fmt::format("{}", fmt::join(names, ", "));
    return refusal(ArgumentError::unknown_name, job_, fmt::format("\"{}\"", name))
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
      return refusal(ArgumentError::wrong_unit, job_, fmt::format("\"{}\" of the log", name))
          .got(fmt::format("in {}", signal->unit))
          .expected(fmt::format("in {}, as {} of the model is", of.unit, of.name));
    }
  }
  return made;
}

double RunCutter::Channel::value_at(double t, InputHold hold) const {
  const std::vector<double>& time = signal->time;
  const auto after = std::upper_bound(time.begin(), time.end(), t);
  if (after == time.begin()) {
    return nan;
  }
  const auto k = static_cast<std::size_t>(after - time.begin()) - 1;
  const std::vector<double>& value = signal->value;
  double found = value[k];
  if (hold != InputHold::held && after != time.end() && *after > time[k]) {
    found += (t - time[k]) / (*after - time[k]) * (value[k + 1] - value[k]);
  }
  return factor * found;
}

double RunCutter::Channel::measured_at(double t, double apart) const {
  const std::vector<double>& time = signal->time;
  const auto next = std::lower_bound(time.begin(), time.end(), t - apart);
  return next != time.end() && *next <= t + apart
             ? factor * signal->value[static_cast<std::size_t>(next - time.begin())]
             : nan;
}

Expected<std::vector<ExperimentRun>> RunCutter::cut(const Part& part) {
  const ModelDescription& names = model_job_.model.names();
  std::vector<Channel> inputs;
  std::vector<Channel> outputs;
  for (std::size_t i = 0; i < part.channels.size(); ++i) {
    const bool is_input = i < names.inputs.size();
    const Coordinate& of = is_input ? names.inputs[i] : names.outputs[i - names.inputs.size()];
    FLYBALL_TRY(const Channel found, channel_of(part.channels[i], of, part.key));
    (is_input ? inputs : outputs).push_back(found);
  }
  const Signal& first_output = *outputs.front().signal;
  Clock clock = clock_of(first_output, part);
  for (std::size_t i = 1; part.every_channel && i < outputs.size(); ++i) {
    merge(clock, clock_of(*outputs[i].signal, part));
  }
  if (part.every_channel && !clock.times.empty()) {
    const double interval = clock.interval;
    const Stretch measured{clock.times.front(), clock.times.back()};
    for (const Channel& input : inputs) {
      Clock own = clock_of(*input.signal, part);
      std::erase_if(own.times, [&](double t) { return !measured.holds(t); });
      merge(clock, std::move(own));
    }
    clock.interval = interval;
  }
  const std::vector<double>& times = clock.times;
  if (times.size() < 2) {
    return refusal(ArgumentError::out_of_range, job_,
                   fmt::format("the part of the log for the {}", part.run))
        .got(fmt::format("{} of {}", text::count(times.size(), "sample"), first_output.name))
        .expected("two samples at least")
        .hint(first_output.time.empty()
                  ? "the channel is empty"
                  : fmt::format(
                        "the log has it from {} to {}{}", text::seconds(first_output.time.front()),
                        text::seconds(first_output.time.back()),
                        std::isnan(part.without.from) ? "" : "; what is kept aside is not fitted"));
  }
  const double interval = clock.interval;
  const double apart = part.every_channel ? 0.0 : 0.25 * interval;
  std::vector<ExperimentRun> runs;
  std::size_t first = 0;
  constexpr double jump = 20.0;  // intervals, from where a new run begins
  for (std::size_t k = 1; k <= times.size(); ++k) {
    if (k == times.size() || times[k] - times[k - 1] > jump * interval ||
        (times[k - 1] < part.without.from && times[k] > part.without.to)) {
      add_run({times.begin() + static_cast<std::ptrdiff_t>(first),
               times.begin() + static_cast<std::ptrdiff_t>(k)},
              inputs, outputs, apart, runs);
      first = k;
    }
  }
  if (runs.empty()) {
    return refusal(ArgumentError::out_of_range, job_,
                   fmt::format("the part of the log for the {}", part.run))
        .got("without two times at which every input has a value");
  }
  for (std::size_t r = 0; r < runs.size(); ++r) {
    runs[r].name = runs.size() == 1 ? std::string(part.run) : fmt::format("{} {}", part.run, r + 1);
  }
  return runs;
}

void RunCutter::add_run(const std::vector<double>& times, const std::vector<Channel>& inputs,
                        const std::vector<Channel>& outputs, double apart,
                        std::vector<ExperimentRun>& runs) {
  const auto rows = [](const std::vector<Channel>& list) {
    return static_cast<Index>(list.size());
  };
  ExperimentRun run;
  run.initial = model_job_.fit.initial;
  run.inputs.resize(rows(inputs), static_cast<Index>(times.size()));
  run.outputs.resize(rows(outputs), static_cast<Index>(times.size()));
  Index count = 0;
  for (const double t : times) {
    bool whole = true;
    for (Index i = 0; i < rows(inputs); ++i) {
      run.inputs(i, count) =
          inputs[static_cast<std::size_t>(i)].value_at(t, model_job_.fit.options.hold);
      whole = whole && !std::isnan(run.inputs(i, count));
    }
    if (!whole || (count > 0 && !(t > run.time.back()))) {
      ++dropped_;
      continue;
    }
    for (Index i = 0; i < rows(outputs); ++i) {
      run.outputs(i, count) = outputs[static_cast<std::size_t>(i)].measured_at(t, apart);
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

}  // namespace flyball::study
