#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/diagnose.hpp"
#include "identification/cross_checks.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

constexpr double one_sided_95 = 1.645;
constexpr double normal_95 = 1.96;
constexpr int profile_points = 8;
constexpr int refit_iterations = 12;

struct Inertia {
  double log_kA;
  double standard_error;
};

/// kA from one channel alone, starting from the fit of both; nothing if it is not determined.
std::optional<Inertia> fit_channel(OutputErrorProblem& problem, const RobustFit& best,
                                   const Bounds& bounds, const ChannelScales& scales,
                                   Channel channel) {
  const bool position = channel == Channel::position;
  const ChannelScales chosen{position ? scales.difference : 0.0, position ? 0.0 : scales.velocity};
  if (chosen.difference + chosen.velocity <= 0.0) {
    return std::nullopt;
  }
  std::vector<bool> free = problem.free_parameters();
  free[parameter::position_delay] = free[parameter::position_delay] && position;
  free[parameter::velocity_delay] = free[parameter::velocity_delay] && !position;
  free[parameter::averaging_width] = free[parameter::averaging_width] && !position;
  free[parameter::velocity_scale] = false;
  const RobustFit fit = minimize(problem, best.x, free, bounds, chosen, refit_iterations, 0.1);
  const Covariances spread = covariances(problem, fit.x, free, bounds, chosen);
  const double slack = 1e-6;
  if (spread.singular ||
      fit.x[parameter::log_time_constant] <= bounds.lower[parameter::log_time_constant] + slack ||
      fit.x[parameter::log_time_constant] >= bounds.upper[parameter::log_time_constant] - slack) {
    return std::nullopt;
  }
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(fit.x.size());
  gradient[parameter::log_time_constant] = 1.0;
  gradient[parameter::velocity_gain] = 1.0 / fit.x[parameter::velocity_gain];
  return Inertia{fit.x[parameter::log_time_constant] + std::log(fit.x[parameter::velocity_gain]),
                 spread.standard_error(gradient)};
}

/// Top speed in the first 0.3 s over the speed in the 0.3 s that follow; 0 if they were not
/// recorded.
double overshoot(const std::vector<double>& time, const std::vector<double>& velocity,
                 double direction) {
  constexpr double settling = 0.3;  // s
  const std::size_t middle = lower_index(time, time.front() + settling);
  const std::size_t end = lower_index(time, time.front() + 2.0 * settling);
  if (end >= time.size()) {
    return 0.0;
  }
  double peak = 0.0;
  for (std::size_t i = 0; i < middle; ++i) {
    peak = std::max(peak, direction * velocity[i]);
  }
  std::vector<double> after;
  for (std::size_t i = middle; i < end; ++i) {
    after.push_back(direction * velocity[i]);
  }
  const double settled = quantile(std::move(after), 0.25);
  return settled > 0.0 ? peak / settled : 0.0;
}

}  // namespace

double inertia_ceiling(OutputErrorProblem& problem, const RobustFit& best, const Bounds& bounds,
                       const ChannelScales& scales, const Covariances& spread) {
  const double inflation = std::max(spread.inflation(parameter::velocity_gain),
                                    spread.inflation(parameter::log_time_constant));
  const double allowed = one_sided_95 * one_sided_95 * inflation;
  std::vector<bool> free = problem.free_parameters();
  free[parameter::log_time_constant] = false;
  Eigen::VectorXd x = best.x;
  double below = x[parameter::log_time_constant];
  double rise_below = 0.0;
  for (int point = 0; point < profile_points; ++point) {
    x[parameter::log_time_constant] =
        std::min(below + std::log(1.8), bounds.upper[parameter::log_time_constant]);
    const RobustFit fit =
        minimize(problem, x, free, bounds, scales, refit_iterations, 0.02 * allowed);
    const double rise = std::max(0.0, fit.cost - best.cost);
    x = fit.x;
    if (rise > allowed) {
      // Near the minimum √rise is linear in the parameter.
      const double fraction =
          (std::sqrt(allowed) - std::sqrt(rise_below)) / (std::sqrt(rise) - std::sqrt(rise_below));
      const double log_tau = below + fraction * (x[parameter::log_time_constant] - below);
      return std::exp(log_tau) * x[parameter::velocity_gain];
    }
    below = x[parameter::log_time_constant];
    rise_below = rise;
  }
  return std::exp(below) * x[parameter::velocity_gain];
}

