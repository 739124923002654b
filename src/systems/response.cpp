#include <flyball/systems/response.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/systems/discretize.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "systems/linear_recurrence.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index most_samples = 10'000'000;

Expected<void> check_times(const ResponseTimes& times, std::string_view where) {
  return Checks(where)
      .positive(times.step.si(), "step", "s")
      .within(static_cast<double>(times.samples), 1.0, static_cast<double>(most_samples),
              "samples");
}

Expected<void> check_input(Index input, Index inputs, std::string_view where) {
  if (input >= 0 && input < inputs) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, "input")
      .got(detail::format("{}", input))
      .expected(detail::format("from 0 to {}: B has {} column{}", inputs - 1, inputs,
                               inputs == 1 ? "" : "s"));
}

Expected<LinearResponse> respond(const DiscreteSystem<>& system, const MatrixRef& u,
                                 const MatrixRef& x0, std::string_view where) {
  FLYBALL_CHECK(check_system_or_gain(system, where));
  const Index samples = u.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(u, samples, system.B.cols(), "u", "samples x inputs")
                    .shape(x0, system.A.rows(), 1, "x0", "states x 1")
                    .finite(u, "u")
                    .finite(x0, "x0"));
  LinearResponse response{
      VectorXd::LinSpaced(samples, 0.0, system.period.si() * static_cast<double>(samples - 1)),
      MatrixXd(samples + 1, system.A.rows()), MatrixXd(samples, system.C.rows())};
  VectorXd x = x0;
  response.x.row(0) = x.transpose();
  detail::run_recurrence(system, u, x, response.x.data(), samples + 1, response.y);
  FLYBALL_CHECK(Checks(where).finite(response.x, "x").finite(response.y, "y"));
  return response;
}

/// The system with its input held; a static gain needs no exponential.
Expected<DiscreteSystem<>> held(const ContinuousSystem<>& system, Time step) {
  if (system.A.size() == 0) {
    FLYBALL_CHECK(check_positive(step.si(), "discretize", "step", "s"));
    return DiscreteSystem<>{system.A, system.B, system.C, system.D, step};
  }
  return discretize(system, step);
}

/// The instants that were asked for, or those that the poles ask for.
Expected<ResponseTimes> chosen(const ContinuousSystem<>& system,
                               const std::optional<ResponseTimes>& times, std::string_view where) {
  FLYBALL_CHECK(check_system_or_gain(system, where));
  if (times) {
    return check_times(*times, where).map([&] { return *times; });
  }
  if (system.A.size() == 0) {
    return response_times({});
  }
  return analyze_modes(system).map(
      [](const ModalAnalysis& modes) { return response_times(modes); });
}

Expected<ResponseTimes> chosen(const DiscreteSystem<>& system,
                               const std::optional<ResponseTimes>& times, std::string_view where) {
  FLYBALL_CHECK(check_system_or_gain(system, where));
  if (!times && system.A.size() == 0) {
    return response_times({}, system.period);
  }
  if (!times) {
    return analyze_modes(system).map(
        [&](const ModalAnalysis& modes) { return response_times(modes, system.period); });
  }
  FLYBALL_CHECK(check_times(*times, where));
  if (times->step.si() != system.period.si()) {
    return refusal(ArgumentError::out_of_range, where, "step")
        .got(detail::format("{} s", times->step.si()))
        .expected(detail::format("the system's period, {} s", system.period.si()));
  }
  return *times;
}

/// One input is 1 in its first `length` samples.
MatrixXd pulse(Index samples, Index inputs, Index input, Index length) {
  MatrixXd u = MatrixXd::Zero(samples, inputs);
  u.col(input).head(length).setOnes();
  return u;
}

}  // namespace

