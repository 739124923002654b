#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/systems/model.hpp>

#include "core/try.hpp"
#include "study/simulation_record.hpp"

namespace flyball::study {

namespace {

const std::vector<double>& column(const Simulation& result, const std::string& name) {
  static const std::vector<double> none;
  const std::vector<double>* found = result.series.find(name);
  return found == nullptr ? none : *found;
}

SignalSummary summary_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {.min = *low, .max = *high, .final = values.back()};
}

/// From when on the values stay within 2 % of their largest distance from the reference.
std::optional<double> settling_time(const std::vector<double>& time,
                                    const std::vector<double>& values,
                                    const std::vector<double>& reference, bool is_angle) {
  constexpr double share = 0.02;
  std::vector<double> errors(values.size());
  std::transform(values.begin(), values.end(), reference.begin(), errors.begin(),
                 [&](double value, double wanted) {
                   return std::abs(is_angle ? angle_difference(value, wanted) : value - wanted);
                 });
  const double band = share * *std::max_element(errors.begin(), errors.end());
  std::size_t k = errors.size();
  while (k > 0 && errors[k - 1] <= band) {
    --k;
  }
  return k < errors.size() ? std::optional(time[k]) : std::nullopt;
}

}  // namespace

void summarize(Simulation& result) {
  const std::vector<double>& time = result.series.time();
  for (const ShownSignal& state : result.states) {
    result.state_summary.push_back(summary_of(column(result, state.truth)));
    const std::vector<double>& reference = column(result, state.reference);
    if (!reference.empty()) {
      result.state_summary.back().settling_time =
          settling_time(time, column(result, state.truth), reference, state.signal.is_angle);
    }
  }
  for (const ShownSignal& output : result.outputs) {
    result.output_summary.push_back(summary_of(column(result, output.truth)));
  }
  for (std::size_t i = 0; i < result.inputs.size(); ++i) {
    const std::vector<double>& applied = column(result, result.inputs[i].truth);
    InputSummary summary{summary_of(applied)};
    for (std::size_t k = 0; k + 1 < time.size(); ++k) {
      const double square = result.closed_loop
                                ? applied[k] * applied[k]
                                : 0.5 * (applied[k] * applied[k] + applied[k + 1] * applied[k + 1]);
      summary.energy += square * (time[k + 1] - time[k]);
    }
    const std::vector<double>& asked = column(result, result.inputs[i].estimate);
    const double limit = result.limits[i];
    const auto at_limit = std::count_if(asked.begin(), asked.end(),
                                        [&](double value) { return std::abs(value) >= limit; });
    summary.saturated_fraction =
        asked.empty() ? 0.0 : static_cast<double>(at_limit) / static_cast<double>(asked.size());
    result.input_summary.push_back(summary);
  }
}

Expected<Eigen::Index> steps_of(double duration, double step, Eigen::Index columns) {
  constexpr double most_numbers = 2e7;
  const double most_rows = std::min(1e6, most_numbers / static_cast<double>(columns));
  const double count = std::max(1.0, std::round(duration / step));
  if (!(count <= most_rows)) {
    return refusal(ArgumentError::out_of_range, "simulate", "the record")
        .got(fmt::format("{} rows long", format_number(count)))
        .expected(fmt::format("at most {} rows", format_number(most_rows, 7)))
        .hint("simulate for less time, or in longer steps");
  }
  return static_cast<Eigen::Index>(count);
}

}  // namespace flyball::study
