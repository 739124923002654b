#include <algorithm>

#include "identification/output_error.hpp"

namespace flyball::identification {
namespace {

constexpr double shortest_width = 1e-3;  // s, below this an average is a sample

/// The moving average of the velocity: over the time between two places.
struct Average {
  Response::Place early;
  Response::Place late;
  double width = 0.0;  ///< s
  double value = 0.0;
};

struct Hints {
  std::size_t early = 0;
  std::size_t late = 0;
};

Average moving_average(const Response& response, double time, double width, Hints& hints) {
  const double half = 0.5 * std::max(width, shortest_width);
  Average average{response.place(time - half, hints.early), response.place(time + half, hints.late),
                  2.0 * half};
  average.value =
      (response.position(average.late) - response.position(average.early)) / average.width;
  return average;
}

/// How much of the backlash a run from rest has crossed: quadratic in time, as a push does.
double taken_up(const ResidualRun& run, double time, double duration) {
  if (!run.starts_at_rest) {
    return 0.0;
  }
  const double place = std::clamp((time - run.input.time.front()) / duration, 0.0, 1.0);
  return place * place;
}

/// Columns of a Jacobian: those of the sensors that may be seen in a difference, the simulation's,
/// and those of the velocity's sensor.
enum Column : int { by_position_delay, by_take_up, by_extra_delay, by_simulation };

}  // namespace

void OutputErrorProblem::evaluate(std::size_t index, const Eigen::VectorXd& x,
                                  ResidualBlock& block) {
  const ResidualRun& run = runs_[index];
  responses_[index].simulate(run.input, simulation_parameters(x, index));
  linearize<0>(index, x, block);
}

void OutputErrorProblem::evaluate(std::size_t index, const Eigen::VectorXd& x,
                                  const std::vector<bool>& wanted, ResidualBlock& block) {
  SimulationColumns simulated{parameter::static_friction, parameter::velocity_gain,
                              parameter::log_time_constant};
  for (int k = parameter::first_force; k < parameter::initial_velocity; ++k) {
    if (wanted[static_cast<std::size_t>(k)]) {
      simulated.push_back(k);
    }
  }
  block.columns = {parameter::position_delay, parameter::take_up, extra_delay_of(index)};
  block.columns.insert(block.columns.end(), simulated.begin(), simulated.end());
  if (wanted[static_cast<std::size_t>(initial_velocity_of(index))]) {
    simulated.push_back(parameter::initial_velocity);
    block.columns.push_back(initial_velocity_of(index));
  }
  responses_[index].simulate(runs_[index].input, simulation_parameters(x, index), simulated);
  with_width(simulated.size(), [&](auto width) {
    block.columns.resize(by_simulation + width(), -1);
    for (const int of :
         {parameter::velocity_delay, parameter::averaging_width, parameter::velocity_scale}) {
      block.columns.push_back(of);
    }
    linearize<width()>(index, x, block);
  });
}

/// From the simulation that was the last. @tparam width  Of its sensitivities; 0 for none.
template <int width>
void OutputErrorProblem::linearize(std::size_t index, const Eigen::VectorXd& x,
                                   ResidualBlock& block) {
  constexpr int by_velocity_delay = by_simulation + width;
  constexpr int by_averaging_width = by_velocity_delay + 1;
  constexpr int by_velocity_scale = by_velocity_delay + 2;
  const ResidualRun& run = runs_[index];
  const TestRun& source = recording_.runs[run.prepared].run;
  const double direction = recording_.runs[run.prepared].direction;
  const Response& response = responses_[index];

  const auto differences = static_cast<Eigen::Index>(run.differences.size());
  const auto velocities = static_cast<Eigen::Index>(run.velocities.size());
  // Made anew: resizing frees the old memory before the new is there.
  if (block.difference.size() != differences || block.velocity.size() != velocities) {
    block.difference = Eigen::VectorXd(differences);
    block.velocity = Eigen::VectorXd(velocities);
  }
  if constexpr (width > 0) {
    using Jacobian = ResidualBlock::Jacobian;
    block.difference_jacobian = Jacobian(Jacobian::Zero(differences, by_velocity_scale + 1));
    block.velocity_jacobian = Jacobian(Jacobian::Zero(velocities, by_velocity_scale + 1));
  }
  Hints hints;
  const double position_delay = x[parameter::position_delay] + x[extra_delay_of(index)];
  const double velocity_delay = x[parameter::velocity_delay] + x[extra_delay_of(index)];
  for (Eigen::Index row = 0; row < differences; ++row) {
    const auto [from, to] = run.differences[static_cast<std::size_t>(row)];
    const Response::Place early = response.place(source.time[from] - position_delay, hints.early);
    const Response::Place late = response.place(source.time[to] - position_delay, hints.late);
    const double taken =
        direction * (taken_up(run, source.time[to] - position_delay, take_up_time_) -
                     taken_up(run, source.time[from] - position_delay, take_up_time_));
    block.difference[row] = (source.position[to] - source.position[from]) -
                            (response.position(late) - response.position(early)) -
                            x[parameter::take_up] * taken;
    if constexpr (width > 0) {
      double* const jacobian = block.difference_jacobian.row(row).data();
      jacobian[by_position_delay] = response.velocity(late) - response.velocity(early);
      jacobian[by_take_up] = -taken;
      jacobian[by_extra_delay] = jacobian[by_position_delay];
      response.add_gradient<width>(late, -1.0, jacobian + by_simulation);
      response.add_gradient<width>(early, 1.0, jacobian + by_simulation);
    }
  }
  for (Eigen::Index row = 0; row < velocities; ++row) {
    const std::size_t at = run.velocities[static_cast<std::size_t>(row)];
    const double time = source.time[at] - velocity_delay;
    Average average = moving_average(response, time, x[parameter::averaging_width], hints);
    const double taken = direction *
                         (taken_up(run, time + 0.5 * average.width, take_up_time_) -
                          taken_up(run, time - 0.5 * average.width, take_up_time_)) /
                         average.width;
    const double simulated = average.value;
    average.value += x[parameter::take_up] * taken;
    const double scale = x[parameter::velocity_scale];
    block.velocity[row] = source.velocity[at] - scale * average.value;
    if constexpr (width > 0) {
      double* const jacobian = block.velocity_jacobian.row(row).data();
      const double early = response.velocity(average.early);
      const double late = response.velocity(average.late);
      jacobian[by_take_up] = -scale * taken;
      jacobian[by_extra_delay] = scale * (late - early) / average.width;
      jacobian[by_velocity_delay] = jacobian[by_extra_delay];
      jacobian[by_averaging_width] = -scale * (0.5 * (late + early) - simulated) / average.width;
      jacobian[by_velocity_scale] = -average.value;
      response.add_gradient<width>(average.late, -scale / average.width, jacobian + by_simulation);
      response.add_gradient<width>(average.early, scale / average.width, jacobian + by_simulation);
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
         (moving_average(responses_[run], shown, width, hints).value +
          x[parameter::take_up] * taken);
}

double OutputErrorProblem::position_shown(std::size_t run, const Eigen::VectorXd& x,
                                          double time) const {
  std::size_t hint = 0;
  const double delay = x[parameter::position_delay] + x[extra_delay_of(run)];
  return responses_[run].position(responses_[run].place(time - delay, hint)) +
         x[parameter::take_up] * recording_.runs[runs_[run].prepared].direction *
             taken_up(runs_[run], time - delay, take_up_time_);
}

}  // namespace flyball::identification
