#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

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
constexpr double battery = 12.0;         // V, of which the voltage is a share

SimulationVector simulation_parameters(const Eigen::VectorXd& x, std::size_t run) {
  SimulationVector simulated{};
  for (int k = 0; k < parameter::initial_velocity; ++k) {
    simulated[static_cast<std::size_t>(k)] = x[k];
  }
  simulated[parameter::initial_velocity] = x[initial_velocity_of(run)];
  return simulated;
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

  // A run that starts in motion is compared only where no sensor looks back before its start.
  const double earliest = prepared.starts_at_rest ? begin - lead : begin + options.settling;
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

constexpr int local_initial_velocity = shared_parameter_count;
constexpr int local_extra_delay = shared_parameter_count + 1;

/// How much of the backlash a run from rest has crossed: quadratic in time, as a push does.
double taken_up(const ResidualRun& run, double time, double duration) {
  if (!run.starts_at_rest) {
    return 0.0;
  }
  const double place = std::clamp((time - run.input.time.front()) / duration, 0.0, 1.0);
  return place * place;
}

/// The initial velocity is the first own column; those before it are shared.
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
  const auto forward = std::count_if(runs_.begin(), runs_.end(), [&](const ResidualRun& run) {
    return recording.runs[run.prepared].direction > 0.0;
  });
  hides_friction_ = mechanism_ == MechanismKind::elevator &&
                    (forward == 0 || forward == static_cast<std::ptrdiff_t>(runs_.size()));
  hides_inertia_ =
      std::all_of(runs_.begin(), runs_.end(), [](const ResidualRun& run) { return run.ramp; });
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (!runs_[i].angle.empty()) {
      const auto [least, most] = std::minmax_element(runs_[i].angle.begin(), runs_[i].angle.end());
      low_ = i == 0 ? *least : std::min(low_, *least);
      high_ = i == 0 ? *most : std::max(high_, *most);
    }
  }
  priors_ = {{parameter::position_delay, 0.015, 0.015},
             {parameter::velocity_delay, 0.035, 0.025},
             {parameter::averaging_width, 0.03, 0.05}};
  if (hides_inertia_) {
    priors_.push_back({parameter::log_time_constant, std::log(usual_time_constant), 1.0});
  }
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    priors_.push_back(
        {initial_velocity_of(i), runs_[i].likely_initial_velocity, 0.1 * recording_.top_speed});
    // Uniform within a row.
    priors_.push_back(
        {extra_delay_of(i), 0.0, std::max(1e-4, recording_.row_period) / std::sqrt(12.0)});
  }
  refresh_forces(Eigen::VectorXd::Zero(parameters()));
}

std::size_t OutputErrorProblem::residuals() const {
  std::size_t count = 0;
  for (const ResidualRun& run : runs_) {
    count += run.differences.size() + run.velocities.size();
  }
  return count;
}

