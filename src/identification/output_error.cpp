#include <algorithm>
#include <cmath>

#include "identification/output_error.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr double tail = 0.06;         // s, simulated beyond the window for negative delays
constexpr double lead = 0.1;          // s, compared before a step that starts from rest
constexpr double longest_span = 0.2;  // s, of a position difference
constexpr double crowding_distance =
    0.018;                               // s, differences closer than this add nothing on a ramp
constexpr double shortest_width = 1e-3;  // s, below this an average is a sample

SimulationVector simulation_parameters(const Eigen::VectorXd& x, std::size_t run) {
  return {
      x[parameter::static_friction],   x[parameter::velocity_gain],
      x[parameter::log_time_constant], x[parameter::gravity_cosine],
      x[parameter::gravity_sine],      x[shared_parameter_count + static_cast<Eigen::Index>(run)]};
}

/// Keeps one value of `thinning`.
template <class Value>
void thin(std::vector<Value>& values, std::size_t thinning) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); i += thinning) {
    values[kept++] = values[i];
  }
  values.resize(kept);
}

ResidualRun make_run(const PreparedRun& prepared, std::size_t index, const FitOptions& options,
                     bool has_position, bool has_velocity) {
  const TestRun& source = prepared.run;
  ResidualRun run;
  run.prepared = index;
  run.ramp = is_quasistatic(source.kind);
  run.starts_at_rest = prepared.starts_at_rest;
  run.likely_initial_velocity =
      prepared.starts_at_rest ? 0.0 : prepared.smoothed_velocity[prepared.first];
  const double begin = source.time[prepared.first];
  run.window_end = source.time[prepared.last - 1];
  const std::size_t end = lower_index(source.time, run.window_end + tail);
  const auto slice = [&](const std::vector<double>& values) {
    return std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(prepared.first),
                               values.begin() + static_cast<std::ptrdiff_t>(end));
  };
  run.input.time = slice(source.time);
  run.input.voltage = slice(source.voltage);
  run.input.gravity_cosine.assign(run.input.time.size(), 0.0);
  run.input.gravity_sine.assign(run.input.time.size(), 0.0);

  // A run that starts in motion is compared only where no sensor looks back before its start.
  const double earliest = prepared.starts_at_rest ? begin - lead : begin + options.max_delay;
  const auto usable = [&](std::size_t row) {
    return source.time[row] >= earliest && row < prepared.last;
  };
  if (has_position) {
    const std::vector<std::size_t>& fresh = prepared.fresh_position;
    std::size_t from = 0;
    for (const std::size_t to : fresh) {
      if (!usable(to)) {
        continue;
      }
      const double latest = source.time[to] - (options.difference_span - 0.01);
      while (from + 1 < fresh.size() && source.time[fresh[from + 1]] <= latest) {
        ++from;
      }
      const double span = source.time[to] - source.time[fresh[from]];
      const bool crowded =
          run.ramp && !run.differences.empty() &&
          source.time[to] - source.time[run.differences.back().second] < crowding_distance;
      if (usable(fresh[from]) && source.time[fresh[from]] <= latest && span <= longest_span &&
          !crowded) {
        run.differences.emplace_back(fresh[from], to);
      }
    }
    for (const std::size_t row : fresh) {
      run.angle_time.push_back(source.time[row]);
      run.angle.push_back(source.position[row]);
    }
  }
  if (has_velocity) {
    std::copy_if(prepared.fresh_velocity.begin(), prepared.fresh_velocity.end(),
                 std::back_inserter(run.velocities), usable);
  }
  return run;
}

/// The moving average of the velocity and its derivative by every parameter.
struct Averaged {
  double value;
  double by_delay;
  double by_width;
  SimulationGradient gradient;
};

struct Hints {
  std::size_t early = 0;
  std::size_t late = 0;
};

Averaged moving_average(const Response& response, double time, double width, bool gradient,
                        Hints& hints) {
  const double half = 0.5 * std::max(width, shortest_width);
  const Response::Sample late = response.at(time + half, gradient, hints.late);
  const Response::Sample early = response.at(time - half, gradient, hints.early);
  Averaged average;
  average.value = (late.position - early.position) / (2.0 * half);
  average.by_delay = -(late.velocity - early.velocity) / (2.0 * half);
  average.by_width = (0.5 * (late.velocity + early.velocity) - average.value) / (2.0 * half);
  if (gradient) {
    average.gradient = (late.position_gradient - early.position_gradient) / (2.0 * half);
  }
  return average;
}

constexpr int local_initial_velocity = local_parameter_count - 1;

/// Simulation columns 0–4 are shared; the initial velocity is the last local column.
template <class Row>
void store_gradient(Row&& row, const SimulationGradient& gradient, double factor) {
  row.template head<parameter::initial_velocity>() =
      factor * gradient.template head<parameter::initial_velocity>();
  row[local_initial_velocity] = factor * gradient[parameter::initial_velocity];
}

}  // namespace

OutputErrorProblem::OutputErrorProblem(const PreparedRecording& recording,
                                       const FitOptions& options, std::size_t thinning)
    : recording_(recording), mechanism_(*recording.mechanism) {
  for (std::size_t i = 0; i < recording.runs.size(); ++i) {
    const PreparedRun& prepared = recording.runs[i];
    if (!prepared.moved || prepared.last <= prepared.first + 1) {
      continue;
    }
    ResidualRun run =
        make_run(prepared, i, options, recording.has_position, recording.has_velocity);
    thin(run.differences, thinning);
    thin(run.velocities, thinning);
    if (run.differences.size() + run.velocities.size() >= 5) {
      runs_.push_back(std::move(run));
    }
  }
  responses_.resize(runs_.size());
  set_angle_delay(0.0);
}