double friction_ceiling(OutputErrorProblem& problem, const RobustFit& best, const Bounds& bounds,
                        const ChannelScales& scales, const Covariances& spread) {
  constexpr int kS = parameter::static_friction;
  std::vector<bool> free = problem.free_parameters();
  free[kS] = false;
  const Score beyond = scores(problem, best.x, free, bounds, scales, {{kS}}).front();
  // The best value without the bound, and what the cost would fall by.
  const double least = beyond.step.size() > 0 ? std::min(0.0, beyond.step[0]) : 0.0;
  const double gain = least < 0.0 ? beyond.gain : 0.0;
  // Friction below zero is none: what asks for it is an error of the model, as large at least.
  const double allowed = normal_95 * normal_95 * std::max(spread.inflation(kS), gain);
  const double by_curvature =
      least + std::sqrt(least * least + allowed * spread.independent(kS, kS));
  Eigen::VectorXd x = best.x;
  double below = 0.0;
  double rise_below = 0.0;
  double above = 0.8 * by_curvature;
  for (int point = 0; point < profile_points; ++point) {
    x[kS] = above;
    const RobustFit fit =
        minimize(problem, x, free, bounds, scales, refit_iterations, 0.02 * allowed);
    const double rise = std::max(0.0, fit.cost - best.cost);
    x = fit.x;
    if (rise > allowed) {
      // √(rise + gain) is linear in the parameter.
      const double from = std::sqrt(rise_below + gain);
      const double fraction = (std::sqrt(allowed + gain) - from) / (std::sqrt(rise + gain) - from);
      return below + fraction * (above - below);
    }
    below = above;
    rise_below = rise;
    above *= 1.5;
  }
  return below;
}

void compare_channels(OutputErrorProblem& problem, const RobustFit& best, const Bounds& bounds,
                      const ChannelScales& scales, std::vector<Diagnostic>& diagnostics) {
  const auto by_position = fit_channel(problem, best, bounds, scales, Channel::position);
  const auto by_velocity = fit_channel(problem, best, bounds, scales, Channel::velocity);
  if (!by_position || !by_velocity) {
    return;
  }
  const double difference = by_velocity->log_kA - by_position->log_kA;
  const double spread = std::hypot(by_position->standard_error, by_velocity->standard_error);
  if (std::abs(difference) > 0.15 && std::abs(difference) > 3.0 * spread) {
    warn(diagnostics, "channels_disagree",
         "kA is {:.3g} from the position alone but {:.3g} from the velocity alone; the velocity's "
         "filter is not the moving average that the fit supposes",
         std::exp(by_position->log_kA), std::exp(by_velocity->log_kA));
  }
}

void compare_repeats(const FeedforwardFit& fit, std::vector<Diagnostic>& diagnostics) {
  // Measured over simulated speed of each run, of all its stretches; per kind the least and the
  // greatest.
  std::map<std::pair<TestKind, std::size_t>, std::pair<double, double>> sums;
  for (const FittedRun& run : fit.runs) {
    auto& [product, square] = sums[{run.kind, run.source}];
    for (std::size_t i = 0; i < run.velocity.size(); ++i) {
      product += run.velocity[i] * run.velocity_hat[i];
      square += run.velocity_hat[i] * run.velocity_hat[i];
    }
  }
  std::map<TestKind, std::pair<double, double>> extremes;
  for (const auto& [run, sum] : sums) {
    if (sum.second > 0.0) {
      const double ratio = sum.first / sum.second;
      const auto [entry, first] = extremes.try_emplace(run.first, ratio, ratio);
      if (!first) {
        entry->second = {std::min(entry->second.first, ratio),
                         std::max(entry->second.second, ratio)};
      }
    }
  }
  for (const auto& [kind, range] : extremes) {
    if (range.first > 0.0 && range.second / range.first > 1.1) {
      warn(diagnostics, "repeats_disagree",
           "two {} tests differ in speed by a factor {:.2f} under the same voltage; was the "
           "mechanism changed between them? Identify them apart",
           to_string(kind), range.second / range.first);
    }
  }
}

void detect_elasticity(const PreparedRecording& prepared, const FeedforwardFit& fit,
                       std::vector<Diagnostic>& diagnostics) {
  for (std::size_t i = 0; i < prepared.runs.size(); ++i) {
    const PreparedRun& run = prepared.runs[i];
    if (!fit.runs[i].used || is_quasistatic(run.run.kind) || !run.starts_at_rest) {
      continue;
    }
    const auto first = run.smoothed_velocity.begin() + static_cast<std::ptrdiff_t>(run.first);
    const auto last = run.smoothed_velocity.begin() + static_cast<std::ptrdiff_t>(run.last);
    const double measured = overshoot(fit.runs[i].time, {first, last}, run.direction);
    const double simulated = overshoot(fit.runs[i].time, fit.runs[i].velocity_hat, run.direction);
    if (measured > 1.15 * std::max(1.0, simulated)) {
      warn(diagnostics, "elastic",
           "{}: the speed overshoots by {:.0f} % after the step and falls again, the simulated one "
           "by {:.0f} %; backlash or elasticity, which the model lacks, limits how fast a "
           "controller may be",
           to_string(run.run.kind), 100.0 * (measured - 1.0),
           100.0 * (std::max(1.0, simulated) - 1.0));
    }
  }
}

}  // namespace flyball::identification