void OutputErrorProblem::refresh_forces(const Eigen::VectorXd& x) {
  const double delay = x[parameter::position_delay];
  const double kV = x[parameter::velocity_gain];
  const double middle = 0.5 * (low_ + high_);
  for (std::size_t index = 0; index < runs_.size(); ++index) {
    ResidualRun& run = runs_[index];
    const PreparedRun& prepared = recording_.runs[run.prepared];
    const std::size_t rows = run.input.time.size();
    const bool simulated =
        kV > 0.0 && (is_extended(parameter::drag) || is_extended(parameter::sag));
    if (simulated) {
      responses_[index].simulate(run.input, simulation_parameters(x, index), false);
    }
    std::array<std::vector<double>, force_count> forces;
    const auto force = [&](int of) -> std::vector<double>& {
      std::vector<double>& values = forces[static_cast<std::size_t>(of - parameter::first_force)];
      values.resize(rows);
      return values;
    };
    if (mechanism_ == MechanismKind::elevator) {
      force(parameter::gravity_cosine).assign(rows, 1.0);
    } else {
      force(parameter::bias).assign(rows, 1.0);
    }
    const bool arm = mechanism_ == MechanismKind::arm && !run.angle.empty();
    const bool travels = mechanism_ != MechanismKind::flywheel && !run.angle.empty();
    std::size_t hint = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      // The middle of the interval that the input is held for.
      const double next = i + 1 < rows ? run.input.time[i + 1] : run.input.time[i];
      const double time = 0.5 * (run.input.time[i] + next);
      const double position = travels ? interpolate(run.angle_time, run.angle, time + delay) : 0.0;
      if (arm) {
        force(parameter::gravity_cosine)[i] = std::cos(position);
        force(parameter::gravity_sine)[i] = std::sin(position);
      }
      if (travels) {
        force(parameter::spring)[i] = position - middle;
        if (field_) {
          const double turn = 2.0 * std::numbers::pi * (position - low_) / (high_ - low_);
          for (int k = 0; k < field_count; ++k) {
            const double angle = turn * (1 + k / 2);
            force(parameter::friction_field + k)[i] =
                prepared.direction * (k % 2 == 0 ? std::sin(angle) : std::cos(angle));
          }
        }
      }
      const double velocity =
          simulated ? responses_[index].at(time, false, hint).velocity
                    : interpolate(prepared.run.time, prepared.smoothed_velocity, time);
      force(parameter::drag)[i] = velocity * std::abs(velocity);
      // Battery and wires lose what the motor's resistance drops, times the duty squared: the
      // current is that of the battery times the duty, and so is what its loss takes off.
      const double voltage = run.input.voltage[i];
      const double duty = voltage / battery;
      force(parameter::sag)[i] = duty * duty * (voltage - kV * velocity) /
                                 (1.0 + std::max(0.0, x[parameter::sag]) * duty * duty);
    }
    run.input.forces = std::move(forces);
  }
}

bool OutputErrorProblem::can_extend(int parameter) const {
  const bool travels = mechanism_ != MechanismKind::flywheel && recording_.has_position;
  if (parameter >= parameter::friction_field && parameter < parameter::headroom) {
    return travels && !hides_friction_ && high_ > low_;
  }
  switch (parameter) {
    case parameter::bias:  // An elevator's gravity is the same force.
      return mechanism_ != MechanismKind::elevator;
    case parameter::spring:
      return travels;
    case parameter::sag:
      return !hides_inertia_;
    case parameter::take_up:
      return backlash_ && std::any_of(runs_.begin(), runs_.end(),
                                      [](const ResidualRun& run) { return run.starts_at_rest; });
    default:
      return true;
  }
}

void OutputErrorProblem::evaluate(std::size_t index, const Eigen::VectorXd& x, bool jacobian,
                                  ResidualBlock& block) {
  const ResidualRun& run = runs_[index];
  const TestRun& source = recording_.runs[run.prepared].run;
  const double direction = recording_.runs[run.prepared].direction;
  Response& response = responses_[index];
  response.simulate(run.input, simulation_parameters(x, index), jacobian);

  const auto differences = static_cast<Eigen::Index>(run.differences.size());
  const auto velocities = static_cast<Eigen::Index>(run.velocities.size());
  // Made anew: resizing frees the old memory before the new is there.
  if (block.difference.size() != differences || block.velocity.size() != velocities) {
    block.difference = Eigen::VectorXd(differences);
    block.velocity = Eigen::VectorXd(velocities);
  }
  if (jacobian) {
    using Jacobian = ResidualBlock::Jacobian;
    block.difference_jacobian = Jacobian(Jacobian::Zero(differences, local_parameter_count));
    block.velocity_jacobian = Jacobian(Jacobian::Zero(velocities, local_parameter_count));
  }
  Hints hints;
  const double position_delay = x[parameter::position_delay] + x[extra_delay_of(index)];
  const double velocity_delay = x[parameter::velocity_delay] + x[extra_delay_of(index)];
  for (Eigen::Index row = 0; row < differences; ++row) {
    const auto [from, to] = run.differences[static_cast<std::size_t>(row)];
    const Response::Sample early =
        response.at(source.time[from] - position_delay, jacobian, hints.early);
    const Response::Sample late =
        response.at(source.time[to] - position_delay, jacobian, hints.late);
    const double taken =
        direction * (taken_up(run, source.time[to] - position_delay, take_up_time_) -
                     taken_up(run, source.time[from] - position_delay, take_up_time_));
    block.difference[row] = (source.position[to] - source.position[from]) -
                            (late.position - early.position) - x[parameter::take_up] * taken;
    if (jacobian) {
      store_gradient(block.difference_jacobian.row(row),
                     late.position_gradient - early.position_gradient, -1.0);
      block.difference_jacobian(row, parameter::take_up) = -taken;
      block.difference_jacobian(row, parameter::position_delay) = late.velocity - early.velocity;
      block.difference_jacobian(row, local_extra_delay) = late.velocity - early.velocity;
    }
  }
  for (Eigen::Index row = 0; row < velocities; ++row) {
    const std::size_t at = run.velocities[static_cast<std::size_t>(row)];
    const double time = source.time[at] - velocity_delay;
    const double width = std::max(x[parameter::averaging_width], shortest_width);
    Averaged average = moving_average(response, time, width, jacobian, hints);
    const double taken = direction *
                         (taken_up(run, time + 0.5 * width, take_up_time_) -
                          taken_up(run, time - 0.5 * width, take_up_time_)) /
                         width;
    average.value += x[parameter::take_up] * taken;
    const double scale = x[parameter::velocity_scale];
    block.velocity[row] = source.velocity[at] - scale * average.value;
    if (jacobian) {
      store_gradient(block.velocity_jacobian.row(row), average.gradient, -scale);
      block.velocity_jacobian(row, parameter::take_up) = -scale * taken;
      block.velocity_jacobian(row, parameter::velocity_delay) = -scale * average.by_delay;
      block.velocity_jacobian(row, local_extra_delay) = -scale * average.by_delay;
      block.velocity_jacobian(row, parameter::averaging_width) = -scale * average.by_width;
      block.velocity_jacobian(row, parameter::velocity_scale) = -average.value;
    }
  }
}

