#include <algorithm>
#include <cmath>
#include <vector>

#include "identification/settling.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

constexpr double irregular = 6.0;       ///< Standard deviations of the noise later on.
constexpr double visible = 0.06;        ///< Of top speed.
constexpr double longest_start = 0.25;  ///< s
constexpr double shortest_rest = 0.3;   ///< s, that must be left of a step.

/// A residual as a velocity, at its time.
struct TimedResidual {
  double time;
  double value;
};

std::vector<TimedResidual> residuals_of(OutputErrorProblem& problem, std::size_t index,
                                        const Eigen::VectorXd& x) {
  ResidualBlock block;
  problem.evaluate(index, x, block);
  const ResidualRun& run = problem.runs()[index];
  const std::vector<double>& time = problem.recording().runs[run.prepared].run.time;
  std::vector<TimedResidual> all;
  if (!run.velocities.empty()) {
    for (std::size_t i = 0; i < run.velocities.size(); ++i) {
      all.push_back({time[run.velocities[i]], block.velocity[static_cast<Eigen::Index>(i)]});
    }
  } else {
    for (std::size_t i = 0; i < run.differences.size(); ++i) {
      const auto [from, to] = run.differences[i];
      all.push_back({0.5 * (time[from] + time[to]),
                     block.difference[static_cast<Eigen::Index>(i)] / (time[to] - time[from])});
    }
  }
  return all;
}

}  // namespace

std::optional<LaterStarts> without_irregular_starts(OutputErrorProblem& problem,
                                                    const Eigen::VectorXd& x) {
  const PreparedRecording& recording = problem.recording();
  LaterStarts later{recording};
  for (std::size_t index = 0; index < problem.runs().size(); ++index) {
    const ResidualRun& run = problem.runs()[index];
    if (run.ramp || !run.starts_at_rest) {
      continue;
    }
    const double edge = run.input.time.front();
    const std::vector<TimedResidual> residuals = residuals_of(problem, index, x);
    std::vector<double> calm;
    for (const auto& [time, value] : residuals) {
      if (time > edge + longest_start) {
        calm.push_back(value);
      }
    }
    if (calm.size() < 8 || run.window_end < edge + longest_start + shortest_rest) {
      continue;
    }
    const double noise = mad_scale(calm);
    // A value that is a row older or younger than supposed misses by what the speed, on its way to
    // V/kV, changes in that time.
    double most = 0.0;
    for (const double voltage : run.input.voltage) {
      most = std::max(most, std::abs(voltage));
    }
    const double tau = std::exp(x[parameter::log_time_constant]);
    const double a_row =
        most / x[parameter::velocity_gain] * -std::expm1(-recording.row_period / tau);
    const double limit = std::max({irregular * noise, visible * recording.top_speed, 1.5 * a_row});
    double end = edge;
    double largest = 0.0;
    for (const auto& [time, value] : residuals) {
      if (time <= edge + longest_start && std::abs(value) > limit) {
        end = time;
        largest = std::max(largest, std::abs(value));
      }
    }
    if (end == edge) {
      continue;
    }
    PreparedRun& prepared = later.recording.runs[run.prepared];
    // Past the last irregular value by as much as the velocity's average may look back.
    const double start =
        end + std::max(0.0, x[parameter::velocity_delay]) + 0.5 * x[parameter::averaging_width];
    prepared.first = std::max(prepared.first, lower_index(prepared.run.time, start));
    prepared.starts_at_rest = false;
    ++later.steps;
    later.longest = std::max(later.longest, start - edge);
    later.excess = std::max(later.excess, noise > 0.0 ? largest / noise : irregular);
  }
  return later.steps > 0 ? std::optional(std::move(later)) : std::nullopt;
}

}  // namespace flyball::identification
