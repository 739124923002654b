#include <flyball/classical/delay_response.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_motion.hpp"
#include "classical/whole_periods.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using detail::Drive;
using detail::Motion;

constexpr Index most_states = 200;
constexpr Index most_samples = 10'000'000;
constexpr double most_delays = 1e9;

/// A discrete system is stepped.
Expected<DelayResponse> stepped(const DelaySystem& system, const Drive& drive, const VectorXd& x0) {
  const DelayForm& f = system.form();
  const double period = system.period()->si();
  const Index samples = drive.u.rows();
  const Index k = f.delays.size();
  std::vector<Index> lengths;
  for (Index i = 0; i < k; ++i) {
    lengths.push_back(std::min(detail::periods_in(f.delays(i), system.period()), samples));
  }
  DelayResponse response;
  response.time = VectorXd::LinSpaced(samples, 0.0, period * static_cast<double>(samples - 1));
  response.x.resize(samples, x0.size());
  response.y.resize(samples, f.C1.rows());
  MatrixXd z(samples, k);
  VectorXd x = x0;
  VectorXd w(k);
  for (Index t = 0; t < samples; ++t) {
    for (Index i = 0; i < k; ++i) {
      const Index then = t - lengths[static_cast<std::size_t>(i)];
      w(i) = then < 0 ? 0.0 : z(then, i);
    }
    const VectorXd u = drive.u.row(t).transpose();
    response.x.row(t) = x.transpose();
    response.y.row(t) = (f.C1 * x + f.D11 * u + f.D12 * w).transpose();
    z.row(t) = (f.C2 * x + f.D21 * u + f.D22 * w).transpose();
    x = (f.A * x + f.B1 * u + f.B2 * w).eval();
  }
  FLYBALL_CHECK(Checks("response").finite(response.x, "x").finite(response.y, "y"));
  return response;
}

Expected<DelayResponse> respond(const DelaySystem& system, const Drive& drive, const MatrixRef& x0,
                                double step) {
  constexpr std::string_view where = "response";
  FLYBALL_CHECK(Checks(where)
                    .positive(step, "step", "s")
                    .within(static_cast<double>(drive.u.rows()), 1.0,
                            static_cast<double>(most_samples), "samples")
                    .shape(drive.u, drive.u.rows(), system.inputs(), "u", "samples x inputs")
                    .shape(x0, system.states(), 1, "x0", "states x 1")
                    .finite(drive.u, "u")
                    .finite(x0, "x0"));
  if (system.period()) {
    if (std::abs(step - system.period()->si()) > 1e-12 * step) {
      return refusal(ArgumentError::out_of_range, where, "step")
          .got(flyball::detail::format("{} s", step))
          .expected(flyball::detail::format("the system's period, {} s", system.period()->si()));
    }
    return stepped(system, drive, x0);
  }
  if (system.states() > most_states) {
    return refusal(ArgumentError::out_of_range, where, "the number of states")
        .got(std::to_string(system.states()))
        .expected(flyball::detail::format("at most {}", most_states));
  }
  const double end = step * static_cast<double>(drive.u.rows());
  if (system.has_delay() && system.delays().minCoeff() * most_delays < end) {
    return refusal(ArgumentError::out_of_range, where, "the shortest delay")
        .got(flyball::detail::format("{} s", system.delays().minCoeff()))
        .expected(flyball::detail::format("at least a billionth of the time, {} s", end))
        .hint("ask for a shorter time, or leave the delay out");
  }
  return Motion(system, drive, step, drive.u.rows()).run(x0);
}

/// The instants that were asked for, or those that the poles of the Padé approximation ask for.
Expected<ResponseTimes> chosen(const DelaySystem& system,
                               const std::optional<ResponseTimes>& times) {
  if (times) {
    FLYBALL_CHECK(check_within(static_cast<double>(times->samples), 1.0,
                               static_cast<double>(most_samples), "response", "samples"));
    return *times;
  }
  if (system.period()) {
    FLYBALL_TRY(const auto states, system.to_discrete());
    if (states.A.size() == 0) {
      return response_times({}, states.period);
    }
    return analyze_modes(states).map(
        [&](const ModalAnalysis& modes) { return response_times(modes, states.period); });
  }
  const double late = system.has_delay() ? system.delays().sum() : 0.0;
  auto rational =
      system.has_delay_in_loop()
          ? system.pade(5)
          : Expected<ContinuousSystem<>>(ContinuousSystem<>{system.form().A, system.form().B1,
                                                            system.form().C1, system.form().D11});
  // It is -1 at infinity, one of even order 1: a loop of jumps may be singular with either.
  if (auto even = system.pade(4); even && system.has_delay_in_loop() &&
                                  (!rational || even->A.norm() < 0.01 * rational->A.norm())) {
    rational = std::move(even);
  }
  ResponseTimes found{Time(0.0), 601};
  double end = late > 0.0 ? late : 1.0;
  if (!rational) {
    end = 20.0 * late;
  } else if (rational->A.size() > 0) {
    FLYBALL_TRY(const auto modes, analyze_modes(*rational));
    const ResponseTimes own = response_times(modes);
    end = own.step.si() * static_cast<double>(own.samples - 1) + late;
    found.samples = own.samples;
  }
  found.step = Time(end / static_cast<double>(found.samples - 1));
  return found;
}

Expected<void> check_input(const DelaySystem& system, Index input) {
  return check_within(static_cast<double>(input), 0.0, static_cast<double>(system.inputs() - 1),
                      "response", "input");
}

}  // namespace

Expected<DelayResponse> forced_response(const DelaySystem& system, const MatrixRef& u,
                                        const MatrixRef& x0, Time step, InputShape shape) {
  const MatrixXd samples = u;
  return respond(system, Drive{samples, shape}, x0, step.si());
}

Expected<DelayResponse> initial_response(const DelaySystem& system, const MatrixRef& x0,
                                         const std::optional<ResponseTimes>& times) {
  FLYBALL_TRY(const auto at, chosen(system, times));
  const MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  return respond(system, Drive{u}, x0, at.step.si());
}

Expected<DelayResponse> step_response(const DelaySystem& system, Index input,
                                      const std::optional<ResponseTimes>& times) {
  FLYBALL_CHECK(check_input(system, input));
  FLYBALL_TRY(const auto at, chosen(system, times));
  MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  u.col(input).setOnes();
  return respond(system, Drive{u}, VectorXd::Zero(system.states()), at.step.si());
}

Expected<DelayResponse> impulse_response(const DelaySystem& system, Index input,
                                         const std::optional<ResponseTimes>& times) {
  FLYBALL_CHECK(check_input(system, input));
  FLYBALL_TRY(const auto at, chosen(system, times));
  MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  u(0, input) = system.period() ? 1.0 : 0.0;
  return respond(system, Drive{u, InputShape::held, system.period() ? -1 : input},
                 VectorXd::Zero(system.states()), at.step.si());
}

}  // namespace flyball::classical