double OutputErrorProblem::velocity_shown(std::size_t run, const Eigen::VectorXd& x,
                                          double time) const {
  Hints hints;
  const double shown = time - x[parameter::velocity_delay] - x[extra_delay_of(run)];
  const double width = std::max(x[parameter::averaging_width], shortest_width);
  const double taken = recording_.runs[runs_[run].prepared].direction *
                       (taken_up(runs_[run], shown + 0.5 * width, take_up_time_) -
                        taken_up(runs_[run], shown - 0.5 * width, take_up_time_)) /
                       width;
  return x[parameter::velocity_scale] *
         (moving_average(responses_[run], shown, width, false, hints).value +
          x[parameter::take_up] * taken);
}

double OutputErrorProblem::position_shown(std::size_t run, const Eigen::VectorXd& x,
                                          double time) const {
  std::size_t hint = 0;
  const double delay = x[parameter::position_delay] + x[extra_delay_of(run)];
  return responses_[run].at(time - delay, false, hint).position +
         x[parameter::take_up] * recording_.runs[runs_[run].prepared].direction *
             taken_up(runs_[run], time - delay, take_up_time_);
}

std::vector<bool> OutputErrorProblem::free_parameters() const {
  std::vector<bool> free(static_cast<std::size_t>(parameters()), true);
  free[parameter::static_friction] = !hides_friction_;
  free[parameter::gravity_cosine] = mechanism_ != MechanismKind::flywheel;
  free[parameter::gravity_sine] = mechanism_ == MechanismKind::arm;
  for (int term = parameter::bias; term <= parameter::headroom; ++term) {
    free[static_cast<std::size_t>(term)] = is_extended(term) && can_extend(term);
  }
  free[parameter::take_up] = is_extended(parameter::take_up) && can_extend(parameter::take_up);
  free[parameter::position_delay] = recording_.has_position;
  free[parameter::velocity_delay] = recording_.has_velocity;
  free[parameter::averaging_width] = recording_.has_velocity;
  free[parameter::velocity_scale] = recording_.has_velocity && recording_.has_position &&
                                    std::abs(recording_.velocity_scale - 1.0) > 0.03;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    free[static_cast<std::size_t>(initial_velocity_of(i))] = !runs_[i].starts_at_rest;
    free[static_cast<std::size_t>(extra_delay_of(i))] = !runs_[i].ramp;
  }
  return free;
}

}  // namespace flyball::identification
