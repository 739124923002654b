#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include <flyball/classical/delay_response.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/classical/transfer_function.hpp>
#include <flyball/systems/response.hpp>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// Step responses of transfer functions (appendix E).
namespace flyball::solve {

namespace {

using classical::TransferFunction;
using Eigen::Index;
using Eigen::VectorXd;

/// y at the samples of one that is rational, behind the dead time.
Expected<LinearResponse> response_of(const TransferFunction& transfer,
                                     const std::optional<ResponseTimes>& times) {
  const ContinuousSystem<> system = transfer.to_state_space();
  if (transfer.period()) {
    return step_response(
        DiscreteSystem<>{system.A, system.B, system.C, system.D, *transfer.period()}, 0, times);
  }
  return step_response(system, 0, times);
}

Expected<std::optional<ResponseTimes>> times_of(const Problem& problem,
                                                const std::optional<Time>& period) {
  constexpr std::string_view where = "step";
  if (!problem.has("duration")) {
    return std::optional<ResponseTimes>();
  }
  const double duration = problem.number("duration");
  FLYBALL_CHECK(Checks(where).positive(duration, "duration", "s"));
  const double count = period ? std::floor(duration / period->si() * (1.0 + 1e-12)) + 1.0
                              : problem.number("samples");
  FLYBALL_CHECK(check_size(2.0 * count, where, "duration"));
  if (count < 2.0 && !period) {
    return refusal(ArgumentError::out_of_range, where, "samples").expected("two at least");
  }
  return std::optional(
      ResponseTimes{period ? *period : Time(duration / (count - 1.0)), static_cast<Index>(count)});
}

Outcome solve_step_of(const TransferFunction& transfer, const Problem& problem,
                      JsonWriter& answer) {
  FLYBALL_TRY(const auto times, times_of(problem, transfer.period()));
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
  write_step_metrics("metrics", metrics, answer);
  return {};
}

/// Of several dead times: from the beginning on.
Outcome solve_step_of(const classical::DelaySystem& system, const Problem& problem,
                      JsonWriter& answer) {
  FLYBALL_TRY(const auto times, times_of(problem, system.period()));
  FLYBALL_TRY(const auto metrics, classical::step_metrics(system, 0, 0));
  FLYBALL_TRY(const auto response, classical::step_response(system, 0, times));
  answer.add("time", response.time);
  answer.add("y", VectorXd(response.y.col(0)));
  write_step_metrics("metrics", metrics, answer);
  return {};
}

Outcome solve_model_step(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto system, transfer_system_of(problem, "step"));
  return std::visit([&](const auto& one) { return solve_step_of(one, problem, answer); }, system);
}

}  // namespace

std::vector<Kind> step_kinds() {
  return {{"step",
           "a transfer function's output after its input has gone from 0 to 1, from rest",
           transfer_fields() +
               std::vector{
                   optional(
                       number("duration", "s", "how long after the dead time; chosen if left out")),
                   or_number(integer("samples", "of a continuous one, with a duration"), 601.0)},
           {list("time", "t", "s",
                 "from the end of the dead time, before which y is 0; from 0 with several"),
            list("y", "t", "", "the output"),
            step_metrics_field(
                "metrics",
                "10 to 90 %, 2 %, percent of the final value; exact in time, null where there "
                "is none")},
           R"({"num": [100], "den": [1, 2, 100], "duration": 3})",
           &solve_model_step}};
}

}  // namespace flyball::solve
