#include <flyball/control/response_metrics.hpp>

#include <cmath>
#include <string>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_response_metrics = "response_metrics";

Expected<void> check_samples(std::span<const double> times, std::span<const double> values) {
  if (values.size() != times.size() || times.size() < 2) {
    return refusal(ArgumentError::wrong_shape, in_response_metrics, "values")
        .got(detail::format("{} for {} times", values.size(), times.size()))
        .expected("as many as times, at least two");
  }
  for (std::size_t k = 0; k < times.size(); ++k) {
    FLYBALL_CHECK(
        Checks(in_response_metrics).finite(times[k], "times").finite(values[k], "values"));
    if (k > 0 && !(times[k] > times[k - 1])) {
      return refusal(ArgumentError::out_of_range, in_response_metrics,
                     detail::format("times[{}]", k))
          .got(format_number(times[k]))
          .expected("after the one before it, " + format_number(times[k - 1]));
    }
  }
  return {};
}

}  // namespace

Expected<ResponseMetrics> response_metrics(std::span<const double> times,
                                           std::span<const double> values, double reference,
                                           double tolerance) {
  FLYBALL_CHECK(Checks(in_response_metrics)
                    .also([&] { return check_samples(times, values); })
                    .finite(reference, "reference")
                    .positive(tolerance, "tolerance"));
  const double start = values.front();
  const double step = reference - start;
  if (step == 0.0 || tolerance >= 1.0) {
    return refusal(ArgumentError::out_of_range, in_response_metrics,
                   step == 0.0 ? "reference" : "tolerance")
        .got(format_number(step == 0.0 ? reference : tolerance))
        .expected(step == 0.0 ? "different from the first value" : "below 1, a share of the step");
  }
  // In units of the step: from 0 to 1, whichever way it goes.
  const auto share = [&](std::size_t k) { return (values[k] - start) / step; };
  const auto crossing = [&](std::size_t k, double level) {
    const double before = share(k - 1);
    const double part = (level - before) / (share(k) - before);
    return times[k - 1] + part * (times[k] - times[k - 1]) - times.front();
  };
  ResponseMetrics metrics;
  metrics.peak = start;
  double largest = 0.0;
  double least = 0.0;
  std::optional<double> tenth;
  std::optional<double> settled;
  int side = -1;
  if (std::abs(share(0) - 1.0) <= tolerance) {
    settled = 0.0;
  }
  for (std::size_t k = 1; k < values.size(); ++k) {
    const double now = share(k);
    if (now > largest) {
      largest = now;
      metrics.peak = values[k];
      metrics.peak_time = times[k] - times.front();
    }
    least = std::min(least, now);
    if (!tenth && now >= 0.1) {
      tenth = crossing(k, 0.1);
    }
    if (tenth && !metrics.rise_time_10_90 && now >= 0.9) {
      metrics.rise_time_10_90 = crossing(k, 0.9) - *tenth;
    }
    if (!metrics.rise_time && now >= 1.0) {
      metrics.rise_time = crossing(k, 1.0);
    }
    const double off = now - 1.0;
    if (std::abs(off) > tolerance) {
      settled.reset();
      const int sign = off > 0.0 ? 1 : -1;
      metrics.crossings += sign != side ? 1 : 0;
      side = sign;
    } else if (!settled) {
      settled = crossing(k, share(k - 1) > 1.0 ? 1.0 + tolerance : 1.0 - tolerance);
    }
  }
  metrics.settling_time = settled;
  metrics.overshoot = std::max(0.0, largest - 1.0);
  metrics.undershoot = -least;
  metrics.final_value = values.back();
  metrics.steady_state_error = reference - values.back();
  metrics.type = metrics.overshoot > tolerance ? ResponseType::underdamped
                 : metrics.rise_time           ? ResponseType::critically_damped
                                               : ResponseType::overdamped;
  return metrics;
}

}  // namespace flyball
