#include <algorithm>
#include <cmath>
#include <complex>
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
    0.018;                        // s, differences closer than this add nothing on a ramp
constexpr double battery = 12.0;  // V, of which the voltage is a share

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
    priors_.push_back({extra_delay_of(i), 0.0, age_deviation()});
    if (!runs_[i].ramp) {
      ages_.push_back(extra_delay_of(i));
    }
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
  const double kV = x[parameter::velocity_gain];
  const double middle = 0.5 * (low_ + high_);
  for (std::size_t index = 0; index < runs_.size(); ++index) {
    ResidualRun& run = runs_[index];
    const PreparedRun& prepared = recording_.runs[run.prepared];
    const double delay = x[parameter::position_delay] + x[extra_delay_of(index)];
    const std::size_t rows = run.input.time.size();
    const bool simulated =
        kV > 0.0 && (is_extended(parameter::drag) || is_extended(parameter::sag));
    if (simulated) {
      responses_[index].simulate(run.input, simulation_parameters(x, index));
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
    const bool travels = !controls_velocity(mechanism_) && !run.angle.empty();
    std::size_t hint = 0;
    Interpolation angle(run.angle_time, run.angle);
    Interpolation smoothed(prepared.run.time, prepared.smoothed_velocity);
    for (std::size_t i = 0; i < rows; ++i) {
      // The middle of the interval that the input is held for.
      const double next = i + 1 < rows ? run.input.time[i + 1] : run.input.time[i];
      const double time = 0.5 * (run.input.time[i] + next);
      const double position = travels ? angle.at(time + delay) : 0.0;
      if (arm) {
        force(parameter::gravity_cosine)[i] = std::cos(position);
        force(parameter::gravity_sine)[i] = std::sin(position);
      }
      if (travels) {
        force(parameter::spring)[i] = position - middle;
        if (field_) {
          const double turn = 2.0 * std::numbers::pi * (position - low_) / (high_ - low_);
          const std::complex<double> wave = std::polar(1.0, turn);
          std::complex<double> waves = wave;
          for (int k = 0; k < field_count; k += 2, waves *= wave) {
            force(parameter::friction_field + k)[i] = prepared.direction * waves.imag();
            force(parameter::friction_field + k + 1)[i] = prepared.direction * waves.real();
          }
        }
      }
      const double velocity = simulated
                                  ? responses_[index].velocity(responses_[index].place(time, hint))
                                  : smoothed.at(time);
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
  const bool travels = !controls_velocity(mechanism_) && recording_.has_position;
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

std::vector<bool> OutputErrorProblem::free_parameters() const {
  std::vector<bool> free(static_cast<std::size_t>(parameters()), true);
  free[parameter::static_friction] = !hides_friction_;
  free[parameter::gravity_cosine] = has_gravity(mechanism_);
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