std::size_t OutputErrorProblem::residuals() const {
  std::size_t count = 0;
  for (const ResidualRun& run : runs_) {
    count += run.differences.size() + run.velocities.size();
  }
  return count;
}

void OutputErrorProblem::set_angle_delay(double delay) {
  for (ResidualRun& run : runs_) {
    for (std::size_t i = 0; i < run.input.time.size(); ++i) {
      if (mechanism_ == MechanismKind::elevator) {
        run.input.gravity_cosine[i] = 1.0;
      } else if (mechanism_ == MechanismKind::arm && !run.angle.empty()) {
        // The angle in the middle of the interval that the input is held for.
        const double next =
            i + 1 < run.input.time.size() ? run.input.time[i + 1] : run.input.time[i];
        const double middle = 0.5 * (run.input.time[i] + next);
        const double angle = interpolate(run.angle_time, run.angle, middle + delay);
        run.input.gravity_cosine[i] = std::cos(angle);
        run.input.gravity_sine[i] = std::sin(angle);
      }
    }
  }
}

void OutputErrorProblem::evaluate(std::size_t index, const Eigen::VectorXd& x, bool jacobian,
                                  ResidualBlock& block) {
  const ResidualRun& run = runs_[index];
  const TestRun& source = recording_.runs[run.prepared].run;
  Response& response = responses_[index];
  response.simulate(run.input, simulation_parameters(x, index), jacobian);

  const auto differences = static_cast<Eigen::Index>(run.differences.size());
  const auto velocities = static_cast<Eigen::Index>(run.velocities.size());
  block.difference.resize(differences);
  block.velocity.resize(velocities);
  if (jacobian) {
    block.difference_jacobian.setZero(differences, local_parameter_count);
    block.velocity_jacobian.setZero(velocities, local_parameter_count);
  }
  Hints hints;
  for (Eigen::Index row = 0; row < differences; ++row) {
    const auto [from, to] = run.differences[static_cast<std::size_t>(row)];
    const Response::Sample early =
        response.at(source.time[from] - x[parameter::position_delay], jacobian, hints.early);
    const Response::Sample late =
        response.at(source.time[to] - x[parameter::position_delay], jacobian, hints.late);
    block.difference[row] =
        (source.position[to] - source.position[from]) - (late.position - early.position);
    if (jacobian) {
      store_gradient(block.difference_jacobian.row(row),
                     late.position_gradient - early.position_gradient, -1.0);
      block.difference_jacobian(row, parameter::position_delay) = late.velocity - early.velocity;
    }
  }
  for (Eigen::Index row = 0; row < velocities; ++row) {
    const std::size_t at = run.velocities[static_cast<std::size_t>(row)];
    const Averaged average =
        moving_average(response, source.time[at] - x[parameter::velocity_delay],
                       x[parameter::averaging_width], jacobian, hints);
    const double scale = x[parameter::velocity_scale];
    block.velocity[row] = source.velocity[at] - scale * average.value;
    if (jacobian) {
      store_gradient(block.velocity_jacobian.row(row), average.gradient, -scale);
      block.velocity_jacobian(row, parameter::velocity_delay) = -scale * average.by_delay;
      block.velocity_jacobian(row, parameter::averaging_width) = -scale * average.by_width;
      block.velocity_jacobian(row, parameter::velocity_scale) = -average.value;
    }
  }
}

double OutputErrorProblem::velocity_shown(std::size_t run, const Eigen::VectorXd& x,
                                          double time) const {
  Hints hints;
  return x[parameter::velocity_scale] * moving_average(responses_[run],
                                                       time - x[parameter::velocity_delay],
                                                       x[parameter::averaging_width], false, hints)
                                            .value;
}

double OutputErrorProblem::position_shown(std::size_t run, const Eigen::VectorXd& x,
                                          double time) const {
  std::size_t hint = 0;
  return responses_[run].at(time - x[parameter::position_delay], false, hint).position;
}

double OutputErrorProblem::initial_velocity_information() const {
  const double deviation = 0.1 * recording_.top_speed;
  return 1.0 / (deviation * deviation);
}

double OutputErrorProblem::initial_velocity_deviation(const Eigen::VectorXd& x,
                                                      Eigen::Index parameter) const {
  const ResidualRun& run = runs_[static_cast<std::size_t>(parameter) - shared_parameter_count];
  return (x[parameter] - run.likely_initial_velocity) * std::sqrt(initial_velocity_information());
}

std::vector<bool> OutputErrorProblem::free_parameters() const {
  std::vector<bool> free(static_cast<std::size_t>(parameters()), true);
  free[parameter::gravity_cosine] = mechanism_ != MechanismKind::flywheel;
  free[parameter::gravity_sine] = mechanism_ == MechanismKind::arm;
  free[parameter::position_delay] = recording_.has_position;
  free[parameter::velocity_delay] = recording_.has_velocity;
  free[parameter::averaging_width] = recording_.has_velocity;
  free[parameter::velocity_scale] = recording_.has_velocity && recording_.has_position &&
                                    std::abs(recording_.velocity_scale - 1.0) > 0.03;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    free[static_cast<std::size_t>(shared_parameter_count) + i] = !runs_[i].starts_at_rest;
  }
  return free;
}

}  // namespace flyball::identification
