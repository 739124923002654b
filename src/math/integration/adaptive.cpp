#include <flyball/math/integration/adaptive.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include <flyball/core/argument.hpp>
#include <flyball/math/search/roots.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/integration/ode_steppers.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_integrate = "integrate";

Expected<VectorXd> tolerances_of(const IntegrationOptions& options, Index states) {
  constexpr double least = 100.0 * std::numeric_limits<double>::epsilon();
  if (!(options.relative_tolerance >= least) || !std::isfinite(options.relative_tolerance)) {
    return refusal(ArgumentError::out_of_range, in_integrate, "relative_tolerance")
        .got(format_number(options.relative_tolerance))
        .expected("at least 2.3e-14");
  }
  if (options.absolute_tolerances.size() == 0) {
    return check_positive(options.absolute_tolerance, in_integrate, "absolute_tolerance").map([&] {
      return VectorXd(VectorXd::Constant(states, options.absolute_tolerance));
    });
  }
  FLYBALL_CHECK(
      Checks(in_integrate)
          .shape(options.absolute_tolerances, states, 1, "absolute_tolerances", "states x 1")
          .finite(options.absolute_tolerances, "absolute_tolerances")
          .positive(options.absolute_tolerances.minCoeff(), "absolute_tolerances"));
  return options.absolute_tolerances;
}

Expected<void> check_arguments(double t0, const Eigen::Ref<const VectorXd>& x0, double t1,
                               const IntegrationOptions& options) {
  if (x0.size() == 0) {
    return refusal(ArgumentError::empty, in_integrate, "x0");
  }
  if (std::isnan(options.max_step) || options.max_step <= 0.0) {
    return refusal(ArgumentError::not_positive, in_integrate, "max_step")
        .got(format_number(options.max_step));
  }
  return Checks(in_integrate)
      .finite(t0, "t0")
      .finite(t1, "t1")
      .finite(x0, "x0")
      .not_negative(options.initial_step, "initial_step", "s");
}

Refusal not_finite(std::string about, double t, const VectorXd& x) {
  return refusal(IntegrationError::not_finite, in_integrate, about)
      .got("NaN or infinite")
      .with("t", t)
      .with("x", std::vector<double>(x.data(), x.data() + x.size()));
}

bool crosses(double before, double after, EventDirection direction) {
  const bool rises = before < 0.0 && after >= 0.0;
  const bool falls = before > 0.0 && after <= 0.0;
  return (rises && direction != EventDirection::falling) ||
         (falls && direction != EventDirection::rising);
}

}  // namespace

ErrorInfo error_info(IntegrationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_finite", "the derivative is not finite", ErrorKind::no_answer},
      {"step_underflow", "the step became too small to move the time", ErrorKind::no_answer},
      {"too_many_steps", "the time is not reached in the steps allowed", ErrorKind::no_answer},
      {"no_convergence", "the stages of an implicit step were not found", ErrorKind::no_answer},
  };
  return detail::info_of(code, "integration", rows);
}

VectorXd OdeSolution::Segment::at(double s) const {
  return r.col(0) + s * (r.col(1) + (1.0 - s) * (r.col(2) + s * (r.col(3) + (1.0 - s) * r.col(4))));
}

OdeSolution::OdeSolution(double t, const VectorXd& x) : times_{t}, states_{x} {}

VectorXd OdeSolution::at(double t) const {
  const bool backward = times_.back() < times_.front();
  const auto before = [backward](double a, double b) { return backward ? a > b : a < b; };
  if (!before(times_.front(), t)) {
    return states_.front();
  }
  if (!before(t, times_.back())) {
    return states_.back();
  }
  const auto next = std::upper_bound(times_.begin(), times_.end(), t, before);
  const Segment& segment = segments_[static_cast<std::size_t>(next - times_.begin()) - 1];
  return segment.at((t - segment.t) / segment.h);
}

Eigen::MatrixXd OdeSolution::states() const {
  Eigen::MatrixXd all(states_.front().size(), static_cast<Index>(states_.size()));
  for (std::size_t k = 0; k < states_.size(); ++k) {
    all.col(static_cast<Index>(k)) = states_[k];
  }
  return all;
}

/// Puts steps together to a solution.
class OdeIntegrator {
 public:
  OdeIntegrator(detail::OdeProblem problem, std::span<const EventRef> events)
      : problem_(std::move(problem)), events_(events) {}