ResponseTimes response_times(const ModalAnalysis& modes, std::optional<Time> period) {
  double slowest = 0.0;
  double fastest = 0.0;
  double growing = std::numeric_limits<double>::infinity();
  for (const Mode& mode : modes.modes) {
    const double tau = std::abs(mode.time_constant);
    if (std::isfinite(tau) && tau > 0.0 && mode.stability != Stability::marginal) {
      slowest = std::max(slowest, tau);
      growing = mode.stability == Stability::unstable ? std::min(growing, tau) : growing;
    }
    if (std::isfinite(mode.natural_frequency)) {
      fastest = std::max(fastest, mode.natural_frequency);
    }
  }
  double end = 1.0;
  if (slowest > 0.0) {
    end = std::min(6.0 * slowest, 5.0 * growing);
  } else if (fastest > 0.0) {
    end = 40.0 / fastest;  // about six turns of an undamped oscillation
  }
  end = std::clamp(end, 1e-290, 1e290);  // so that its parts and multiples are numbers
  const double step = period ? period->si() : end / 600.0;
  // Ten samples of a mode that grows a thousandfold in each would overflow.
  const double most = std::max(1.0, std::min(2000.0, std::floor(500.0 * growing / step)));
  const double steps = std::clamp(std::ceil(end / step), std::min(10.0, most), most);
  return {Time(step), static_cast<Index>(steps) + 1};
}

Expected<LinearResponse> forced_response(const DiscreteSystem<>& system, const MatrixRef& u,
                                         const MatrixRef& x0) {
  return respond(system, u, x0, "forced_response");
}

Expected<LinearResponse> forced_response(const ContinuousSystem<>& system, const MatrixRef& u,
                                         const MatrixRef& x0, Time step) {
  FLYBALL_CHECK(check_system_or_gain(system, "forced_response"));
  FLYBALL_TRY(const auto sampled, held(system, step));
  return respond(sampled, u, x0, "forced_response");
}

Expected<LinearResponse> initial_response(const DiscreteSystem<>& system, const MatrixRef& x0,
                                          const std::optional<ResponseTimes>& times) {
  constexpr std::string_view where = "initial_response";
  FLYBALL_TRY(const auto at, chosen(system, times, where));
  return respond(system, MatrixXd::Zero(at.samples, system.B.cols()), x0, where);
}

Expected<LinearResponse> initial_response(const ContinuousSystem<>& system, const MatrixRef& x0,
                                          const std::optional<ResponseTimes>& times) {
  FLYBALL_TRY(const auto at, chosen(system, times, "initial_response"));
  FLYBALL_TRY(const auto sampled, held(system, at.step));
  return initial_response(sampled, x0, at);
}

Expected<LinearResponse> step_response(const DiscreteSystem<>& system, Index input,
                                       const std::optional<ResponseTimes>& times) {
  constexpr std::string_view where = "step_response";
  FLYBALL_TRY(const auto at, chosen(system, times, where));
  FLYBALL_CHECK(check_input(input, system.B.cols(), where));
  return respond(system, pulse(at.samples, system.B.cols(), input, at.samples),
                 VectorXd::Zero(system.A.rows()), where);
}

Expected<LinearResponse> step_response(const ContinuousSystem<>& system, Index input,
                                       const std::optional<ResponseTimes>& times) {
  FLYBALL_TRY(const auto at, chosen(system, times, "step_response"));
  FLYBALL_TRY(const auto sampled, held(system, at.step));
  return step_response(sampled, input, at);
}

Expected<LinearResponse> impulse_response(const DiscreteSystem<>& system, Index input,
                                          const std::optional<ResponseTimes>& times) {
  constexpr std::string_view where = "impulse_response";
  FLYBALL_TRY(const auto at, chosen(system, times, where));
  FLYBALL_CHECK(check_input(input, system.B.cols(), where));
  return respond(system, pulse(at.samples, system.B.cols(), input, 1),
                 VectorXd::Zero(system.A.rows()), where);
}

Expected<LinearResponse> impulse_response(const ContinuousSystem<>& system, Index input,
                                          const std::optional<ResponseTimes>& times) {
  constexpr std::string_view where = "impulse_response";
  FLYBALL_TRY(const auto at, chosen(system, times, where));
  FLYBALL_CHECK(check_input(input, system.B.cols(), where));
  FLYBALL_TRY(const auto sampled, held(system, at.step));
  return respond(sampled, MatrixXd::Zero(at.samples, system.B.cols()), system.B.col(input), where);
}

}  // namespace flyball
