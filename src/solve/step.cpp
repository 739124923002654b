#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <flyball/classical/step_metrics.hpp>
#include <flyball/classical/transfer_function.hpp>
#include <flyball/systems/response.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Step responses of transfer functions (appendix E).
namespace flyball::solve {

namespace {

using classical::TransferFunction;
using Eigen::Index;
using Eigen::VectorXd;

/// y at the samples, behind the dead time.
Expected<LinearResponse> response_of(const TransferFunction& transfer,
                                     const std::optional<ResponseTimes>& times) {
  const ContinuousSystem<> system = transfer.to_state_space();
  if (transfer.period()) {
    return step_response(
        DiscreteSystem<>{system.A, system.B, system.C, system.D, *transfer.period()}, 0, times);
  }
  return step_response(system, 0, times);
}

Outcome solve_step(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "step";
  const double dt = problem.number("dt");
  FLYBALL_CHECK(Checks(where).not_negative(dt, "dt", "s"));
  FLYBALL_TRY(const auto transfer,
              TransferFunction::create(problem.matrix("num"), problem.matrix("den"),
                                       dt > 0.0 ? std::optional(Time(dt)) : std::nullopt,
                                       Time(problem.number("delay"))));
  std::optional<ResponseTimes> times;
  if (problem.has("duration")) {
    const double duration = problem.number("duration");
    FLYBALL_CHECK(Checks(where).positive(duration, "duration", "s"));
    const double count = transfer.period() ? std::floor(duration / dt * (1.0 + 1e-12)) + 1.0
                                           : problem.number("samples");
    FLYBALL_CHECK(check_size(2.0 * count, where, "duration"));
    if (count < 2.0 && !transfer.period()) {
      return refusal(ArgumentError::out_of_range, where, "samples").expected("two at least");
    }
    times = ResponseTimes{transfer.period() ? *transfer.period() : Time(duration / (count - 1.0)),
                          static_cast<Index>(count)};
  }
  FLYBALL_TRY(const auto metrics, classical::step_metrics(transfer));
  VectorXd time;
  VectorXd y;
  if (transfer.order() == 0) {
    const Index samples = times ? times->samples : 2;
    time = VectorXd::LinSpaced(samples, 0.0, times ? problem.number("duration") : 1.0);
    y = VectorXd::Constant(samples, transfer.dc_gain());
  } else {
    FLYBALL_TRY(const auto response, response_of(transfer, times));
    time = response.time;
    y = response.y.col(0);
  }
  answer.add("time", VectorXd(time.array() + transfer.delay()));
  answer.add("y", y);
  const auto or_nan = [](const std::optional<double>& value) {
    return value.value_or(std::numeric_limits<double>::quiet_NaN());
  };
  answer.add("metrics", {{"rise_time", or_nan(metrics.rise_time)},
                         {"settling_time", or_nan(metrics.settling_time)},
                         {"overshoot", 100.0 * or_nan(metrics.overshoot)},
                         {"undershoot", 100.0 * or_nan(metrics.undershoot)},
                         {"peak", or_nan(metrics.peak)},
                         {"peak_time", or_nan(metrics.peak_time)},
                         {"final_value", metrics.final_value}});
  return {};
}

}  // namespace

std::vector<Kind> step_kinds() {
  return {
      {"step",
       "a transfer function's output after its input has gone from 0 to 1, from rest",
       {list("num", "v", "", "the numerator's coefficients, the highest power first"),
        list("den", "o", "", "the denominator's"),
        or_number(number("dt", "s", "sample period of a discrete one, of z; 0 for one of s"), 0.0),
        or_number(number("delay", "s", "dead time, exact"), 0.0),
        optional(number("duration", "s", "how long after the dead time; chosen if left out")),
        or_number(integer("samples", "of a continuous one, with a duration"), 601.0)},
       {list("time", "t", "s", "from the end of the dead time, before which y is 0"),
        list("y", "t", "", "the output"),
        record("metrics", "rise_time settling_time overshoot undershoot peak peak_time final_value",
               "10 to 90 %, 2 %, percent of the final value; exact in time, null where there "
               "is none")},
       R"({"num": [100], "den": [1, 2, 100], "duration": 3})",
       &solve_step}};
}

}  // namespace flyball::solve