  Expected<OdeSolution> run(double t0, const VectorXd& x0, const IntegrationOptions& options) {
    OdeSolution solution(t0, x0);
    if (t0 == problem_.t_end) {
      return solution;
    }
    detail::OdeState state{.t = t0, .x = x0, .f = problem_.derivative(t0, x0)};
    if (!state.f.allFinite()) {
      return not_finite("f(t0, x0)", t0, x0);
    }
    state.step = options.initial_step > 0.0 ? std::min(options.initial_step, options.max_step)
                                            : problem_.first_step(t0, x0, state.f);
    for (std::size_t i = 0; i < events_.size(); ++i) {
      values_.push_back(events_[i].function(t0, x0));
      if (!std::isfinite(values_.back())) {
        return not_finite("event " + std::to_string(i), t0, x0);
      }
    }

    bool stiff = options.method == IntegrationMethod::radau;
    problem_.statistics.stiff_from = stiff ? t0 : problem_.statistics.stiff_from;
    while (state.t != problem_.t_end && !solution.ended_by_event_) {
      FLYBALL_CHECK(stiff ? radau_.step(problem_, state) : dormand_prince_.step(problem_, state));
      solution.segments_.push_back(state.segment);
      solution.times_.push_back(state.t);
      solution.states_.push_back(state.x);
      FLYBALL_CHECK(search_events(solution, state));
      if (!stiff && options.method == IntegrationMethod::automatic && dormand_prince_.stiff()) {
        stiff = true;
        problem_.statistics.stiff_from = state.t;
      }
    }
    solution.statistics_ = problem_.statistics;
    return solution;
  }

 private:
  /// Finds what happened in the last step, in order, up to what ends the integration.
  Expected<void> search_events(OdeSolution& solution, const detail::OdeState& state) {
    constexpr int parts = 4;
    struct Found {
      double s;
      std::size_t event;
    };
    std::vector<Found> found;
    const OdeSolution::Segment& segment = state.segment;
    const double resolution = 2.0 * std::numeric_limits<double>::epsilon() *
                              std::max(1.0, std::abs(segment.t / segment.h));
    for (std::size_t i = 0; i < events_.size(); ++i) {
      double before = values_[i];
      for (int part = 1; part <= parts; ++part) {
        const double s = static_cast<double>(part) / parts;
        const VectorXd x = part == parts ? state.x : segment.at(s);
        const double t = part == parts ? state.t : segment.t + s * segment.h;
        const double after = events_[i].function(t, x);
        if (!std::isfinite(after)) {
          return not_finite("event " + std::to_string(i), t, x);
        }
        if (crosses(before, after, events_[i].direction)) {
          const auto event = [&](double place) {
            return events_[i].function(segment.t + place * segment.h, segment.at(place));
          };
          FLYBALL_TRY(const auto root, find_root(event, s - 1.0 / parts, s, before, after,
                                                 {.absolute_tolerance = resolution}));
          found.push_back({root.x, i});
        }
        before = after;
      }
      values_[i] = before;
    }
    std::ranges::stable_sort(found, {}, &Found::s);
    for (const Found& crossing : found) {
      const double t = segment.t + crossing.s * segment.h;
      solution.events_.push_back({crossing.event, t, segment.at(crossing.s)});
      if (events_[crossing.event].terminal) {
        solution.times_.back() = t;
        solution.states_.back() = solution.events_.back().x;
        solution.ended_by_event_ = true;
        break;
      }
    }
    return {};
  }

  detail::OdeProblem problem_;
  std::span<const EventRef> events_;
  std::vector<double> values_;  ///< Of the events, at the last step's end.
  detail::DormandPrinceStepper dormand_prince_;
  detail::RadauStepper radau_;
};

Expected<OdeSolution> integrate_ode(OdeFunction f, const OdeJacobian* jacobian, double t0,
                                    const Eigen::Ref<const VectorXd>& x0, double t1,
                                    const IntegrationOptions& options, const EventRef* events,
                                    std::size_t event_count) {
  FLYBALL_CHECK(check_arguments(t0, x0, t1, options));
  FLYBALL_TRY(auto tolerances, tolerances_of(options, x0.size()));
  OdeIntegrator integrator({.f = f,
                            .jacobian = jacobian,
                            .t_end = t1,
                            .direction = t1 < t0 ? -1.0 : 1.0,
                            .relative_tolerance = options.relative_tolerance,
                            .absolute_tolerance = std::move(tolerances),
                            .max_step = options.max_step,
                            .max_steps = options.max_steps},
                           {events, event_count});
  return integrator.run(t0, x0, options);
}

}  // namespace flyball
