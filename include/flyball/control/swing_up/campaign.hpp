#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include <flyball/control/swing_up/balance.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/model_step.hpp>

namespace flyball {

/// How a swing-up is tried from many starts.
struct SwingUpTrial {
  double duration = 30.0;  ///< s, within which it has to stand.
  double period = 5e-3;    ///< s, of the controller.
  int substeps = 1;        ///< Runge-Kutta steps a period.
  /// V over the level at which it stands: from there, as proven, it does not fall.
  double settled = 0.01;
  double settling = 0.3;                                   ///< s, for which V stays below that.
  double track = std::numeric_limits<double>::infinity();  ///< m, either way, of the first state.
};

/// What became of a start.
struct SwingUpRun {
  bool stands = false;
  bool left_track = false;
  double time = 0.0;  ///< s, until it stood or the trial was over.
  double taken = std::numeric_limits<double>::infinity();  ///< s, when first the balance took over.
  int given_up = 0;                                        ///< How often the balance gave up again.
  double nearest = std::numeric_limits<double>::infinity();  ///< Least V over the level.
  double farthest = 0.0;                                     ///< Largest size of the first state.
  double largest_input = 0.0;
};

/// One start. @param model  Of N states and one input. @param controller  From a design; a copy
/// runs. Cost: four calls of the model a substep; no allocation.
template <class M, class Shaper, int N>
[[nodiscard]] SwingUpRun try_swing_up(const M& model, SwingUp<Shaper, N> controller,
                                      Eigen::Vector<double, N> x, const SwingUpTrial& trial) {
  using State = Eigen::Vector<double, N>;
  SwingUpRun run;
  controller.reset();
  const double level = controller.balance().design().take;
  const double step = trial.period / trial.substeps;
  const auto periods = static_cast<int>(std::lround(trial.duration / trial.period));
  const auto quiet = static_cast<int>(std::ceil(trial.settling / trial.period));
  int still = 0;
  bool balanced = false;
  for (int k = 0; k < periods; ++k) {
    run.time = k * trial.period;
    const Eigen::Vector<double, 1> u(controller.calculate(x));
    const double share = controller.balance().value(x) / level;
    run.nearest = std::min(run.nearest, share);
    run.largest_input = std::max(run.largest_input, std::abs(u(0)));
    if (controller.balancing() && run.taken > run.time) {
      run.taken = run.time;
    }
    run.given_up += balanced && !controller.balancing() ? 1 : 0;
    balanced = controller.balancing();
    still = balanced && share < trial.settled ? still + 1 : 0;
    if (still >= quiet) {
      run.stands = true;
      return run;
    }
    for (int part = 0; part < trial.substeps; ++part) {
      x = rk4(model, State(x), u, step);
    }
    run.farthest = std::max(run.farthest, std::abs(x(0)));
    if (run.farthest > trial.track || !x.allFinite()) {
      run.left_track = true;
      return run;
    }
  }
  return run;
}

/// A start: angles in ±π, rates in ±2 rad/s; a cart at rest in the middle.
/// @param random  Drawn from: as many numbers as states that are drawn.
template <int N>
[[nodiscard]] Eigen::Vector<double, N> random_start(Random& random, bool cart) {
  constexpr double rate = 2.0;
  Eigen::Vector<double, N> x = Eigen::Vector<double, N>::Zero();
  for (int i = cart ? 1 : 0; i < N / 2; ++i) {
    x(i) = random.uniform(-std::numbers::pi, std::numbers::pi);
  }
  for (int i = N / 2 + (cart ? 1 : 0); i < N; ++i) {
    x(i) = random.uniform(-rate, rate);
  }
  return x;
}

}  // namespace flyball
