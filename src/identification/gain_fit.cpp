#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "identification/gain_fit.hpp"

namespace flyball::identification {
namespace {

constexpr double shortest_time_constant = 0.002;  // s
constexpr double longest_time_constant = 10.0;    // s
constexpr int scale_refreshes = 4;

Eigen::VectorXd make_start(const OutputErrorProblem& problem, const StartGains& gains,
                           double time_constant) {
  const PreparedRecording& recording = problem.recording();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(problem.parameters());
  x[parameter::static_friction] = gains.kS;
  x[parameter::velocity_gain] = gains.kV;
  x[parameter::log_time_constant] =
      std::log(problem.hides_inertia() ? usual_time_constant : time_constant);
  x[parameter::gravity_cosine] = gains.gravity_cosine;
  x[parameter::gravity_sine] = gains.gravity_sine;
  x[parameter::headroom] = no_limit;
  x[parameter::position_delay] = recording.has_position ? 0.01 : 0.0;
  x[parameter::velocity_delay] = recording.has_velocity ? 0.03 : 0.0;
  x[parameter::averaging_width] = recording.has_velocity ? 0.03 : 0.0;
  x[parameter::velocity_scale] = recording.has_position && recording.has_velocity &&
                                         std::abs(recording.velocity_scale - 1.0) > 0.03
                                     ? recording.velocity_scale
                                     : 1.0;
  for (std::size_t i = 0; i < problem.runs().size(); ++i) {
    x[initial_velocity_of(i)] = problem.runs()[i].likely_initial_velocity;
  }
  return x;
}

}  // namespace

Bounds make_bounds(const OutputErrorProblem& problem, const StartGains& start,
                   const FitOptions& options) {
  const Eigen::Index n = problem.parameters();
  constexpr double unbounded = 1e12;
  Bounds bounds{Eigen::VectorXd::Constant(n, -unbounded), Eigen::VectorXd::Constant(n, unbounded)};
  bounds.lower[parameter::static_friction] = 0.0;
  bounds.lower[parameter::velocity_gain] = 1e-3 * start.kV;
  bounds.upper[parameter::velocity_gain] = 1e3 * start.kV;
  bounds.lower[parameter::log_time_constant] = std::log(shortest_time_constant);
  bounds.upper[parameter::log_time_constant] = std::log(longest_time_constant);
  bounds.lower[parameter::headroom] = 0.1;
  bounds.lower[parameter::position_delay] = -0.04;
  bounds.upper[parameter::position_delay] = options.max_delay;
  bounds.lower[parameter::averaging_width] = 0.0;
  bounds.upper[parameter::averaging_width] = 0.3;
  bounds.lower[parameter::velocity_delay] = -0.04;
  bounds.upper[parameter::velocity_delay] = options.max_delay + 0.15;
  bounds.lower[parameter::velocity_scale] = 0.3;
  bounds.upper[parameter::velocity_scale] = 3.0;
  return bounds;
}

RobustFit fit_gains(OutputErrorProblem& problem, const StartGains& gains, const Bounds& bounds,
                    const FitOptions& options, ChannelScales& scales) {
  const std::vector<bool> free = problem.free_parameters();
  const double top = problem.recording().top_speed;
  scales = {problem.recording().has_position ? 0.02 * top * options.difference_span : 0.0,
            problem.recording().has_velocity ? 0.02 * top : 0.0};
  const std::size_t thinning = std::clamp<std::size_t>(problem.residuals() / 600, 1, 8);
  OutputErrorProblem thinned(problem.recording(), options, thinning);
  OutputErrorProblem& scout = thinned.runs().size() == problem.runs().size() ? thinned : problem;
  RobustFit best;
  int iterations = 0;
  for (const double time_constant : {0.03, 0.15, 0.7}) {
    RobustFit fit = minimize(scout, make_start(problem, gains, time_constant), free, bounds, scales,
                             std::min(15, options.max_iterations / 8), 1e-2);
    iterations += fit.iterations;
    if (best.x.size() == 0 || fit.cost < best.cost) {
      best = std::move(fit);
    }
  }
  for (int refresh = 0; refresh < scale_refreshes; ++refresh) {
    const bool last = refresh + 1 == scale_refreshes;
    problem.refresh_forces(best.x);
    scales = residual_scales(problem, best.x);
    best = minimize(problem, best.x, free, bounds, scales,
                    std::max(1, std::min(last ? 60 : 20, options.max_iterations - iterations)),
                    last ? 1e-3 : 0.1);
    iterations += best.iterations;
  }
  best.iterations = iterations;
  return best;
}

}  // namespace flyball::identification
